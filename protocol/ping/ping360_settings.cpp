#include "protocol/ping/ping360_settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/geometry.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/conversation.hpp"
#include "protocol/ping/one_beam.hpp"
#include "protocol/serial_line.hpp"

namespace sonar::ping::ping360 {
namespace {

using protocol::refused;

constexpr double sample_unit_s = 25e-9;
constexpr int shortest_period = 80, longest_period = 40000;    // DEF: sample periods, in sample_unit_s
constexpr auto turn_of_a_grad = std::chrono::milliseconds(6);  // a full turn takes 2.4 s
constexpr double db_per_gain = 6;                              // unknown: assumed
constexpr double fastest_hz = 1000;                            // no limit: hosts request each line, or the head limits the scan

/// Returns the reason for the first value outside its limits, else an empty text.
std::string out_of_range(std::initializer_list<std::tuple<const char*, int, int, int>> values) {
  for (const auto& [name, value, low, high] : values)
    if (value < low || value > high) {
      char text[80];
      std::snprintf(text, sizeof text, "%s %d is not in %d..%d", name, value, low, high);
      return text;
    }
  return {};
}

SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "750 kHz";
  mode.centre_hz = 750e3f;
  mode.min_range_m = 0.15f;
  mode.max_range_m = 50;
  mode.source_level_db = 200;  // unknown: level and gains; chosen so that a nearby wall is bright at gain 0
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = {0};
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(2));     // data sheet, from memory
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(25));  // data sheet, from memory
  mode.horizontal_aperture_rad = mode.pattern.azimuth_width_rad;
  mode.receiver.tvg_slope_db = 20;
  mode.receiver.tvg_ceiling_db = 60;
  mode.receiver.full_scale_upa = 1e6f;
  SonarModel model;
  model.profile = "ping360";
  model.name = "Ping360";
  model.max_rate_hz = 100;
  model.modes = {mode};
  return model;
}

}  // namespace

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 6> all{{
      {option_name::firmware, {"3.3.8", "3.1.1"}, "3.3.8", "version that it states; up to 3.3.0 hosts request single pings"},
      type_option("2", "number of the product in its device information"),
      {option_name::mount_grad, {}, "0", "angle, in grads to starboard, at which its own angle 0 lies on the mount", 0, 399},
      {option_name::sector_scan,
       {"oscillate", "wrap"},
       "oscillate",
       "a scan of a sector that holds angle 0 turns around at its ends, or goes back to its start"},
      {option_name::link_rate, {}, "unlimited", "bits a second of its link, which limits how fast it scans", 9600, 1e9},
      silence_option(),
  }};
  return all;
}

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

bool same_settings(const Settings& a, const Settings& b) {
  Transducer theirs = a.ping;
  theirs.angle = b.ping.angle;
  const auto scan = [](const Settings& s) { return std::tuple(s.scans, s.start, s.stop, s.steps, s.delay_ms); };
  return b.ping == theirs && scan(b) == scan(a);
}

std::string complaint(const Transducer& t) {
  return out_of_range({{"mode", t.mode, 0, 1},
                       {"gain_setting", t.gain, 0, 2},
                       {"angle", t.angle, 0, grads},  // one host sends 400 for 0
                       {"transmit_duration", t.transmit_us, 1, 1000},
                       {"sample_period", t.period, shortest_period, longest_period},
                       {"transmit_frequency", t.khz, 500, 1000},
                       {"number_of_samples", t.samples, 200, 1200}});
}

std::string complaint(const AutoTransmit& t) {
  if (std::string why = complaint(settings_of(t).ping); !why.empty()) return why;
  return out_of_range({{"start_angle", t.start, 0, grads - 1},
                       {"stop_angle", t.stop, 0, grads - 1},
                       {"num_steps", t.steps, 1, 10},
                       {"delay", t.delay_ms, 0, 100}});
}

Settings settings_of(const Transducer& t) {
  Settings s{.ping = t};
  s.ping.angle %= grads;
  return s;
}

// A scan begins with a ping at its start angle.
Settings settings_of(const AutoTransmit& t) {
  const Transducer ping{t.mode, t.gain, t.start, t.transmit_us, t.period, t.khz, t.samples, 1, 0};
  return {.ping = ping, .scans = true, .start = t.start, .stop = t.stop, .steps = t.steps, .delay_ms = t.delay_ms};
}

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device) {
  const Transducer& t = settings.ping;
  // The device samples at intervals of time and has no setting for the sound speed. So the range of each row follows from the
  // true sound speed.
  const double speed = true_sound_speed_mps(device.water, device.depth_m);
  PingSettings s;
  s.beam_count = 1;
  s.range_bin_count = t.samples;
  s.range_bin_m = t.period * sample_unit_s * speed / 2;
  s.range_m = s.range_bin_count * s.range_bin_m;
  s.row_centre = 1;  // sample i is taken i + 1 sample periods after the pulse
  s.pulse_width_m = static_cast<float>(std::max(t.transmit_us * 1e-6 * speed / 2, s.range_bin_m / 2));
  s.rate_hz = fastest_hz;
  s.triggered = true;
  s.gain_db = static_cast<float>(db_per_gain * t.gain);
  s.device_sound_speed_mps = static_cast<float>(speed);
  // unknown: how samples follow from levels. Assumed: linear in dB, 0 to 255 for 60 dB.
  s.format = {.bits = 8, .max_code = 255, .scale = SampleFormat::Scale::logarithmic, .floor_db = 0, .ceiling_db = 60};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device) {
  const PingSettings s = ping_settings(settings, device);
  const Transducer& t = settings.ping;
  char scan[80] = "single pings", text[200];
  if (settings.scans)
    std::snprintf(scan, sizeof scan, "scan from %d to %d by %d grad", settings.start, settings.stop, settings.steps);
  std::snprintf(text, sizeof text, "%s, range %.2f m, %d samples of %d x 25 ns, pulse %d us, gain %d", scan, s.range_m, t.samples,
                t.period, t.transmit_us, t.gain);
  return {s, std::make_shared<HeldSettings>(settings), text};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get());
  if (wanted.range_m) {
    const double speed = true_sound_speed_mps(device.water, device.depth_m);
    const double period_m = s.ping.samples * sample_unit_s * speed / 2;  // range for a sample period of one unit
    const std::string why = protocol::range_complaint(*wanted.range_m, "a Ping360", shortest_period * period_m,
                                                      longest_period * period_m, "sample_period x number_of_samples");
    if (!why.empty()) return refused(why);
    s.ping.period = static_cast<std::uint16_t>(std::lround(*wanted.range_m / period_m));
  }
  if (wanted.rate_hz)
    return refused("the rate of a Ping360 cannot be set: its host asks for each line, as fast as its head turns");
  if (const std::string why = protocol::gain_complaint(wanted); !why.empty()) return refused(why);
  if (wanted.gain_percent) {
    s.ping.gain = static_cast<std::uint8_t>(std::lround(*wanted.gain_percent / 50));
  }
  if (const std::string why = one_beam_complaint(wanted, "a Ping360", 8); !why.empty()) return refused(why);
  return change_to(s, device);
}

