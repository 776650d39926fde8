#include "protocol/ping/omniscan.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/conversation.hpp"
#include "protocol/ping/locate.hpp"
#include "protocol/ping/one_beam.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping::omniscan {
namespace {

using protocol::refused;

constexpr double db_per_gain = 6;  // unknown: assumed, as are full scale and the source level
constexpr int most_gain = 7;
constexpr std::uint32_t least_length_mm = 100, longest_mm = 150000;
constexpr double longest_m = 1e-3 * longest_mm;
constexpr double processing_s = 0.0018;  // time from the last echo to the next ping (recording of a 450 FS)

SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "450 kHz";
  mode.centre_hz = 450e3f;
  mode.min_range_m = 0.3f;
  mode.max_range_m = static_cast<float>(longest_m);
  mode.source_level_db = 205;
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = {0};
  // The width along the track is that of the Omniscan 3D 450 SS, which the maker states. The width across is from memory.
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(0.8));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(50));
  mode.horizontal_aperture_rad = mode.pattern.azimuth_width_rad;
  mode.receiver.full_scale_upa = 1e5f;
  SonarModel model;
  model.profile = "omniscan-450";
  model.name = "Omniscan 450";
  model.max_rate_hz = static_cast<float>(1 / (travel_s(1e-3 * least_length_mm, fastest_mps) + processing_s));
  model.modes = {mode};
  return model;
}

/// The powers of a ping, scaled so that the lowest is 0 and the highest 65535 (recording of a 450 FS).
struct Powers {
  float lowest_db = 0, highest_db = 0;
  Bytes codes;
};
Powers scaled(BytesView samples, const SampleFormat& format) {
  std::vector<std::uint16_t> values(samples.size() / 2);
  wire::Reader reader(samples);
  for (std::uint16_t& value : values) reader("power", value);
  if (values.empty()) return {};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double first = *low, steps = std::max(*high - *low, 1);
  const auto db_of = [&format](std::uint16_t value) {
    return format.floor_db +
           (format.ceiling_db - format.floor_db) * static_cast<float>(value) / static_cast<float>(format.max_code);
  };
  Powers powers{db_of(*low), db_of(*high), {}};
  for (const std::uint16_t value : values) {
    const auto code = static_cast<std::uint16_t>(std::lround((value - first) / steps * 65535));
    powers.codes.push_back(static_cast<std::byte>(code & 0xFF));
    powers.codes.push_back(static_cast<std::byte>(code >> 8));
  }
  return powers;
}

/// Returns the heading of the middle of the beam, clockwise from north.
double heading_deg(const Pose& sonar_in_world) {
  const Vec3d ahead = rotate(sonar_in_world.orientation, Vec3d{1, 0, 0});
  const double deg = deg_from_rad(std::atan2(ahead.x, ahead.y));
  return deg < 0 ? deg + 360 : deg;
}

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

std::string complaint(const OsPingParams& p) {
  if (p.length_mm < least_length_mm || p.start_mm > longest_mm || p.length_mm > longest_mm - p.start_mm)
    return protocol::range_rule(1e-3 * least_length_mm, longest_m, "start_mm, length_mm");
  if (p.gain < -1 || p.gain > most_gain) return "gain_index is not in -1..7";
  if (p.results < 200 || p.results > 1200) return "num_results is not in 200..1200";
  if (!(p.pulse_part >= 0 && p.pulse_part <= 1)) return "pulse_len_percent is not in 0..1";
  return {};
}

PingSettings ping_settings(const Settings& settings) {
  const OsPingParams& p = settings.parameters;
  const double length_m = 1e-3 * p.length_mm;
  PingSettings s;
  s.beam_count = 1;
  s.range_start_m = 1e-3 * p.start_mm;
  s.range_m = s.range_start_m + length_m;
  s.range_bin_count = p.results;
  s.range_bin_m = length_m / p.results;
  s.pulse_width_m = static_cast<float>(std::max(static_cast<double>(p.pulse_part) * s.range_m, s.range_bin_m / 2));
  const double shortest_s = travel_s(s.range_m, static_cast<double>(settings.speed_mps)) + processing_s;
  s.rate_hz = p.enable == 0 ? 0 : static_cast<float>(1 / std::max(1e-3 * p.period_ms, shortest_s));
  s.gain_db = static_cast<float>(db_per_gain * std::max<int>(p.gain, 0));
  s.tvg = false;  // powers are sent without a time-varied gain
  s.device_sound_speed_mps = settings.speed_mps;
  s.format = {.bits = 16, .max_code = 65535, .scale = SampleFormat::Scale::logarithmic, .floor_db = -80, .ceiling_db = 80};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings) {
  const PingSettings s = ping_settings(settings);
  return {s, std::make_shared<HeldSettings>(settings), text_of(s, "results")};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get());
  OsPingParams& p = s.parameters;
  const double low_m = 1e-3 * (p.start_mm + least_length_mm);
  const std::string why =
      protocol::first_of({protocol::range_complaint(wanted, "an Omniscan", low_m, longest_m, "start_mm + length_mm"),
                          protocol::rate_complaint(wanted, "an Omniscan", device.model->max_rate_hz, "msec_per_ping"),
                          protocol::gain_complaint(wanted), one_beam_complaint(wanted, "an Omniscan", 16)});
  if (!why.empty()) return refused(why);
  if (wanted.range_m) p.length_mm = static_cast<std::uint32_t>(std::lround(1000 * *wanted.range_m)) - p.start_mm;
  if (wanted.rate_hz) {
    p.enable = *wanted.rate_hz > 0 ? 1 : 0;
    if (p.enable != 0) p.period_ms = static_cast<std::uint32_t>(std::lround(period_ms(*wanted.rate_hz)));
  }
  if (wanted.gain_percent) p.gain = static_cast<std::int16_t>(std::lround(*wanted.gain_percent / 100 * most_gain));
  if (const std::string rule = complaint(p); !rule.empty()) return refused("Omniscan: " + rule);
  return change_to(s);
}

