#include "protocol/ping/s500.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/locate.hpp"
#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/one_beam.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/sounding.hpp"

namespace sonar::ping::s500 {
namespace {

using protocol::refused;

constexpr int points = 1024;                // DEF: number of powers in a profile of one frequency
constexpr std::uint32_t most_mm = 142000;   // CLI: limit of the hosts
constexpr int fastest_ms = 100;             // MAN: at most 10 pings per second
constexpr double shortest_pulse_us = 20;    // unknown: assumed
constexpr double db_per_gain = 4;           // unknown: assumed, as are the level and full scale
constexpr std::size_t averaged_pings = 20;  // DEF

/// Returns the amplification of each gain_index.
const std::array<double, 14>& gains() {
  static const auto all = [] {
    std::array<double, 14> made{};
    for (std::size_t i = 0; i < made.size(); ++i) made[i] = std::pow(10, db_per_gain * static_cast<double>(i) / 20);
    return made;
  }();
  return all;
}
int most_gain() { return static_cast<int>(gains().size()) - 1; }

SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "500 kHz";
  mode.centre_hz = 500e3f;
  mode.min_range_m = static_cast<float>(nearest_echo_m);
  mode.max_range_m = 1e-3f * most_mm;
  mode.source_level_db = 205;
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = {0};
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(5));  // CLI
  mode.pattern.elevation_width_rad = mode.pattern.azimuth_width_rad;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(13));  // rays cover the main lobe down to -20 dB
  mode.receiver.full_scale_upa = 1e9f;
  SonarModel model;
  model.profile = "s500";
  model.name = "S500";
  model.max_rate_hz = 1000.0 / fastest_ms;
  model.modes = {mode};
  return model;
}

/// Returns the mean distance of the pings with an echo, and the mean confidence of all pings.
Echo average(std::span<const Echo> echoes) {
  Echo mean;
  int sure = 0, confidence = 0;
  for (const Echo& echo : echoes) {
    confidence += echo.confidence;
    if (echo.confidence == 0) continue;
    mean.range_m += echo.range_m;
    ++sure;
  }
  mean.range_m = sure > 0 ? mean.range_m / sure : 0;
  mean.confidence = echoes.empty() ? 0 : static_cast<int>(std::lround(confidence / static_cast<double>(echoes.size())));
  return mean;
}
std::vector<Echo> with(std::vector<Echo> earlier, const Echo& newest) {
  earlier.push_back(newest);
  if (earlier.size() > averaged_pings) earlier.erase(earlier.begin());
  return earlier;
}

std::uint32_t mm(double metres) { return static_cast<std::uint32_t>(std::lround(1000 * metres)); }

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

bool same_settings(const Settings& a, const Settings& b) {
  const auto all = [](const Settings& s) {
    const Parameters& p = s.parameters;
    return std::tuple(s.id, p.ping, p.reach.length_mm, p.reach.gain, p.speed_mm_per_s, p.enable);
  };
  return all(a) == all(b);
}

// A length of 0 selects the automatic range, a gain of -1 the automatic gain (DEF).
std::string complaint(const SetPingParams& p) {
  const std::uint32_t length_mm = p.length_mm != 0 ? p.length_mm : shortest_range_mm;
  if (length_mm < shortest_range_mm || p.start_mm > most_mm || length_mm > most_mm - p.start_mm)
    return protocol::range_rule(1e-3 * shortest_range_mm, 1e-3 * most_mm, "length_mm; 0: automatic");
  if (p.gain < -1 || p.gain > most_gain()) return "gain_index is not in -1..13";
  if (p.period_ms < -1) return "msec_per_ping is not in -1..32767";
  if (p.report != Id{} && p.report != Id::s500_distance2 && p.report != Id::s500_profile6)
    return "report_id must be 0, 1223 or 1308";
  return p.chirp > 1 ? "chirp must be 0 or 1" : "";
}

// An automatic range or gain starts from the present value.
Parameters requested(const Parameters& before, const SetPingParams& wanted) {
  Parameters p = before;
  p.ping = wanted;
  p.enable = wanted.report == Id{} ? 0 : 1;
  if (wanted.length_mm != 0) p.reach.length_mm = wanted.length_mm;
  if (wanted.gain >= 0) p.reach.gain = wanted.gain;
  p.reach.length_mm = std::min(p.reach.length_mm, most_mm - wanted.start_mm);
  return p;
}

