#include <charconv>
#include <cmath>

#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/models.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

using protocol::HostActions;

constexpr std::string_view title = "an Oculus";

Result<PolarImage> picture_of(const DecodedPing& ping) {
  if (!ping.has_image || ping.rows() == 0 || ping.beams() == 0)
    return failure(ErrorKind::bad_data,
                   "ping " + std::to_string(ping.head.fixed.ping_id) + " does not hold the image it announces");
  PolarImage image;
  image.rows = ping.rows();
  image.beams = ping.beams();
  image.row_spacing_m = ping.head.fixed.range_resolution_m;
  for (std::size_t beam = 0; beam < image.beams; ++beam) image.azimuth_rad.push_back(ping.azimuth_rad(beam));
  image.samples.reserve(image.rows * image.beams);
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = 0; beam < image.beams; ++beam) image.samples.push_back(static_cast<float>(ping.sample(row, beam)));
  image.full_scale = 254;  // samples of 8 bits saturate there
  // Wider samples are seldom near their maximum, so with their maximum as full scale the picture would be black.
  if (ping.bytes_per_sample() > 1) image.full_scale = image.brightest(999);
  return image;
}

protocol::PingFacts facts_of(const DecodedPing& ping) {
  const PingResultV2& f = ping.head.fixed;
  return {f.ping_id,
          f.beam_count,
          f.row_count,
          static_cast<unsigned>(8 * ping.bytes_per_sample()),
          f.range_resolution_m,
          f.row_count * f.range_resolution_m,
          f.frequency_hz,
          ping.message.size()};
}

/// Returns the requested values that the sonar could not use. The sonar echoes the request, but pings with the nearest values.
std::vector<std::string> limits_of(const FireSettings& asked, const protocol::PingFacts& made) {
  std::vector<std::string> limits;
  constexpr double whole_rows = 1.5;  // a range ends with a whole row
  if ((asked.flags & flag::range_in_metres) != 0 && std::abs(made.range_m - asked.range) > whole_rows * made.row_m)
    limits.push_back(text::format("range %.2f m, not %g m", made.range_m, asked.range));
  if ((asked.flags & flag::beams_512) != 0 && made.beams < 512) limits.push_back(text::format("%u beams, not 512", made.beams));
  return limits;
}

/// Sends a fire message when the connection is open, and again after each ping until the echoed settings agree with it, as ENS
/// does. Nothing else is sent, because the device then pings without requests. `asked` is absent if the sonar must keep its
/// settings.
class OculusHost final : public protocol::Host {
 public:
  OculusHost(std::optional<FireRequest> asked, bool triggered) : asked_(std::move(asked)), triggered_(triggered) {}

  HostActions on_open(std::span<const std::uint16_t>, Time) override {
    HostActions actions;
    ask(actions);
    return actions;
  }

  HostActions on_bytes(std::size_t, wire::BytesView received, Time) override {
    HostActions actions;
    decoder_.append(received);
    while (auto message = decoder_.next()) {
      ++counts_.messages;
      if (auto* ping = std::get_if<DecodedPing>(&*message)) on_ping(std::move(*ping), actions);
      if (std::holds_alternative<DummyMessage>(*message)) ++counts_.dummies;
      if (const auto* other = std::get_if<OtherMessage>(&*message))
        actions.emplace_back(protocol::Notice{
            text::format("other message, type 0x%04x, %zu bytes: ", static_cast<unsigned>(other->header.type), other->size) +
            other->why});
      if (const auto* text = std::get_if<LogText>(&*message))
        actions.emplace_back(protocol::Notice{"message of the device: " + text->text});
    }
    return actions;
  }

  std::string about() const override { return std::string(title); }
  std::optional<Counts> counts() const override {
    Counts counts = counts_;
    counts.junk_bytes = decoder_.skipped_bytes();
    counts.missing_pings = sequence_.skipped_ids();
    return counts;
  }
  bool expects_echo() const override { return asked_.has_value(); }

 private:
  void ask(HostActions& actions) const {
    if (asked_) actions.emplace_back(protocol::HostSend{0, make_fire(*asked_)});
  }