// The transducer's heading is the bearing of the beam; the vehicle's heading is 0 (unknown: the value of a real device).
Bytes profile_of(const Ping& ping, const protocol::DeviceState& device) {
  const Settings s = settings_from(ping.request.vendor_settings.get());
  const PingSettings& made = ping.request.settings;
  OsMonoProfile profile;
  profile.ping = static_cast<std::uint32_t>(ping.request.number) - 1;  // ping_number counts from 0
  profile.start_mm = s.parameters.start_mm;
  profile.length_mm = s.parameters.length_mm;
  profile.power_up_ms = static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(ping.request.fired_at - device.powered_up_at).count());
  profile.hz = static_cast<std::uint32_t>(device.model->modes.front().centre_hz);
  profile.gain = static_cast<std::uint16_t>(std::max<int>(s.parameters.gain, 0));
  profile.results = static_cast<std::uint16_t>(made.range_bin_count);
  profile.speed_dmps = static_cast<std::uint16_t>(std::lround(10 * s.speed_mps));
  profile.pulse_s = 2 * made.pulse_width_m / s.speed_mps;
  profile.analog_gain = made.gain_db;
  const Powers powers = scaled(ping.samples, made.format);
  profile.highest_db = powers.highest_db;
  profile.lowest_db = powers.lowest_db;
  profile.transducer_heading_deg = static_cast<float>(heading_deg(ping.request.sonar_in_world));
  Bytes payload = wire::bytes_of(profile);
  payload.insert(payload.end(), powers.codes.begin(), powers.codes.end());
  return framed(Id::os_mono_profile, s.id, payload);
}

namespace {

using protocol::Reaction;
constexpr auto port_table = streaming_ports(51200, "settings, profiles");

class OmniscanDialogue final : public StreamingConversation<Settings, settings_from> {
  /// True while pings are enabled, because ping-python sends nothing while it reads an Omniscan. (Hosts of a Surveyor send,
  /// because it requests the time.)
  bool hosts_fall_silent() const override { return settings().parameters.enable != 0; }

 public:
  using StreamingConversation::StreamingConversation;

 protected:
  /// Handles a request. Accepted requests get no ack. unknown: whether a real device sends one.
  bool on_request(const Frame& frame, Time, Reaction& reaction) override {
    if (frame.header.id == Id::os_ping_params) {
      OsPingParams parameters;
      if (!read(frame, parameters, reaction)) return true;
      if (const std::string why = complaint(parameters); !why.empty()) return refuse(frame, why, reaction), true;
      change(reaction, [&](Settings& s) { s.parameters = parameters; });
    } else if (frame.header.id == Id::set_sound_speed || frame.header.id == Id::set_sound_speed_before) {  // older definitions
      SoundSpeed speed;
      if (!read(frame, speed, reaction)) return true;
      if (speed.mm_per_s < 1000000 || speed.mm_per_s > 2000000)
        return refuse(frame, "speed_of_sound is not in 1000000..2000000", reaction), true;
      change(reaction, [&](Settings& s) { s.speed_mps = static_cast<float>(1e-3 * speed.mm_per_s); });
    } else {
      return false;
    }
    return true;
  }
  Bytes message_now(Id, Time) override { return {}; }
  bool comes_with_pings(Id wanted) const override { return wanted == Id::os_mono_profile && settings().parameters.enable != 0; }
};

class OmniscanVendor final
    : public protocol::VendorWith<models, omniscan::apply_override, locate_omniscan, locate_omniscan, StreamingVendor> {
 public:
  std::string_view name() const override { return "omniscan450"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return streaming_options(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override { return change_to(Settings{}); }
  double gain_percent(const protocol::DeviceState& device) const override {
    return 100.0 / 7 * std::max<int>(settings_from(device.settings.get()).parameters.gain, 0);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time) const override {
    return std::make_unique<OmniscanDialogue>(device, port);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) const override {
    return {profile_of(ping, device)};
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<OmniscanVendor>(); }

}  // namespace sonar::ping::omniscan
