#include "protocol/micron/settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/serial_line.hpp"

namespace sonar::micron {
namespace {

using protocol::refused;

constexpr double receiver_db = 80;  // ENS: range of levels in 8-bit bins, and range of the gain
constexpr double farthest_m = 200;  // our choice: end of the last bin, which bounds the work for a ping; the device's is unknown
constexpr double pulse_m = 0.0075;  // length after compression of a chirp of 100 kHz: data sheet, from memory
constexpr auto turn_of_a_sixteenth = std::chrono::microseconds(500);  // unknown: time for 1/16 grad; a turn takes 3.2 s
constexpr double fastest_hz = 1000;                                   // no limit: hosts request each scan line

SonarModel make_model() {
  FrequencyMode mode;
  mode.name = "700 kHz";
  mode.centre_hz = 700e3f;  // chirp of 650 to 750 kHz: from memory
  mode.min_range_m = 0.3f;
  mode.max_range_m = static_cast<float>(farthest_m);
  mode.source_level_db = 200;  // unknown, like full scale; set so that a gain of 50 % shows the demo well
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = {0};
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(3));     // ROCK
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(35));  // ROCK
  mode.horizontal_aperture_rad = mode.pattern.azimuth_width_rad;
  mode.receiver.tvg_slope_db = 20;  // our choice: the law of the device is unknown
  mode.receiver.tvg_ceiling_db = 60;
  mode.receiver.full_scale_upa = 2e7f;
  SonarModel model;
  model.profile = "micron";
  model.name = "Micron";
  model.max_rate_hz = 100;
  model.modes = {mode};
  return model;
}

int wrapped(int bearing) { return (bearing % turn + turn) % turn; }
bool is_continuous(const HeadCommand& c) { return (c.control & control::continuous) != 0; }
/// Returns the width of the sector. If both limits are equal, it is a full turn.
int width_of(const HeadCommand& c) { return c.left == c.right ? turn - 1 : wrapped(c.right - c.left); }

/// Returns the level of an 8-bit value of ADSpan or ADLow: 255 is 80 dB.
float db_of(int value) { return static_cast<float>(receiver_db * value / 255); }

}  // namespace

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 3> all{{
      {option_name::lines, {"1", "2"}, "1", "scan lines that answer each mtSendData; drivers of full duplex links expect 2"},
      {option_name::first_bin, {"high", "low"}, "high", "half of a byte in which the nearer of two 4-bit bins is"},
      {option_name::link_rate, {}, "unlimited", "bits a second of its link, which limits how fast it scans", 9600, 1e9},
  }};
  return all;
}

std::span<const std::shared_ptr<const SonarModel>> models() { return protocol::only_model<make_model>(); }

bool same_settings(const Settings& a, const Settings& b) {
  return a.command == b.command && a.has_parameters == b.has_parameters;
}

// 750 m/s is half of the nominal sound speed, because the sound travels out and back.
int longest_interval(int bins) { return static_cast<int>(farthest_m / (bins * bin_unit_s * 750)); }