int interval_ms(const Parameters& p) { return std::max<int>(p.ping.period_ms, fastest_ms); }

PingSettings ping_settings(const Settings& settings) {
  const Parameters& p = settings.parameters;
  const double speed_mps = 1e-3 * p.speed_mm_per_s, length_m = 1e-3 * p.reach.length_mm;
  PingSettings s;
  s.beam_count = 1;
  s.range_bin_count = points;
  s.range_start_m = 1e-3 * p.ping.start_mm;
  s.range_m = s.range_start_m + length_m;
  s.range_bin_m = length_m / points;
  s.samples_per_row = 2;
  s.pulse_width_m = static_cast<float>(std::max(2 * s.range_bin_m, 1e-6 * shortest_pulse_us * speed_mps / 2));
  s.rate_hz = p.enable == 0 ? 0 : 1000.0f / static_cast<float>(interval_ms(p));
  s.triggered = true;
  s.gain_db = static_cast<float>(db_per_gain * p.reach.gain);
  s.tvg = false;
  s.device_sound_speed_mps = static_cast<float>(speed_mps);
  s.format = {.bits = 16, .max_code = 65535, .scale = SampleFormat::Scale::logarithmic, .floor_db = -140, .ceiling_db = 20};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings) {
  const PingSettings s = ping_settings(settings);
  const Parameters& p = settings.parameters;
  return {s, std::make_shared<HeldSettings>(settings),
          text::format("%s, %.2f to %.2f m%s, gain %d%s, at most %.4g Hz, sound speed %g m/s",
                       p.enable != 0 ? "pings as requested" : "standby", s.range_start_m, s.range_m,
                       p.ping.length_mm == 0 ? " (automatic)" : "", p.reach.gain, p.ping.gain < 0 ? " (automatic)" : "",
                       static_cast<double>(s.rate_hz), static_cast<double>(s.device_sound_speed_mps))};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get());
  Parameters& p = s.parameters;
  SetPingParams asked = p.ping;
  const double low_m = 1e-3 * (asked.start_mm + shortest_range_mm);
  const std::string why = protocol::first_of(
      {protocol::range_complaint(wanted, "an S500", low_m, 1e-3 * most_mm, "start_mm + length_mm"),
       protocol::gain_complaint(wanted), protocol::rate_complaint(wanted, "an S500", device.model->max_rate_hz, "msec_per_ping"),
       one_beam_complaint(wanted, "an S500", 16)});
  if (!why.empty()) return refused(why);
  if (wanted.range_m) asked.length_mm = static_cast<std::uint32_t>(std::lround(1000 * *wanted.range_m)) - asked.start_mm;
  if (wanted.gain_percent) asked.gain = static_cast<std::int16_t>(std::lround(*wanted.gain_percent / 100 * most_gain()));
  if (wanted.rate_hz && *wanted.rate_hz > 0) asked.period_ms = static_cast<std::int16_t>(std::lround(period_ms(*wanted.rate_hz)));
  if (const std::string rule = complaint(asked); !rule.empty()) return refused("S500: " + rule);
  const std::uint8_t enabled = p.enable;
  p = requested(p, asked);
  p.enable = wanted.rate_hz ? *wanted.rate_hz > 0 : enabled;
  return change_to(s);
}

double gain_percent(const Parameters& p) { return 100.0 / most_gain() * p.reach.gain; }

// The echo is always kept, for the mean of the distances; range and gain depend on it only if they are automatic.
Settings after(const Ping& ping, const Settings& now) {
  const Echo echo = echo_in(ping);
  Settings next = now;
  next.earlier = with(now.earlier, echo);
  Parameters& p = next.parameters;
  const Parameters made_with = settings_from(ping.request.vendor_settings.get()).parameters;
  const std::uint32_t start_mm = p.ping.start_mm;
  // If a host has changed range or gain since, the ping does not show whether the new values fit.
  if (made_with.ping.start_mm != start_mm || made_with.reach.length_mm != p.reach.length_mm ||
      made_with.reach.gain != p.reach.gain)
    return next;
  const Reach chosen = adjusted({start_mm + p.reach.length_mm, p.reach.gain}, echo, {gains(), most_mm});
  if (p.ping.length_mm == 0) p.reach.length_mm = std::max(chosen.length_mm, start_mm + shortest_range_mm) - start_mm;
  if (p.ping.gain < 0) p.reach.gain = chosen.gain;
  return next;
}

