#include "protocol/norbit/settings.hpp"

#include <algorithm>
#include <cmath>

#include "core/sonar/water.hpp"
#include "core/text/format.hpp"
#include "protocol/limits.hpp"

namespace sonar::norbit {
namespace {

constexpr int most_rows = 1024;  // limit of rows, so that a ping does not take too long to compute
constexpr double nearest_m = 0.2;
constexpr double slowest_mps = 1300, fastest_mps = 1700;
constexpr auto processing = std::chrono::milliseconds(5);

}  // namespace

std::string complaint(const Settings& s) {
  if (!(s.start_m >= 0 && s.stop_m <= farthest_m && s.stop_m - s.start_m >= shortest_m - protocol::rounding_m))
    return protocol::range_rule(shortest_m, farthest_m, "start, stop");
  if (s.power != 0 && s.power != 1) return "the power must be 0 or 1";
  if (s.rate_hz != -1 && !(s.rate_hz > 0 && s.rate_hz <= fastest_hz))
    return text::format("the rate must be above 0 and at most %g Hz, or -1", fastest_hz);
  if (!(s.gain_db >= 0 && s.gain_db <= most_gain_db)) return text::format("the gain must be 0 to %g dB", most_gain_db);
  if (s.samples < 64 || s.samples > 2048) return "the number of samples must be 64 to 2048";
  if (s.beams != 64 && s.beams != 128 && s.beams != 256 && s.beams != 512)
    return "the number of beams must be 64, 128, 256 or 512";
  if (s.sound_mps != -1 && !(s.sound_mps >= slowest_mps && s.sound_mps <= fastest_mps))
    return text::format("the sound velocity must be %g to %g m/s, or -1", slowest_mps, fastest_mps);
  return {};
}

double sound_mps(const Settings& settings, const protocol::DeviceState& device) {
  return settings.sound_mps > 0 ? settings.sound_mps : true_sound_speed_mps(device.water, device.depth_m);
}

Grid grid_of(const Settings& settings, double sound_mps) {
  Grid grid;
  grid.sample_m = sound_mps / 2 / sample_hz;
  const auto begin = static_cast<int>(std::max(settings.start_m, nearest_m) / grid.sample_m);
  const auto end = static_cast<int>(std::ceil(settings.stop_m / grid.sample_m));
  grid.step = (end - begin + most_rows - 1) / most_rows;
  grid.thin = std::max(1, static_cast<int>(std::lround(static_cast<double>(end - begin) / grid.step / settings.samples)));
  const int coarse = grid.step * grid.thin;
  grid.first = std::max(1, begin / coarse) * coarse;
  grid.rows = std::max(1, (end - grid.first + grid.step - 1) / grid.step);
  return grid;
}

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device) {
  const double speed = sound_mps(settings, device);
  const Grid grid = grid_of(settings, speed);
  PingSettings s;
  s.beam_count = std::max(bottom_beams, settings.beams);
  s.range_bin_count = grid.rows;
  s.range_start_m = grid.first * grid.sample_m;
  s.range_bin_m = grid.step * grid.sample_m;
  s.range_m = s.range_start_m + s.range_bin_count * s.range_bin_m;
  s.row_centre = 0;  // a row is at its sample number
  // Rows that are longer than the pulse would miss echoes between them.
  s.pulse_width_m = static_cast<float>(std::max(0.65 * speed / (1e3 * bandwidth_khz), s.range_bin_m));
  const double shortest_s = 2 * s.range_m / speed + seconds(processing);
  const double fastest = std::min(fastest_hz, 1 / shortest_s);
  s.rate_hz = settings.power ? static_cast<float>(settings.rate_hz > 0 ? std::min(settings.rate_hz, fastest) : fastest) : 0;
  s.gain_db = static_cast<float>(settings.gain_db);
  s.tvg = false;  // detection needs noise that is the same at all ranges; encode_column() adds the gain
  s.device_sound_speed_mps = static_cast<float>(speed);
  s.format = sample_format;
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device) {
  const PingSettings s = ping_settings(settings, device);
  return {s, std::make_shared<HeldSettings>(settings),
          text::format("%s, %g to %g m, %.4g Hz, gain %g dB, water column of about %d x %d, sound velocity %.1f m/s",
                       settings.power ? "pings" : "standby", settings.start_m, settings.stop_m, static_cast<double>(s.rate_hz),
                       settings.gain_db, settings.samples, settings.beams, static_cast<double>(s.device_sound_speed_mps))};
}

Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  using protocol::refused;
  Settings s = settings_from(device.settings.get());
  const std::string why = protocol::first_of(
      {protocol::range_complaint(wanted, "a Norbit", s.start_m + shortest_m, farthest_m, "set_range"),
       protocol::rate_complaint(wanted, "a Norbit", device.model->max_rate_hz, "set_rate"), protocol::gain_complaint(wanted)});
  if (!why.empty()) return refused(why);
  s.stop_m = wanted.range_m.value_or(s.stop_m);
  if (wanted.rate_hz) {
    s.power = *wanted.rate_hz > 0;
    if (s.power) s.rate_hz = *wanted.rate_hz;
  }
  if (wanted.gain_percent) s.gain_db = most_gain_db * *wanted.gain_percent / 100;
  if (wanted.mode.value_or(0) != 0) return refused("a Norbit has one mode here, 0");
  if (wanted.beams) s.beams = static_cast<int>(*wanted.beams);
  if (wanted.sample_bits.value_or(16) != 16) return refused("a Norbit sends pixels of 16 bits");
  if (wanted.row_gains.value_or(false)) return refused("a Norbit sends no row gains");
  if (const std::string rule = complaint(s); !rule.empty()) return refused("Norbit: " + rule);
  return change_to(s, device);
}

}  // namespace sonar::norbit
