#include "protocol/ping/surveyor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/sonar/detections.hpp"
#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/conversation.hpp"
#include "protocol/ping/locate.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping::surveyor {
namespace {

using protocol::refused;

constexpr int beams = 64, directions = 16;    // a point is sought in as many directions as there are receive elements
constexpr double swath_deg = 80;              // from memory, as is the number of elements
constexpr double beam_width_deg = 7;          // width for an array of 16 elements half a wavelength apart
constexpr double above_db = 15;               // unknown: assumed; level of a point above the median of its beam
constexpr std::int32_t usual_end_mm = 20000;  // assumed for end_mm 0, with which the device follows the bottom
constexpr std::int32_t longest_mm = 200000, least_mm = 10;  // highest end of the range; least length of the range
constexpr double longest_m = 1e-3 * longest_mm, least_m = 1e-3 * least_mm;
constexpr double db_per_gain = 0.4;  // unknown: assumed
constexpr double processing_s = 0.01;

SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "240 kHz";
  mode.centre_hz = 240e3f;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(swath_deg));
  mode.min_range_m = 0.25f;
  mode.max_range_m = 100;
  mode.source_level_db = 200;
  mode.beam_spacing = BeamSpacing::uniform_in_angle;
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(beam_width_deg));
  mode.pattern.azimuth_taper = Taper::hamming;
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(4));
  mode.receiver.tvg_slope_db = 20;
  mode.receiver.full_scale_upa = 1e5f;
  SonarModel model;
  model.profile = "surveyor-240";
  model.name = "Surveyor 240-16";
  model.max_rate_hz = static_cast<float>(1 / (travel_s(least_m, fastest_mps) + processing_s));
  model.modes = {mode};
  return model;
}

std::int32_t end_mm(const PingParameters& p) { return p.end_mm > 0 ? p.end_mm : usual_end_mm; }

std::uint64_t milliseconds_of(std::chrono::nanoseconds t) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(t).count());
}

/// Returns the upward direction of the world in the axes of the device: ahead, to port, up. The fan points down, so the device's
/// up is opposite to the sonar's x axis.
std::array<float, 3> up_of(const Pose& sonar_in_world) {
  const Vec3d up = rotate(conjugate(sonar_in_world.orientation), Vec3d{0, 0, 1});
  return {static_cast<float>(up.z), static_cast<float>(up.y), static_cast<float>(-up.x)};
}

template <class M>
Bytes payload_of(const M& message, const std::vector<Bytes>& points) {
  Bytes payload = wire::bytes_of(message);
  for (const Bytes& point : points) payload.insert(payload.end(), point.begin(), point.end());
  return payload;
}

std::vector<Detection> points_of(const Ping& ping) {
  return detect_points(ping, directions, above_db, rad_from_deg(beam_width_deg));
}

}  // namespace

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

// Each answer to the time request gives a slightly different offset, which must not count as a change of settings every 10 s.
bool same_settings(const Settings& a, const Settings& b) {
  if (a.id != b.id || a.parameters != b.parameters || a.utc_ahead.has_value() != b.utc_ahead.has_value()) return false;
  return !a.utc_ahead || std::chrono::abs(*a.utc_ahead - *b.utc_ahead) < std::chrono::milliseconds(1);
}

std::string complaint(const PingParameters& p) {
  if (p.start_mm < 0 || p.end_mm < 0 || end_mm(p) > longest_mm || p.start_mm > end_mm(p) - least_mm)
    return protocol::range_rule(least_m, longest_m, "start_mm, end_mm");
  if (!(p.speed_mps >= 1000 && p.speed_mps <= 2000)) return "sos_mps is not in 1000..2000";
  if (p.gain < -1 || p.gain > 100) return "gain_index is not in -1..100";
  if (p.period_ms < 0) return "msec_per_ping is negative";
  if (p.steps < 200 || p.steps > 800) return "n_range_steps is not in 200..800";
  if (!(p.pulse_steps > 0 && p.pulse_steps <= 20)) return "pulse_len_steps is not in 0..20";
  return {};
}

