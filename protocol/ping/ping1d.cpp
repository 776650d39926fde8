#include "protocol/ping/ping1d.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/geometry.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/conversation.hpp"
#include "protocol/ping/locate.hpp"
#include "protocol/ping/one_beam.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/sounding.hpp"

namespace sonar::ping::ping1d {
namespace {

using protocol::refused;

constexpr std::array<double, 7> gains{0.6, 1.8, 5.5, 12.9, 30.2, 66.1, 144};  // DEF: amplification of each gain_setting
static_assert(gains.size() == most_gain + 1);
constexpr int points = 200;                // from memory
constexpr std::uint32_t most_mm = 100000;  // MAN
constexpr double shortest_pulse_us = 26;   // USR: pulse at 1 m. unknown: pulses at longer ranges

SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "115 kHz";
  mode.centre_hz = 115e3f;
  mode.min_range_m = static_cast<float>(nearest_echo_m);
  mode.max_range_m = 1e-3f * most_mm;
  mode.source_level_db = 190;  // unknown: level and full scale; set so that sand needs the lowest gain at 0.5 m
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = {0};
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(30));  // MAN; a newer edition has 25
  mode.pattern.elevation_width_rad = mode.pattern.azimuth_width_rad;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(76));  // rays cover the main lobe down to -20 dB
  mode.receiver.full_scale_upa = 1.4e8f;
  SonarModel model;
  model.profile = "ping1d";
  model.name = "Ping1D";
  model.max_rate_hz = 1000;  // the rate of the shortest interval; the travel time of sound limits it further
  model.modes = {mode};
  return model;
}

std::uint32_t end_mm(const ScanRange& r) { return r.start_mm + r.length_mm; }

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

bool same_settings(const Settings& a, const Settings& b) { return a.id == b.id && a.parameters == b.parameters; }

std::string complaint(const Parameters& p) {
  if (p.range.length_mm < shortest_range_mm || p.range.length_mm > most_mm || p.range.start_mm > most_mm ||
      end_mm(p.range) > most_mm)
    return protocol::range_rule(1e-3 * shortest_range_mm, 1e-3 * most_mm, "scan_start, scan_length");
  if (p.speed_mm_per_s < 1000000 || p.speed_mm_per_s > 2000000) return "speed_of_sound is not in 1000000..2000000";
  if (p.gain > most_gain) return "gain_setting is not in 0..6";
  if (p.mode_auto > 1) return "mode_auto must be 0 or 1";
  if (p.enable > 1) return "ping_enabled must be 0 or 1";
  return {};
}

std::uint16_t transmit_us(const Parameters& p) {
  const double us_of_point = 2e6 * p.range.length_mm / points / p.speed_mm_per_s;
  return static_cast<std::uint16_t>(std::lround(std::max(us_of_point, shortest_pulse_us)));
}

