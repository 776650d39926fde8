#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"
#include "tests/example_make/example.hpp"
#include "tests/example_make/messages.hpp"

namespace sonar::example_make {
namespace {

using protocol::ChangeSettings;
using protocol::DeviceState;

constexpr int beams = 64, rows = 200;
constexpr std::array<protocol::Port, 1> port_table{
    {{.kind = protocol::Port::Kind::tcp_stream, .number = tcp_port, .carries = "settings, pings"}}};

struct HeldSettings final : VendorSettings {
  explicit HeldSettings(const Settings& s) : settings(s) {}
  bool equals(const VendorSettings& other) const override { return static_cast<const HeldSettings&>(other).settings == settings; }
  Settings settings;
};
Settings settings_from(const VendorSettings* held) {
  return held != nullptr ? static_cast<const HeldSettings*>(held)->settings : Settings{};
}

bool is_valid(const Settings& s) {
  return s.range_mm >= 500 && s.range_mm <= 50000 && s.rate_centihz <= 2000 && s.gain_percent <= 100;
}

ChangeSettings change_to(const Settings& s) {
  PingSettings p;
  p.beam_count = beams;
  p.range_bin_count = rows;
  p.range_m = 1e-3 * s.range_mm;
  p.range_bin_m = p.range_m / rows;
  p.pulse_width_m = static_cast<float>(p.range_bin_m);
  p.rate_hz = 0.01f * static_cast<float>(s.rate_centihz);
  p.gain_db = 0.6f * static_cast<float>(s.gain_percent) - 30;
  p.format = {.bits = 8, .max_code = 255};
  return {p, std::make_shared<HeldSettings>(s), std::to_string(s.range_mm) + " mm"};
}

class ExampleDialogue final : public protocol::Dialogue {
 public:
  protocol::Reaction on_bytes(BytesView received, Time now) override {
    protocol::Reaction reaction;
    splitter_.append(now, received);
    while (const auto whole = splitter_.next()) {
      const bool is_message = framing.begins_message(whole->bytes, recording::Origin::client);
      const auto wanted =
          is_message && kind_of(whole->bytes) == Kind::settings ? payload_of<Settings>(whole->bytes) : std::nullopt;
      if (wanted && is_valid(*wanted)) {
        reaction.events.emplace_back(change_to(*wanted));
        reaction.replies.push_back(message(Kind::accepted, wire::bytes_of(*wanted)));
      } else if (is_message) {
        reaction.replies.push_back(message(Kind::refused, {}));
      } else {
        reaction.events.emplace_back(protocol::Notice{std::to_string(whole->bytes.size()) + " bytes that are not a message"});
      }
    }
    return reaction;
  }
  protocol::Reaction on_tick(Time, bool) override { return {}; }
  Time next_tick() const override { return Time::max(); }
  void on_ping_queued(Time) override {}

 private:
  recording::MessageSplitter splitter_{recording::Origin::client, framing};
};

std::shared_ptr<const SonarModel> make_model() {
  FrequencyMode mode;
  mode.name = "700 kHz";
  mode.centre_hz = 700e3f;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(120));
  mode.max_range_m = 50;
  mode.source_level_db = 210;
  mode.beam_spacing = BeamSpacing::uniform_in_angle;
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(2));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(20));
  mode.receiver.full_scale_upa = 1e8f;
  SonarModel model;
  model.profile = "example-64";
  model.name = "Example 64";
  model.max_rate_hz = 20;
  model.modes = {mode};
  return std::make_shared<const SonarModel>(std::move(model));
}

class ExampleVendor final : public protocol::Vendor {
 public:
  std::string_view name() const override { return "example"; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return models_; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  int default_max_clients() const override { return 1; }
  ChangeSettings initial_settings(const DeviceState&) const override { return change_to({}); }
  Result<ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const DeviceState& device) const override {
    Settings s = settings_from(device.settings.get());
    if (wanted.range_m) s.range_mm = static_cast<std::uint32_t>(std::lround(1000 * std::clamp(*wanted.range_m, 0.0, 1e3)));
    if (wanted.rate_hz) s.rate_centihz = static_cast<std::uint16_t>(std::lround(100 * std::clamp(*wanted.rate_hz, 0.0, 600.0)));
    if (wanted.gain_percent)
      s.gain_percent = static_cast<std::uint8_t>(std::lround(std::clamp(*wanted.gain_percent, 0.0, 255.0)));
    if (wanted.mode.value_or(0) != 0 || wanted.beams.value_or(beams) != beams || wanted.sample_bits.value_or(8) != 8 ||
        wanted.row_gains.value_or(false))
      return failure(ErrorKind::usage, "an Example has one mode, 64 beams and samples of 8 bits");
    if (!is_valid(s)) return failure(ErrorKind::usage, "an Example has 0.5 to 50 m, up to 20 Hz and 0 to 100 %");
    return change_to(s);
  }
  double gain_percent(const DeviceState& device) const override { return settings_from(device.settings.get()).gain_percent; }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const DeviceState&, Time) const override {
    return std::make_unique<ExampleDialogue>();
  }
  std::shared_ptr<const Bytes> frame(const Ping& ping, const DeviceState& device) const override {
    const Settings s = settings_from(ping.request.vendor_settings.get());
    PingHead head;
    head.number = static_cast<std::uint32_t>(ping.request.number);
    head.fired_us = static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(ping.request.fired_at.time_since_epoch()).count());
    head.range_mm = s.range_mm;
    head.beams = static_cast<std::uint16_t>(ping.request.settings.beam_count);
    head.rows = static_cast<std::uint16_t>(ping.request.settings.range_bin_count);
    head.frequency_hz = device.model->modes.front().centre_hz;
    head.gain_percent = s.gain_percent;
    Bytes payload = wire::bytes_of(head);
    wire::Writer write(payload);
    for (const float rad : ping.beam_azimuth_rad) {
      const auto bearing = static_cast<std::int16_t>(std::lround(1e4f * rad));
      write("bearing", bearing);
    }
    payload.insert(payload.end(), ping.samples.begin(), ping.samples.end());
    return std::make_shared<const Bytes>(message(Kind::ping, payload));
  }
  std::optional<protocol::Field> field(protocol::Part part, protocol::FieldName name, BytesView ping) const override {
    return part == protocol::Part::ping ? wire::locate<PingMessage>(name, ping) : std::nullopt;
  }
  std::optional<std::pair<std::size_t, std::size_t>> region(protocol::Region region, BytesView ping) const override {
    if (ping.empty()) return std::pair<std::size_t, std::size_t>{};
    const auto head = ping.size() > header_size ? payload_of<PingHead>(ping) : std::nullopt;
    if (!head) return {};
    const std::size_t bearings_at = header_size + head_size, image_at = bearings_at + 2u * head->beams;
    if (ping.size() < image_at) return {};
    switch (region) {
      case protocol::Region::header:
        return std::pair{std::size_t{0}, header_size};
      case protocol::Region::metadata:
        return std::pair{header_size, head_size};
      case protocol::Region::bearings:
        return std::pair{bearings_at, image_at - bearings_at};
      case protocol::Region::image:
        return std::pair{image_at, ping.size() - image_at};
    }
    return {};
  }

 private:
  std::array<std::shared_ptr<const SonarModel>, 1> models_{make_model()};
};

}  // namespace

const protocol::Vendor& vendor() {
  static const ExampleVendor only;
  return only;
}

}  // namespace sonar::example_make