Bytes encode(const Settings& s, BytesView samples) {
  const Transducer& t = s.ping;
  const auto count = static_cast<std::uint16_t>(samples.size());
  Bytes payload;
  if (s.scans)
    wire::append(payload, AutoDeviceData{t.mode, t.gain, t.angle, t.transmit_us, t.period, t.khz, s.start, s.stop, s.steps,
                                         s.delay_ms, t.samples, count});
  else
    wire::append(payload, DeviceData{t.mode, t.gain, t.angle, t.transmit_us, t.period, t.khz, t.samples, count});
  payload.insert(payload.end(), samples.begin(), samples.end());
  return framed(s.scans ? Id::auto_device_data : Id::device_data, s.id, payload);
}

namespace {

template <class Data>
std::optional<Line> line_of(const Frame& frame) {
  Data d;
  wire::Reader reader(frame.payload);
  fields(reader, d);
  const BytesView rest = BytesView(frame.payload).subspan(std::min(wire::wire_size<Data>(), frame.payload.size()));
  if (!reader.ok() || d.count == 0 || rest.size() != d.count || d.angle >= grads) return std::nullopt;
  return Line{{d.mode, d.gain, d.angle, d.transmit_us, d.period, d.khz, d.samples, 1, 0}, Bytes(rest.begin(), rest.end())};
}

}  // namespace

std::optional<Line> line_in(BytesView message) {
  const auto frame = whole_frame(message);
  if (!frame) return std::nullopt;
  if (frame->header.id == Id::auto_device_data) return line_of<AutoDeviceData>(*frame);
  return frame->header.id == Id::device_data ? line_of<DeviceData>(*frame) : std::nullopt;
}

double head_rad(std::uint16_t angle, const protocol::OptionValues& options) {
  // Seen from above, angles increase clockwise, as in Ping Viewer (protocol/ping/README.md, "Direction of a Ping360").
  return -(angle + number_option(options, option_name::mount_grad)) * 2 * pi / grads;
}

std::chrono::nanoseconds listening(const Transducer& t) { return nanoseconds_from(t.samples * t.period * sample_unit_s); }

std::chrono::nanoseconds transfer(const Transducer& t, const protocol::OptionValues& options) {
  const double bytes = static_cast<double>(header_size + wire::wire_size<AutoDeviceData>() + t.samples + sum_size);
  return protocol::serial_time(bytes, number_option(options, option_name::link_rate));
}

Time Head::arrives() const { return since + std::abs(to - from) * turn_of_a_grad; }

// Returns whole grads, because the head stops only at grads, and messages have no finer angle.
std::uint16_t Head::angle_at(Time at) const {
  const int way = std::abs(to - from);
  const auto gone = static_cast<int>(std::clamp<std::int64_t>((at - since) / turn_of_a_grad, 0, way));
  return static_cast<std::uint16_t>(((to > from ? from + gone : from - gone) % grads + grads) % grads);
}

void Head::turn_to(std::uint16_t angle, Time at) {
  from = angle_at(at);
  // The head turns by the smaller angle. `to` may be outside 0 to 399; angle_at() reduces it modulo a turn.
  const int ahead = ((angle - from) % grads + grads) % grads;
  to = from + (ahead <= grads / 2 ? ahead : ahead - grads);
  since = at;
}

/// Returns the next angle. In a sector without angle 0, the scan starts again at the beginning. In a sector with angle 0, it
/// reverses at the ends, or returns to the start (option sector_scan).
std::uint16_t next_angle(std::uint16_t angle, const Settings& scan, bool& back, bool oscillates) {
  if (scan.start <= scan.stop) {
    const int next = angle + scan.steps;
    return next > scan.stop ? scan.start : static_cast<std::uint16_t>(next);
  }
  const int width = scan.stop - scan.start + grads;
  const int at = ((angle - scan.start) % grads + grads) % grads;
  int next = back ? at - scan.steps : at + scan.steps;
  if (next > width || next < 0) {
    if (oscillates) back = !back;
    next = !oscillates ? 0 : back ? at - scan.steps : at + scan.steps;
    if (next < 0 || next > width) next = 0;  // the steps are wider than the sector
  }
  return static_cast<std::uint16_t>((scan.start + next) % grads);
}

}  // namespace sonar::ping::ping360