std::string complaint(const HeadCommand& c) {
  if (c.bins < 1 || c.bins > 1500) return text::format("%d bins are not in 1..1500", c.bins);
  if (c.interval < 1) return "the interval of the bins is 0";
  if (c.interval > longest_interval(c.bins)) return text::format("the bins reach beyond %g m", farthest_m);
  if (c.step < 1) return "the step of the motor is 0";
  if (c.left >= turn || c.right >= turn) return text::format("a limit is not in 0..%d", turn - 1);
  if (c.gain > most_gain) return text::format("gain %d is not in 0..%d", c.gain, most_gain);
  if ((c.control & control::eight_bits) == 0 && c.ad_span < 1) return "the span of 4-bit bins is 0";
  return {};
}

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device) {
  const HeadCommand& c = settings.command;
  // The device samples at intervals of time and has no setting for the sound speed. So the range of each row follows from the
  // true sound speed.
  const double speed = true_sound_speed_mps(device.water, device.depth_m);
  PingSettings s;
  s.beam_count = 1;
  s.range_bin_count = c.bins;
  s.range_bin_m = c.interval * bin_unit_s * speed / 2;
  s.range_m = s.range_bin_count * s.range_bin_m;
  s.pulse_width_m = static_cast<float>(std::max(pulse_m, s.range_bin_m / 2));
  s.rate_hz = fastest_hz;
  s.triggered = true;
  s.transmit = (c.control & control::no_transmission) == 0;
  s.gain_db = static_cast<float>(receiver_db * c.gain / most_gain);
  s.device_sound_speed_mps = static_cast<float>(speed);
  s.format = {.bits = 8, .max_code = 255, .scale = SampleFormat::Scale::logarithmic, .floor_db = 0, .ceiling_db = receiver_db};
  // ADLow and ADSpan select the window of 4-bit bins. They do not apply to bins of 8 bits (ENS; MCG differs).
  if ((c.control & control::eight_bits) == 0) {
    s.format.max_code = 15;
    s.format.floor_db = db_of(c.ad_low);
    s.format.ceiling_db = db_of(c.ad_low + c.ad_span);
  }
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device) {
  const PingSettings s = ping_settings(settings, device);
  const HeadCommand& c = settings.command;
  const std::string scan = is_continuous(c) ? "full turn" : text::format("sector from %d to %d", c.left, c.right);
  return {s, std::make_shared<HeldSettings>(settings),
          text::format("%s, steps of %d, range %.2f m, %d bins of %d x 640 ns, gain %.0f %%", scan.c_str(), c.step, s.range_m,
                       c.bins, c.interval, 100.0 * c.gain / most_gain)};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  Settings s = settings_from(device.settings.get());
  HeadCommand& c = s.command;
  if (wanted.range_m) {
    const double speed = true_sound_speed_mps(device.water, device.depth_m);
    const double unit_m = speed * bin_unit_s * c.bins / 2;  // range of the shortest interval
    const std::string why =
        protocol::range_complaint(*wanted.range_m, "a Micron", unit_m, longest_interval(c.bins) * unit_m, "ad_interval");
    if (!why.empty()) return refused(why);
    c.interval = static_cast<std::uint16_t>(std::lround(*wanted.range_m / unit_m));
    c.range_dm = static_cast<std::uint16_t>(std::lround(10 * *wanted.range_m));
  }
  if (wanted.rate_hz) return refused("a Micron has no rate_hz: it sends a scan line for each request, as fast as its head turns");
  if (const std::string why = protocol::gain_complaint(wanted); !why.empty()) return refused(why);
  if (wanted.gain_percent) c.gain = c.gain2 = static_cast<std::uint8_t>(std::lround(*wanted.gain_percent / 100 * most_gain));
  if (wanted.mode && *wanted.mode != 0) return refused("a Micron has one mode, 0");
  if (wanted.beams && *wanted.beams != 1) return refused("a Micron has one beam");
  if (wanted.sample_bits && *wanted.sample_bits != 8) return refused("the bins of a Micron are set by its host");
  if (wanted.row_gains && *wanted.row_gains) return refused("a Micron sends no row gains");
  if (const std::string why = complaint(c); !why.empty()) return refused("Micron: " + why);
  return change_to(s, device);
}

// Seen from above, bearings increase clockwise; 3200 is ahead (ROCK, MCG). The head of an inverted sonar hangs upside down, so in
// its own frame bearings increase counter-clockwise.
double head_rad(const Settings& settings) {
  const double to_starboard = (settings.bearing - ahead) * 2 * pi / turn;
  return (settings.command.control & control::inverted) != 0 ? to_starboard : -to_starboard;
}

std::chrono::nanoseconds listening(const HeadCommand& c) { return nanoseconds_from(c.bins * c.interval * bin_unit_s); }

std::chrono::nanoseconds transfer(const HeadCommand& c, const protocol::OptionValues& options) {
  const int bytes =
      static_cast<int>(frame_size + wire::wire_size<HeadData>()) + ((c.control & control::eight_bits) != 0 ? c.bins : c.bins / 2);
  return protocol::serial_time(bytes, protocol::number_option(options, option_name::link_rate));
}