PingSettings ping_settings(const Settings& settings) {
  const Parameters& p = settings.parameters;
  const double speed_mps = 1e-3 * p.speed_mm_per_s;
  PingSettings s;
  s.beam_count = 1;
  s.range_bin_count = points;
  s.range_start_m = 1e-3 * p.range.start_mm;
  s.range_m = 1e-3 * end_mm(p.range);
  s.range_bin_m = 1e-3 * p.range.length_mm / points;
  s.samples_per_row = 4;
  s.pulse_width_m = static_cast<float>(1e-6 * transmit_us(p) * speed_mps / 2);
  s.rate_hz = p.enable == 0 ? 0 : 1000.0f / static_cast<float>(std::max<int>(p.interval_ms, 1));
  s.triggered = true;
  s.gain_db = static_cast<float>(20 * std::log10(gains[p.gain]));
  s.tvg = false;  // unknown: assumed, because the seven gains alone reach from the nearest bottom to the farthest
  s.device_sound_speed_mps = static_cast<float>(speed_mps);
  s.format = {.bits = 8, .max_code = 255};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings) {
  const PingSettings s = ping_settings(settings);
  const Parameters& p = settings.parameters;
  char text[160];
  std::snprintf(text, sizeof text, "%s, %s, %.2f to %.2f m, gain %d, at most %.4g Hz, sound speed %g m/s",
                p.enable != 0 ? "pings as requested" : "standby", p.mode_auto != 0 ? "automatic" : "manual", s.range_start_m,
                s.range_m, p.gain, static_cast<double>(s.rate_hz), static_cast<double>(s.device_sound_speed_mps));
  return {s, std::make_shared<HeldSettings>(settings), text};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get());
  Parameters& p = s.parameters;
  const double low_m = 1e-3 * (p.range.start_mm + shortest_range_mm);
  const std::string why =
      protocol::first_of({protocol::range_complaint(wanted, "a Ping1D", low_m, 1e-3 * most_mm, "scan_start + scan_length"),
                          protocol::rate_complaint(wanted, "a Ping1D", device.model->max_rate_hz, "ping_interval"),
                          protocol::gain_complaint(wanted), one_beam_complaint(wanted, "a Ping1D", 8)});
  if (!why.empty()) return refused(why);
  if (wanted.range_m) {
    p.range.length_mm = static_cast<std::uint32_t>(std::lround(1000 * *wanted.range_m)) - p.range.start_mm;
    p.mode_auto = 0;
  }
  if (wanted.rate_hz) {
    p.enable = *wanted.rate_hz > 0 ? 1 : 0;
    if (p.enable != 0) p.interval_ms = static_cast<std::uint16_t>(std::lround(period_ms(*wanted.rate_hz)));
  }
  if (wanted.gain_percent) {
    p.gain = static_cast<std::uint8_t>(std::lround(*wanted.gain_percent / 100 * most_gain));
    p.mode_auto = 0;
  }
  if (const std::string rule = complaint(p); !rule.empty()) return refused("Ping1D: " + rule);
  return change_to(s);
}

// The automatic mode always starts the range at the sonar.
Parameters adjusted(const Parameters& made_with, const Echo& echo) {
  Parameters p = made_with;
  const Reach next = ping::adjusted({made_with.range.length_mm, made_with.gain}, echo, {.gains = gains, .most_mm = most_mm});
  p.range = {0, next.length_mm};
  p.gain = static_cast<std::uint8_t>(next.gain);
  return p;
}

namespace {

Bytes frame_of(Results result, const Profile& profile, BytesView samples, std::uint8_t id) {
  if (result == simple_result)
    return framed_message(Id::ping1d_distance_simple, id,
                          DistanceSimple{profile.distance_mm, static_cast<std::uint8_t>(profile.confidence)});
  if (result == distance_result) return framed_message(Id::ping1d_distance, id, static_cast<const Distance&>(profile));
  Bytes payload = wire::bytes_of(profile);
  payload.insert(payload.end(), samples.begin(), samples.end());
  return framed(Id::ping1d_profile, id, payload);
}

}  // namespace

std::vector<Bytes> frames_of(const Ping& ping) {
  const Settings s = settings_from(ping.request.vendor_settings.get());
  const PingSettings& made = ping.request.settings;
  const Results results = s.results != no_result ? s.results : profile_result;
  const Echo echo = echo_in(ping);
  Profile profile;
  profile.distance_mm = static_cast<std::uint32_t>(std::lround(1000 * echo.range_m));
  profile.confidence = static_cast<std::uint16_t>(echo.confidence);
  profile.ping = static_cast<std::uint32_t>(ping.request.number);
  // Range, pulse and gain are those with which the ping was made; the present values may differ.
  profile.start_mm = static_cast<std::uint32_t>(std::lround(1000 * made.range_start_m));
  profile.length_mm = static_cast<std::uint32_t>(std::lround(1000 * (made.range_m - made.range_start_m)));
  profile.transmit_us = static_cast<std::uint16_t>(
      std::lround(2e6 * static_cast<double>(made.pulse_width_m) / static_cast<double>(made.device_sound_speed_mps)));
  const double gain = std::pow(10, static_cast<double>(made.gain_db) / 20);
  profile.gain = static_cast<std::uint32_t>(std::lower_bound(gains.begin(), gains.end() - 1, 0.99 * gain) - gains.begin());
  profile.count = static_cast<std::uint16_t>(ping.samples.size());
  std::vector<Bytes> frames;
  for (const Results one : {simple_result, distance_result, profile_result})
    if ((results & one) != 0) frames.push_back(frame_of(one, profile, ping.samples, s.id));
  return frames;
}

