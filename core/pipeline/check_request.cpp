#include "core/pipeline/ping_engine.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/sonar/range_image.hpp"

namespace sonar {
namespace {

constexpr double longest_pulse_in_samples = 1000;
constexpr double shortest_exact_pulse_in_samples = 0.25;  // for pulses via the spectrum; tabulated pulses may be shorter
constexpr double most_column_samples = 1 << 29;           // limit for all columns, 4 GiB
constexpr double most_frequencies = 1 << 20;              // limit for a column via the spectrum
constexpr double tone_band_in_pulses = 20, other_band_in_pulses = 3;  // in 1 / width, at least Pulse::band_hz
constexpr int most_fixed_rays = 100000, most_interleaved_pings = 64;
constexpr double sector_slack_rad = 1e-6;  // tolerance, because azimuths are double and the aperture is float
constexpr double widest_beam_rad = 1.5, narrowest_width_rad = 1e-4;
constexpr float widest_level_db = 300;

/// Checks the limits of pulses and buffers. No picture needs larger values, and they would take too much memory.
std::string why_out_of_proportion(const FrequencyMode& mode, const PingSettings& s) {
  const double samples = static_cast<double>(s.range_bin_count) * s.samples_per_row;
  const double pulse = static_cast<double>(s.pulse_width_m) / (s.range_bin_m / s.samples_per_row);  // in samples
  const bool measured = mode.waveform.shape == Waveform::Shape::measured;  // its width and limits are checked elsewhere
  if (!measured && pulse > longest_pulse_in_samples)
    return "the pulse is longer than 1000 samples of the picture: choose longer rows or a shorter pulse";
  if (!measured && mode.waveform.exact && pulse < shortest_exact_pulse_in_samples)
    return "an exact pulse must be at least a quarter of a sample of the picture long: choose shorter rows or a longer pulse";
  const double band = mode.waveform.shape == Waveform::Shape::cw ? tone_band_in_pulses : other_band_in_pulses;
  if (!measured && mode.waveform.exact && samples * std::max(1.0, band / pulse) > most_frequencies)
    return "an exact pulse this short needs too much memory for this many samples: choose fewer rows or a longer pulse";
  if (samples * make_columns(mode, s.beam_count).count > most_column_samples)
    return "so many beams, rows and samples per row need too much memory: choose fewer of them";
  return {};
}

std::string why_beams_unlisted(const FrequencyMode& mode, int beam_count) {
  if (mode.beam_spacing != BeamSpacing::listed) return {};
  const std::vector<double>& azimuth = mode.beam_azimuths_rad;
  const std::vector<float>& width = mode.beam_widths_rad;
  if (static_cast<int>(azimuth.size()) != beam_count)
    return "beam_count is " + std::to_string(beam_count) + ", but the number of listed beams is " +
           std::to_string(azimuth.size());
  if (!width.empty() && width.size() != azimuth.size()) return "there must be as many beam widths as beams, or none";
  const double edge_rad = static_cast<double>(mode.horizontal_aperture_rad) / 2 + sector_slack_rad;
  for (std::size_t j = 0; j < azimuth.size(); ++j) {
    const std::string beam = "listed beam " + std::to_string(j);
    if (!(std::abs(azimuth[j]) <= std::min(edge_rad, widest_beam_rad))) return beam + " does not point into the sector";
    if (j > 0 && !(azimuth[j] < azimuth[j - 1])) return beam + " is not to starboard of the one before";
    if (!width.empty() && !(width[j] >= narrowest_width_rad && width[j] < pi)) return "the width of " + beam + " is impossible";
  }
  return {};
}

std::string why_unusable(const SampleFormat& f) {
  if (f.bits != 8 && f.bits != 16 && f.bits != 32) return "samples have 8, 16 or 32 bits";
  if (!(f.gamma > 0 && std::isfinite(f.gamma))) return "gamma must be positive and finite";
  if (f.max_code < 1 || f.max_code > 0xFFFFFFFFu >> (32 - f.bits))
    return "max_code " + std::to_string(f.max_code) + " does not fit samples of " + std::to_string(f.bits) + " bits";
  if (f.scale != SampleFormat::Scale::logarithmic) return {};
  if (!(f.floor_db >= -widest_level_db && f.ceiling_db <= widest_level_db && f.floor_db < f.ceiling_db))
    return "floor_db must be below ceiling_db, both from -300 to 300";
  if (f.row_gains) return "logarithmic samples have no row gains";
  return {};
}

std::string why_unusable(const RangeImageSettings& image, const PingSettings& s) {
  if (s.format.bits != 32 || s.format.max_code >> 16 == 0)
    return "range images have samples of 32 bits, 16 of them for the strength";
  if (!(image.beam_height_rad > 0 && std::isfinite(image.beam_height_rad))) return "the height of a beam is impossible";
  if (!(image.range_unit_m * RangePixel::most_range >= s.range_m)) return "the range, counted in its unit, exceeds 16 bits";
  return {};
}

std::string why_impossible_motion(const PingRequest& r) {
  if (!is_finite(r.sonar_in_world.position_m) || !is_finite(r.sonar_in_world.orientation))
    return "the sonar's pose is not finite";
  if (!is_finite(r.sonar_moves.velocity_mps) || !is_finite(r.sonar_moves.angular_rate_radps))
    return "the sonar's motion is not finite";
  if (length(r.sonar_moves.velocity_mps) >= static_cast<double>(r.settings.device_sound_speed_mps))
    return "the sonar moves faster than sound";
  for (std::size_t b = 0; b < r.bodies_in_world.size(); ++b)
    if (!is_finite(r.bodies_in_world[b].position_m) || !is_finite(r.bodies_in_world[b].orientation))
      return "the pose of moving body " + std::to_string(b) + " is not finite";
  return {};
}

}  // namespace

std::string why_invalid(const PingRequest& r) {
  const PingSettings& s = r.settings;
  if (!r.model) return "the request names no sonar model";
  if (s.mode < 0 || s.mode >= static_cast<int>(r.model->modes.size()))
    return "mode " + std::to_string(s.mode) + " does not exist in " + r.model->name;
  if (s.beam_count < 1 || s.beam_count > 2048) return "beam_count " + std::to_string(s.beam_count) + " is not in 1..2048";
  if (s.range_bin_count < 1 || s.range_bin_count > 65535)
    return "range_bin_count " + std::to_string(s.range_bin_count) + " is not in 1..65535";
  if (s.samples_per_row < 1 || s.samples_per_row > 64)
    return "samples_per_row " + std::to_string(s.samples_per_row) + " is not in 1..64";
  const auto positive = [](auto x) { return x > 0 && std::isfinite(x); };
  if (!positive(s.range_bin_m) || !positive(s.pulse_width_m) || !positive(s.range_m) || !positive(s.device_sound_speed_mps))
    return "range, row spacing, pulse width and sound speed must be positive and finite";
  if (!(s.range_start_m >= 0 && s.range_start_m < s.range_m)) return "range_start_m must be from 0 to below range_m";
  if (!(s.row_centre >= 0 && s.row_centre <= 1)) return "row_centre must be from 0 to 1";
  if (!std::isfinite(s.gain_db) || !std::isfinite(s.device_absorption_db_per_m)) return "gain and absorption must be finite";
  const FrequencyMode& mode = r.model->modes[static_cast<std::size_t>(s.mode)];
  if (std::string why = why_beams_unlisted(mode, s.beam_count); !why.empty()) return why;
  if (mode.interleaved_pings < 1 || mode.interleaved_pings > most_interleaved_pings)
    return "interleaved_pings " + std::to_string(mode.interleaved_pings) + " is not in 1..64";
  if (!(s.ping_interval_s >= 0 && std::isfinite(s.ping_interval_s))) return "ping_interval_s must be 0 or more, and finite";
  const Waveform& waveform = mode.waveform;
  const double sample_time_s = 2 * s.range_bin_m / s.samples_per_row / static_cast<double>(s.device_sound_speed_mps);
  if (std::string why = why_invalid(waveform, sample_time_s); !why.empty()) return why;
  if (std::string why = why_unusable(s.format); !why.empty()) return why;
  if (const RangeImageSettings* const image = range_image_of(r))
    if (std::string why = r.switches.keep_beams ? "range images have no beam signals" : why_unusable(*image, s); !why.empty())
      return why;
  if (r.switches.fixed_fan < 0 || r.switches.fixed_fan > most_fixed_rays)
    return "fixed_fan " + std::to_string(r.switches.fixed_fan) + " is not in 0..100000";
  if (std::string why = why_out_of_proportion(mode, s); !why.empty()) return why;
  if (std::string why = why_impossible(mode.receiver.shared_noise); !why.empty()) return "shared_noise: " + why;
  if (std::string why = why_table_too_large(mode, s, r.switches); !why.empty()) return why;
  return why_impossible_motion(r);
}

}  // namespace sonar