std::chrono::nanoseconds turning(int sixteenths) { return std::abs(sixteenths) * turn_of_a_sixteenth; }

// A head outside the sector first turns to the limit from which it scans. Within the sector, or with a full turn, it scans from
// its present bearing. With `stare` it turns to the left limit and stays there.
int Scan::begin(const HeadCommand& c) {
  to_right = (c.control & control::to_right) != 0;
  const bool stares = (c.control & control::stare) != 0;
  if (!stares && (is_continuous(c) || wrapped(bearing - c.left) <= width_of(c))) return 0;
  const int way = wrapped((to_right || stares ? c.left : c.right) - bearing);
  bearing = wrapped(bearing + way);
  // The head turns by the smaller angle.
  return way <= turn / 2 ? way : way - turn;
}

int Scan::advance(const HeadCommand& c) {
  if ((c.control & (control::motor_off | control::stare)) != 0) return 0;
  const int step = to_right ? c.step : -c.step;
  if (is_continuous(c)) return bearing = wrapped(bearing + step), step;
  const int at = wrapped(bearing - c.left), width = width_of(c);
  int next = at + step;
  if (next < 0 || next > width) {  // at a limit of the sector the scan turns around
    to_right = !to_right;
    next = std::clamp(at - step, 0, width);
  }
  bearing = wrapped(c.left + next);
  return next - at;
}

// A line within one step of a limit counts as at the limit: the scan turns around there.
std::uint8_t sweep_code(const HeadCommand& c, int bearing) {
  if (is_continuous(c)) return 0;
  const int at = wrapped(bearing - c.left), width = width_of(c);
  return at < c.step ? 1 : at > width - c.step ? 2 : 0;
}

Bytes encode(const Ping& ping, const protocol::DeviceState& device) {
  const Settings s = settings_from(ping.request.vendor_settings.get());
  const HeadCommand& c = s.command;
  const bool eight_bits = ping.request.settings.format.max_code > 15;
  const bool upper_first = protocol::text_option(device.options, option_name::first_bin) != "low";
  const Bytes bins = eight_bits ? ping.samples : packed(ping.samples, upper_first);
  HeadData data{.device_type = c.device_type,
                .head_status = static_cast<std::uint8_t>(eight_bits ? 16 : 0),
                .sweep = sweep_code(c, s.bearing),
                .control = c.control,
                .range_dm = c.range_dm,
                .carrier = c.carriers[0],
                .gain = c.gain,
                .slope = c.slope[0],
                .ad_span = c.ad_span,
                .ad_low = c.ad_low,
                .interval = c.interval,
                .left = c.left,
                .right = c.right,
                .step = c.step,
                .bearing = s.bearing,
                .size = static_cast<std::uint16_t>(bins.size())};
  data.total = static_cast<std::uint16_t>(wire::wire_size<HeadData>() + bins.size());
  Bytes payload = wire::bytes_of(data);
  payload.insert(payload.end(), bins.begin(), bins.end());
  return from_head(Id::head_data, payload);
}

// Finds the fields and regions of an mtHeadData frame that faults change.
std::optional<protocol::Field> locate(protocol::FieldName name, BytesView frame) {
  const auto found = wire::locate<Header>(name, frame);
  return found ? found : wire::locate<HeadData>(name, frame, header_size);
}

std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView frame) {
  constexpr std::size_t data = header_size + wire::wire_size<HeadData>();
  if (region == protocol::Region::bearings) return std::nullopt;
  if (frame.empty()) return std::pair<std::size_t, std::size_t>{};
  if (frame.size() <= data) return std::nullopt;
  if (region == protocol::Region::header) return std::pair{std::size_t{0}, header_size};
  return region == protocol::Region::metadata ? std::pair{header_size, data - header_size}
                                              : std::pair{data, frame.size() - 1 - data};  // without the line feed
}

}  // namespace sonar::micron