std::vector<Bytes> answer(BytesView recorded, Results wanted) {
  const auto frame = whole_frame(recorded);
  if (!frame) return {};
  Profile profile;
  wire::Reader reader(frame->payload);
  if (frame->header.id == Id::ping1d_distance_simple) {
    DistanceSimple simple;
    fields(reader, simple);
    profile.distance_mm = simple.distance_mm;
    profile.confidence = simple.confidence;
  } else {
    fields(reader, static_cast<Distance&>(profile));
  }
  const Results own = results_of(frame->header.id);
  if (!reader.ok() || own == no_result) return {};
  return messages_for(wanted, recorded, own, [&](Results one) { return frame_of(one, profile, {}, frame->header.source); });
}

namespace {

using protocol::Reaction;

constexpr std::uint16_t firmware_major = 3, firmware_minor = 29, supply_mv = 5000;
constexpr double housing_above_water_c = 8;  // assumed

/// The dialogue with one host. Each setting has its own message; SoundingConversation fires the pings for the host's requests
/// and streams.
class Ping1DDialogue final : public SoundingConversation<Settings, HeldSettings, settings_from, results_of> {
 public:
  Ping1DDialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : SoundingConversation(device, port, {.revision = 1, .major = firmware_major, .minor = firmware_minor}, now) {}

 protected:
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    const Id id = frame.header.id;
    switch (id) {
      case Id::ping1d_set_device_id:
        set_id(frame, reaction);
        return true;
      case Id::ping1d_set_range: {
        ScanRange range;
        if (is_manual(frame, reaction) && read(frame, range, reaction))
          set(frame, reaction, [&](Parameters& p) { p.range = range; });
        return true;
      }
      case Id::set_sound_speed_before:
        set_value(frame, reaction, &Parameters::speed_mm_per_s);
        return true;
      case Id::ping1d_set_mode_auto:
        set_value(frame, reaction, &Parameters::mode_auto);
        return true;
      case Id::ping1d_set_interval:
        set_value(frame, reaction, &Parameters::interval_ms);
        return true;
      case Id::ping1d_set_gain:
        if (is_manual(frame, reaction)) set_value(frame, reaction, &Parameters::gain);
        return true;
      case Id::ping1d_set_enable: {
        const std::uint8_t before = settings_after(reaction).parameters.enable;
        set_value(frame, reaction, &Parameters::enable);
        if (settings_after(reaction).parameters.enable != before) forget_ping(now);  // a requested ping may not come any more
        return true;
      }
      case Id::ping1d_continuous_start:
      case Id::ping1d_continuous_stop:
        set_stream(frame, now, reaction);
        return true;
      case Id::ping1d_goto_bootloader:
        refuse(frame, "it has no bootloader", reaction);
        return true;
      default:  // older hosts request a message with its id, without a payload (CLI)
        if (frame.payload.empty()) answer(id, now, reaction);
        return frame.payload.empty();
    }
  }

 private:
  /// True in manual mode. In automatic mode the device determines range and gain, so the request is refused.
  bool is_manual(const Frame& frame, Reaction& reaction) const {
    const bool manual = settings_after(reaction).parameters.mode_auto == 0;
    if (!manual) refuse(frame, "the mode is automatic", reaction);
    return manual;
  }