PingSettings ping_settings(const Settings& settings) {
  const PingParameters& p = settings.parameters;
  const double speed = static_cast<double>(p.speed_mps);
  PingSettings s;
  s.beam_count = beams;
  s.range_m = 1e-3 * end_mm(p);
  s.range_start_m = std::max(1e-3 * p.start_mm, 0.05 * s.range_m);  // DEF: at least 5 % of the end
  s.range_bin_count = p.steps;
  s.range_bin_m = (s.range_m - s.range_start_m) / p.steps;
  s.pulse_width_m = static_cast<float>(std::max(static_cast<double>(p.pulse_steps), 0.5) * s.range_bin_m);
  const double shortest_s = travel_s(s.range_m, speed) + processing_s;
  s.rate_hz = p.enable == 0 ? 0 : static_cast<float>(1 / std::max(1e-3 * p.period_ms, shortest_s));
  s.gain_db = static_cast<float>(p.gain < 0 ? 0 : db_per_gain * p.gain);
  s.tvg = false;  // the detector compares with the median of a beam, so the noise must be the same at all ranges
  s.device_sound_speed_mps = p.speed_mps;
  s.format = {.bits = 16, .max_code = 65535, .scale = SampleFormat::Scale::logarithmic, .floor_db = -80, .ceiling_db = 80};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings) {
  const PingSettings s = ping_settings(settings);
  return {s, std::make_shared<HeldSettings>(settings), text_of(s, "steps")};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get());
  PingParameters& p = s.parameters;
  const std::string why =
      protocol::first_of({protocol::range_complaint(wanted, "a Surveyor", 1e-3 * (p.start_mm + least_mm), longest_m, "end_mm"),
                          protocol::rate_complaint(wanted, "a Surveyor", device.model->max_rate_hz, "msec_per_ping"),
                          protocol::gain_complaint(wanted)});
  if (!why.empty()) return refused(why);
  if (wanted.range_m) p.end_mm = static_cast<std::int32_t>(std::lround(1000 * *wanted.range_m));
  if (wanted.rate_hz) {
    p.enable = *wanted.rate_hz > 0 ? 1 : 0;
    if (p.enable != 0) p.period_ms = static_cast<std::int16_t>(std::lround(period_ms(*wanted.rate_hz)));
  }
  if (wanted.gain_percent) p.gain = static_cast<std::int16_t>(std::lround(*wanted.gain_percent));
  if (wanted.mode && *wanted.mode != 0) return refused("a Surveyor has one mode, 0");
  if (wanted.beams && *wanted.beams != beams) return refused("the number of beams of a Surveyor is fixed");
  if (wanted.sample_bits || (wanted.row_gains && *wanted.row_gains)) return refused("a Surveyor sends points, no samples");
  if (const std::string rule = complaint(p); !rule.empty()) return refused("Surveyor: " + rule);
  return change_to(s);
}

WaterStats water_stats(const protocol::DeviceState& device) {
  return {static_cast<float>(device.water.temperature_c),
          static_cast<float>(absolute_pressure_bar(device.water, device.depth_m))};
}

std::shared_ptr<const PingFindings> findings_of(const Settings&, const Ping& ping) { return protocol::found(points_of(ping)); }

// Both messages have the same points: atof_point_data (3012) as angle and time, yz_point_data (3011) as y and z.
std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) {
  const Settings s = settings_from(ping.request.vendor_settings.get());
  const PingParameters& p = s.parameters;
  const PingSettings& made = ping.request.settings;
  const Time at = ping.request.fired_at;
  const double speed = static_cast<double>(p.speed_mps);
  const auto power_up_ms = static_cast<std::uint32_t>(milliseconds_of(at - device.powered_up_at));
  const std::uint64_t utc_ms = s.utc_ahead ? milliseconds_of((at + *s.utc_ahead).time_since_epoch()) : 0;
  const auto number = static_cast<std::uint32_t>(ping.request.number);
  const std::array<float, 3> up = up_of(ping.request.sonar_in_world);
  const WaterStats water = water_stats(device);

  std::vector<Bytes> atof, yz;
  for (const Detection& found : protocol::found_in(ping, points_of)) {
    atof.push_back(
        wire::bytes_of(AtofPoint{static_cast<float>(found.azimuth_rad), static_cast<float>(2 * found.range_m / speed), {}}));
    Bytes& pair = yz.emplace_back();
    wire::Writer write(pair);
    const auto y = static_cast<float>(found.range_m * std::sin(found.azimuth_rad));
    const auto z = static_cast<float>(-found.range_m * std::cos(found.azimuth_rad));
    write("y", y);
    write("z", z);
  }
  std::vector<Bytes> frames{framed_message(Id::attitude_report, s.id, AttitudeReport{up, {}, utc_ms, power_up_ms})};
  if (p.atof != 0) {
    AtofPointData data;
    data.power_up_ms = power_up_ms;
    data.utc_ms = utc_ms;
    data.listening_s = static_cast<float>(2 * (made.range_m - made.range_start_m) / speed);
    data.speed_mps = p.speed_mps;
    data.ping = number;
    data.hz = static_cast<std::uint32_t>(p.hz);
    data.pulse_s = static_cast<float>(2 * static_cast<double>(made.pulse_width_m) / speed);
    data.points = static_cast<std::uint16_t>(atof.size());
    frames.push_back(framed(Id::atof_point_data, s.id, payload_of(data, atof)));
  }
  if (p.yz != 0) {
    YzPointData data;
    data.power_up_ms = power_up_ms;
    data.ping = number;
    data.speed_mps = p.speed_mps;
    data.up = up;
    data.temperature_c = water.temperature_c;
    data.pressure_bar = water.pressure_bar;
    data.start_m = static_cast<float>(made.range_start_m);
    data.end_m = static_cast<float>(made.range_m);
    data.points = static_cast<std::uint16_t>(yz.size());
    frames.push_back(framed(Id::yz_point_data, s.id, payload_of(data, yz)));
  }
  // After the first ping of each second, the temperature and pressure of the water are sent.
  const auto second_of = [&](Time ping_at) { return std::chrono::floor<std::chrono::seconds>(ping_at - device.powered_up_at); };
  if (device.framed_at == Time{} || second_of(device.framed_at) != second_of(at))
    frames.push_back(framed_message(Id::water_stats, s.id, water));
  return frames;
}