  void on_ping(DecodedPing ping, HostActions& actions) {
    protocol::HostPing out;
    out.facts = facts_of(ping);
    out.errors = ping.violations;
    for (std::string& error : sequence_.add(ping)) out.errors.push_back(std::move(error));
    if (asked_) out.echo_mismatches = echo_violations(*asked_, ping);
    if (asked_ && out.echo_mismatches.empty()) out.limited = limits_of(asked_->settings, out.facts);
    if (const double s = ping.head.fixed.ping_start_time_s; s > 0) out.fired_s = s;
    is_satisfied_ = is_satisfied_ || out.echo_mismatches.empty();
    out.picture = [kept = std::make_shared<const DecodedPing>(std::move(ping))] { return picture_of(*kept); };
    actions.emplace_back(std::move(out));
    // With network trigger each ping needs a request.
    if (triggered_ || !is_satisfied_) ask(actions);
  }

  std::optional<FireRequest> asked_;
  bool triggered_, is_satisfied_ = false;
  Decoder decoder_;
  PingSequence sequence_;
  Counts counts_;
};

}  // namespace

Result<FireRequest> fire_from(const protocol::Wanted& wanted) {
  using protocol::accept_settings;
  if (auto known = accept_settings(wanted, title,
                                   {"range", "rate", "gain", "mode", "beams", "bits", "gains", "range-percent", "gamma",
                                    "speed-of-sound", "salinity", "version", "gain-assist", "trigger"});
      !known)
    return tl::unexpected(known.error());
  const auto number = [&wanted](const char* name, double usual) {
    const auto found = wanted.more.find(name);
    if (found != wanted.more.end()) std::from_chars(found->second.data(), found->second.data() + found->second.size(), usual);
    return usual;
  };
  const protocol::SettingsOverride& from = wanted.settings;
  if (const std::string why = protocol::rate_complaint(from, title, models().front()->max_rate_hz); !why.empty())
    return protocol::refused(why);
  FireRequest fire;
  // 32-bit samples and the time in seconds need the long form of version 2.
  fire.version = static_cast<std::uint16_t>(from.sample_bits == 32u ? 2 : number("version", wanted.stamped ? 2 : 0));
  FireSettings& s = fire.settings;
  if (from.mode > 1u) return failure(ErrorKind::usage, "an Oculus has modes 1 and 2");
  s.mode = static_cast<std::uint8_t>(from.mode.value_or(1) + 1);
  s.ping_rate = from.rate_hz == 0.0 ? PingRate::standby : nearest_rate(from.rate_hz.value_or(10));
  s.gamma = static_cast<std::uint8_t>(number("gamma", 127));
  const double percent = number("range-percent", 0);
  s.flags = flag::simple_result;
  if (percent <= 0) s.flags |= flag::range_in_metres;
  if (from.beams.value_or(512) == 512) s.flags |= flag::beams_512;
  if (from.sample_bits.value_or(8) > 8) s.flags |= flag::samples_16_bit;
  if (from.row_gains.value_or(false)) s.flags |= flag::row_gains;
  if (wanted.more.contains("gain-assist")) s.flags |= flag::gain_assist;
  if (wanted.more.contains("trigger")) s.flags |= flag::network_trigger;
  if (from.sample_bits == 32u) fire.extension.flags = flag::extended_32_bit;
  s.range = percent > 0 ? percent : from.range_m.value_or(10);
  s.gain_percent = from.gain_percent.value_or(50);
  s.sound_speed_mps = number("speed-of-sound", 0);
  s.salinity_ppt = number("salinity", 0);
  return fire;
}

std::optional<protocol::Announcement> announced(wire::BytesView datagram) {
  const auto status = decode_status(datagram);
  if (!status) return std::nullopt;
  return protocol::Announcement{status->ip_address, status->connected_ip, status->device_id,
                                status_violations(*status, datagram.size())};
}

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  std::optional<FireRequest> asked;
  if (!wanted.as_it_is) {
    auto fire = fire_from(wanted);
    if (!fire) return tl::unexpected(fire.error());
    asked = *fire;
  }
  return std::make_unique<OculusHost>(asked, wanted.more.contains("trigger"));
}

}  // namespace sonar::oculus