  /// Starts or stops the stream of one message. Streams of several messages can run at the same time: each ping then has all of
  /// them.
  void set_stream(const Frame& frame, Time now, Reaction& reaction) {
    Id id{};
    wire::Reader reader(frame.payload);
    reader("id", id);
    if (!reader.ok()) return refuse(frame, reader.failure_text(), reaction);
    const Results result = results_of(id);
    if (result == no_result) return refuse(frame, "that message is not streamed", reaction);
    if (frame.header.id == Id::ping1d_continuous_start)
      stream(result, now, reaction);
    else
      stop_stream(result);
    reaction.replies.push_back(ack(frame.header.id, id_));
  }

  template <class Change>
  void set(const Frame& frame, Reaction& reaction, Change apply) {
    Parameters p = settings_after(reaction).parameters;
    apply(p);
    if (const std::string why = complaint(p); !why.empty()) return refuse(frame, why, reaction);
    change(reaction, [&](Settings& s) { s.parameters = p; });
    reaction.replies.push_back(ack(frame.header.id, id_));
  }
  template <class T>
  void set_value(const Frame& frame, Reaction& reaction, T Parameters::*member) {
    T value{};
    wire::Reader reader(frame.payload);
    reader("value", value);
    if (!reader.ok()) return refuse(frame, reader.failure_text(), reaction);
    set(frame, reaction, [&](Parameters& p) { p.*member = value; });
  }

  Bytes message_of(Id id, const Parameters& p) const override {
    switch (id) {
      case Id::ping1d_firmware_version:
        return framed_message(id, id_, FirmwareVersion{.major = firmware_major, .minor = firmware_minor});
      case Id::ping1d_device_id:
        return value(id, id_);
      case Id::ping1d_voltage_5:
        return value(id, supply_mv);
      case Id::ping1d_sound_speed:
        return value(id, p.speed_mm_per_s);
      case Id::ping1d_range:
        return framed_message(id, id_, p.range);
      case Id::ping1d_mode_auto:
        return value(id, p.mode_auto);
      case Id::ping1d_interval:
        return value(id, p.interval_ms);
      case Id::ping1d_gain:
        return value(id, std::uint32_t{p.gain});
      case Id::ping1d_transmit_duration:
        return value(id, transmit_us(p));
      case Id::ping1d_general_info:
        return framed_message(id, id_,
                              GeneralInfo{firmware_major, firmware_minor, supply_mv, p.interval_ms, p.gain, p.mode_auto});
      case Id::ping1d_processor_temperature:
        return value(id, centidegrees(2 * housing_above_water_c));
      case Id::ping1d_pcb_temperature:
        return value(id, centidegrees(housing_above_water_c));
      case Id::ping1d_enable:
        return value(id, p.enable);
      default:
        return {};
    }
  }
};

// The port of the bridge with which vehicles serve the serial line.
constexpr auto port_table = streaming_ports(9090, "settings, distances, profiles");

class Ping1DVendor final
    : public protocol::VendorWith<models, ping1d::apply_override, locate_ping1d, locate_ping1d, SoundingVendor> {
 public:
  std::string_view name() const override { return "ping1d"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override {
    static const std::array<protocol::Option, 2> all{
        {type_option("1", "number of the product in its device information"), silence_option()}};
    return all;
  }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override { return change_to(Settings{}); }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 100.0 / 6 * settings_from(device.settings.get()).parameters.gain;
  }
  std::optional<protocol::ChangeSettings> after_ping(const Ping& ping, const protocol::DeviceState& device) const override {
    Settings s = settings_from(device.settings.get());
    if (s.parameters.mode_auto == 0) return std::nullopt;
    const Parameters before = settings_from(ping.request.vendor_settings.get()).parameters;
    if (before.range.start_mm != s.parameters.range.start_mm || before.range.length_mm != s.parameters.range.length_mm ||
        before.gain != s.parameters.gain)
      return std::nullopt;  // a host has changed range or gain since: the ping does not show whether the new ones fit
    const Parameters next = adjusted(s.parameters, echo_in(ping));
    if (next == s.parameters) return std::nullopt;
    s.parameters = next;
    return change_to(s);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return std::make_unique<Ping1DDialogue>(device, port, now);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState&) const override { return ping1d::frames_of(ping); }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<Ping1DVendor>(); }

}  // namespace sonar::ping::ping1d