namespace {

Bytes frame_of(Results result, const Distance2& distance, const Profile6& profile, BytesView samples, std::uint8_t id) {
  if (result == altitude_result)
    return framed_message(Id::ping1d_distance_simple, id, DistanceSimple{distance.ping_mm, distance.ping_confidence});
  if (result == distance_result) return framed_message(Id::s500_distance2, id, distance);
  Bytes payload = wire::bytes_of(profile);
  payload.insert(payload.end(), samples.begin(), samples.end());
  return framed(Id::s500_profile6, id, payload);
}
/// True if a recorded distance fits into the messages.
bool is_distance(float m) { return m >= 0 && m < 4e6f; }

}  // namespace

std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) {
  const Settings s = settings_from(ping.request.vendor_settings.get());
  const PingSettings& made = ping.request.settings;
  const Results results = s.results != no_result ? s.results : profile_result;
  const Echo echo = echo_in(ping), averaged = average(with(s.earlier, echo));
  const auto power_up_ms = static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(ping.request.fired_at - device.powered_up_at).count());
  const auto confidence = static_cast<std::uint8_t>(echo.confidence);
  const Distance2 distance{mm(echo.range_m), mm(averaged.range_m), 0, confidence, static_cast<std::uint8_t>(averaged.confidence),
                           power_up_ms};
  Profile6 profile;
  profile.ping = static_cast<std::uint32_t>(ping.request.number) - 1;  // ping_number counts from 0
  profile.start_mm = mm(made.range_start_m);
  profile.length_mm = mm(made.range_m - made.range_start_m);
  profile.start_hz = profile.end_hz = static_cast<std::uint32_t>(device.model->modes.front().centre_hz);
  profile.sampling_hz = static_cast<std::uint32_t>(std::lround(static_cast<double>(made.device_sound_speed_mps) /
                                                               (2 * made.range_bin_m)));  // unknown: here the rate of the powers
  profile.power_up_ms = power_up_ms;
  profile.pulse_s = 2 * made.pulse_width_m / made.device_sound_speed_mps;
  profile.analog_gain = made.gain_db;
  profile.highest_db = made.format.ceiling_db;
  profile.lowest_db = made.format.floor_db;
  profile.depth_m = static_cast<float>(echo.range_m);
  profile.smooth_depth_m = static_cast<float>(averaged.range_m);
  profile.confidence = confidence;
  profile.gain = static_cast<std::uint8_t>(std::lround(static_cast<double>(made.gain_db) / db_per_gain));
  profile.decimation = s.parameters.ping.decimation;
  profile.smooth_confidence = static_cast<std::uint8_t>(averaged.confidence);
  profile.results = static_cast<std::uint16_t>(ping.samples.size() / 2);
  std::vector<Bytes> frames;
  for (const Results one : {altitude_result, distance_result, profile_result})
    if ((results & one) != 0) frames.push_back(frame_of(one, distance, profile, ping.samples, s.id));
  return frames;
}

std::vector<Bytes> answer(BytesView recorded, Results wanted) {
  const auto frame = whole_frame(recorded);
  if (!frame) return {};
  Distance2 distance;
  Profile6 profile;
  wire::Reader reader(frame->payload);
  const Results own = results_of(frame->header.id);
  if (own == profile_result) {
    fields(reader, profile);
    if (!is_distance(profile.depth_m) || !is_distance(profile.smooth_depth_m)) return {};
    distance = {mm(static_cast<double>(profile.depth_m)),
                mm(static_cast<double>(profile.smooth_depth_m)),
                0,
                profile.confidence,
                profile.smooth_confidence,
                profile.power_up_ms};
  } else {
    if (own == altitude_result) {
      DistanceSimple altitude;
      fields(reader, altitude);
      distance.ping_mm = distance.averaged_mm = altitude.distance_mm;
      distance.ping_confidence = distance.averaged_confidence = altitude.confidence;
    } else {
      fields(reader, distance);
    }
    profile.depth_m = 1e-3f * static_cast<float>(distance.ping_mm);
    profile.smooth_depth_m = 1e-3f * static_cast<float>(distance.averaged_mm);
    profile.confidence = distance.ping_confidence;
    profile.smooth_confidence = distance.averaged_confidence;
    profile.power_up_ms = distance.power_up_ms;
  }
  if (!reader.ok() || own == no_result) return {};
  return messages_for(wanted, recorded, own,
                      [&](Results one) { return frame_of(one, distance, profile, {}, frame->header.source); });
}

