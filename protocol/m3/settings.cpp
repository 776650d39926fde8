#include "protocol/m3/settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/sonar/water.hpp"
#include "core/text/format.hpp"
#include "protocol/limits.hpp"

namespace sonar::m3 {
namespace {

constexpr double shortest_interval_s = 10.24e-6;  // PKT
constexpr int shortest_pulse_us = 20;             // PKT
constexpr int most_samples = 2048;   // LOG: packets have up to 1681 samples; with half the interval they would have 2745 or more
constexpr int samples_multiple = 4;  // PKT
constexpr double near_per_far = 0.02;  // PKT, LOG: 0.2 m for 10 m, 0.4 m for 20 m

}  // namespace

double near_of(double far_m) { return std::max(nearest_m, near_per_far * far_m); }

// The window does not depend on the true sound speed, because it covers every speed from slowest_mps to fastest_mps (PKT, LOG).
// The interval is doubled until the samples fit.
Window window_of(double near_m, double far_m) {
  Window window;
  window.start_s = 1e-6 * std::round(1e6 * (2 * near_m / fastest_mps + transmit_s)) - transmit_s;  // PKT, LOG: whole microseconds
  window.interval_s = shortest_interval_s;
  window.pulse_us = shortest_pulse_us;
  const double length_s = 2 * far_m / slowest_mps - window.start_s;
  while (length_s > most_samples * window.interval_s) {
    window.interval_s *= 2;
    window.pulse_us *= 2;  // unknown: the pulse for ranges beyond 10 m
  }
  window.samples = samples_multiple * static_cast<int>(std::ceil(length_s / window.interval_s / samples_multiple - 1e-9));
  return window;
}

PingSettings ping_settings(const Settings& settings, const protocol::DeviceState& device) {
  const Window window = window_of(near_of(settings.far_m), settings.far_m);
  PingSettings s;
  s.device_sound_speed_mps = static_cast<float>(true_sound_speed_mps(device.water, device.depth_m));
  const double half_mps = static_cast<double>(s.device_sound_speed_mps) / 2;
  s.beam_count = beam_count;
  s.range_bin_count = window.samples;
  s.range_start_m = window.start_s * half_mps;
  s.range_bin_m = window.interval_s * half_mps;
  s.range_m = s.range_start_m + s.range_bin_count * s.range_bin_m;
  s.row_centre = 0;  // CLI: the first sample is at the start of the window
  // -3 dB of a tone in its matched filter (docs/acoustics.md, eq. 23).
  s.pulse_width_m = static_cast<float>((2 - std::sqrt(2.0)) * 1e-6 * window.pulse_us * half_mps);
  s.rate_hz = settings.rate_hz;
  s.gain_db = settings.c_db;
  // The gain law has b dB per 1000 m of range; the absorption counts the path out and back.
  s.device_absorption_db_per_m = static_cast<float>(GainLaw{}.b / 1000.0 / 2);
  s.format = {.bits = 32, .max_code = 0xFFFFFFFF};
  return s;
}

protocol::ChangeSettings change_to(const Settings& settings, const protocol::DeviceState& device) {
  return {ping_settings(settings, device), std::make_shared<HeldSettings>(settings),
          text::format("range %g to %g m, rate %g Hz, gain law 20 log r + 100 r / 1000 %+g dB", near_of(settings.far_m),
                       settings.far_m, static_cast<double>(settings.rate_hz), static_cast<double>(settings.c_db))};
}

// Only range, rate and gain can be set, as in the maker's program; drivers cannot set them.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device) {
  using protocol::refused;
  Settings s = settings_from(device.settings.get());
  const std::string why =
      protocol::first_of({protocol::range_complaint(wanted, "an M3", 1, farthest_m),
                          protocol::rate_complaint(wanted, "an M3", highest_rate_hz), protocol::gain_complaint(wanted)});
  if (!why.empty()) return refused(why);
  s.far_m = wanted.range_m.value_or(s.far_m);
  if (wanted.rate_hz) s.rate_hz = static_cast<float>(*wanted.rate_hz);
  if (wanted.gain_percent) s.c_db = static_cast<float>(least_c_db + (most_c_db - least_c_db) * *wanted.gain_percent / 100);
  if (wanted.mode.value_or(0) != 0) return refused("an M3 has one mode here, 0");
  if (wanted.beams.value_or(beam_count) != beam_count) return refused(text::format("an M3 forms %d beams", beam_count));
  if (wanted.sample_bits.value_or(32) != 32) return refused("an M3 sends samples of 32 bits");
  if (wanted.row_gains.value_or(false)) return refused("an M3 sends no row gains");
  return change_to(s, device);
}

double gain_percent(const Settings& settings) {
  return 100 * (static_cast<double>(settings.c_db) - least_c_db) / (most_c_db - least_c_db);
}

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 1> all{{
      {option_name::positive_angles,
       {"port", "starboard"},
       "port",
       "side of the beams with positive angles; packets begin with the beam of the least angle"},
  }};
  return all;
}

}  // namespace sonar::m3