namespace {

using protocol::Reaction;
constexpr auto port_table = streaming_ports(62312, "settings, points");
constexpr auto utc_period = std::chrono::seconds(10);

/// The dialogue with one host. The device requests the time from the host every 10 s, for the first time when the host enables
/// pings, or 10 s after the start. unknown: the time of the first request. A request at the start could be in the packet of the
/// answer for which ping-python waits; this would delay its initialization by 10 s, because ping-python reads one message of
/// each packet.
class SurveyorDialogue final : public StreamingConversation<Settings, settings_from> {
 public:
  SurveyorDialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now)
      : StreamingConversation(device, port), ask_utc_at_(now + utc_period) {}

  Reaction on_tick(Time now, bool) override {
    Reaction reaction;
    if (now < ask_utc_at_) return reaction;
    ask_utc_at_ = now + utc_period;
    has_asked_ = true;
    reaction.replies.push_back(framed(Id::utc_request, id_, {}));
    return reaction;
  }
  Time next_tick() const override { return ask_utc_at_; }

 protected:
  bool on_request(const Frame& frame, Time now, Reaction& reaction) override {
    switch (frame.header.id) {
      case Id::set_ping_parameters: {
        PingParameters parameters;
        if (!read(frame, parameters, reaction)) return true;
        if (const std::string why = complaint(parameters); !why.empty()) return refuse(frame, why, reaction), true;
        if (parameters.enable != 0 && !has_asked_) ask_utc_at_ = now;
        change(reaction, [&](Settings& s) { s.parameters = parameters; });
        return true;
      }
      case Id::utc_response: {
        UtcResponse response;
        if (read(frame, response, reaction) && response.utc_ms < 4000000000000)  // times after the year 2096 are invalid
          change(reaction,
                 [&](Settings& s) { s.utc_ahead = Time(std::chrono::milliseconds(response.utc_ms)) - (now + device_.skipped); });
        return true;
      }
      case Id::set_net_info: {
        NetInfo info;
        if (read(frame, info, reaction)) reaction.events.emplace_back(protocol::StoreAddress{{info.ntp_ip, info.netmask, false}});
        return true;
      }
      default:
        return false;
    }
  }
  bool on_wanted(Id wanted, Time now, Reaction&) override {
    if (wanted == Id::utc_request) ask_utc_at_ = now;
    return wanted == Id::utc_request;
  }
  Bytes message_now(Id wanted, Time) override {
    return wanted == Id::water_stats ? framed_message(wanted, id_, water_stats(device_)) : Bytes{};
  }
  bool comes_with_pings(Id wanted) const override {
    const PingParameters p = settings().parameters;
    return p.enable != 0 && (wanted == Id::attitude_report || (wanted == Id::atof_point_data && p.atof != 0) ||
                             (wanted == Id::yz_point_data && p.yz != 0));
  }

 private:
  Time ask_utc_at_;
  bool has_asked_ = false;
};

class SurveyorVendor final
    : public protocol::VendorWith<models, surveyor::apply_override, locate_surveyor, locate_surveyor, StreamingVendor> {
 public:
  std::string_view name() const override { return "surveyor240"; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  std::span<const protocol::Option> options() const override { return streaming_options(); }
  protocol::ChangeSettings initial_settings(const protocol::DeviceState&) const override {
    Settings s;
    s.parameters.end_mm = 5000;
    return change_to(s);
  }
  double gain_percent(const protocol::DeviceState& device) const override {
    return std::max<int>(settings_from(device.settings.get()).parameters.gain, 0);
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const protocol::DeviceState& device,
                                               Time now) const override {
    return std::make_unique<SurveyorDialogue>(device, port, now);
  }

 protected:
  std::vector<Bytes> frames_of(const Ping& ping, const protocol::DeviceState& device) const override {
    return surveyor::frames_of(ping, device);
  }
};

}  // namespace

const protocol::Vendor& vendor() { return protocol::only_vendor<SurveyorVendor>(); }

}  // namespace sonar::ping::surveyor