namespace {

using protocol::Reaction;

constexpr auto port_table = streaming_ports(51200, "settings, profiles");
constexpr std::uint16_t firmware_major = 2, firmware_minor = 2;
constexpr double processor_above_water_c = 20;  // assumed

/// The dialogue with one host. One message, set_ping_params (1015), sets all except the sound speed, and starts or ends the
/// pings; SoundingConversation fires the pings.
class S500Dialogue final : public SoundingConversation<Settings, HeldSettings, settings_from, results_of> {
 public:
  S500Dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : SoundingConversation(device, port, {.major = firmware_major, .minor = firmware_minor}, now) {}

 protected:
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    if (frame.header.id == Id::s500_set_ping_params) {
      SetPingParams wanted;
      if (!read(frame, wanted, reaction)) return true;
      if (const std::string why = complaint(wanted); !why.empty()) return refuse(frame, why, reaction), true;
      change(reaction, [&](Settings& s) { s.parameters = requested(s.parameters, wanted); });
      // This request replaces the previous one, to which a ping in progress and the stream belong.
      forget_ping(now);
      stop_stream(~no_result);
      const Results result = results_of(wanted.report);
      if (result != no_result && wanted.period_ms < 0) want_once(result, now, reaction);
      if (result != no_result && wanted.period_ms >= 0) stream(result, now, reaction);
      reaction.replies.push_back(ack(frame.header.id, id_));
      return true;
    }
    if (frame.header.id == Id::set_sound_speed_before) {
      SoundSpeed speed;
      if (!read(frame, speed, reaction)) return true;
      if (speed.mm_per_s < 1000000 || speed.mm_per_s > 2000000)
        return refuse(frame, "sos_mm_per_sec is not in 1000000..2000000", reaction), true;
      change(reaction, [&](Settings& s) { s.parameters.speed_mm_per_s = speed.mm_per_s; });
      reaction.replies.push_back(ack(frame.header.id, id_));
      return true;
    }
    // The maker's description allows requests with the id of the requested message, without a payload.
    if (frame.payload.empty()) answer(frame.header.id, now, reaction);
    return frame.payload.empty();
  }

 private:
  Bytes message_of(Id id, const Parameters& p) const override {
    switch (id) {
      case Id::ping1d_firmware_version:
        return framed_message(id, id_, FirmwareVersion{.type = 0, .model = 0, .major = firmware_major, .minor = firmware_minor});
      case Id::ping1d_sound_speed:
        return value(id, p.speed_mm_per_s);
      case Id::ping1d_range:
        return framed_message(id, id_, ScanRange{p.ping.start_mm, p.reach.length_mm});
      case Id::ping1d_interval:
        return value(id, static_cast<std::uint16_t>(interval_ms(p)));
      case Id::ping1d_gain:
        return value(id, static_cast<std::uint32_t>(p.reach.gain));
      case Id::ping1d_processor_temperature:
        return value(id, std::uint32_t{centidegrees(processor_above_water_c)});
      default:
        return {};
    }
  }
};

class S500Vendor final : public protocol::VendorWith<models, s500::apply_override, locate_s500, locate_s500, SoundingVendor> {
 public:
  std::string_view name() const override { return "s500"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return streaming_options(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override { return change_to(Settings{}); }
  double gain_percent(const protocol::DeviceState& device) const override {
    return s500::gain_percent(settings_from(device.settings.get()).parameters);
  }
  std::optional<protocol::ChangeSettings> after_ping(const Ping& ping, const protocol::DeviceState& device) const override {
    return change_to(after(ping, settings_from(device.settings.get())));
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return std::make_unique<S500Dialogue>(device, port, now);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) const override {
    return s500::frames_of(ping, device);
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<S500Vendor>(); }

}  // namespace sonar::ping::s500
