// The Sonar 3D-15 as a SonarModel with two modes, and the constants of its images. Sources: docs/protocols/waterlinked.md.
#pragma once

#include <memory>
#include <span>

#include "core/sonar/sonar_model.hpp"

namespace sonar::waterlinked {

inline constexpr int columns = 256, rows = 64;
inline constexpr double longest_range_m = 15, least_window_m = 0.1, pixel_scale_m = 50.0 / 65536;
inline constexpr std::uint32_t full_scale_strength = 400;  // linear; the assisted gain keeps 99 % of the pixels below 80 % of it

/// Traces of filters in the ranges of SMP, fitted to its shots 1 to 3 and the same in 4 to 6 (likeness_test.cpp); 0 = none.
/// Half of the ranges are equal to the one beside them, except for 1 to 7 % across the edges of four blocks of 16 rows. Of ranges
/// with eight others round them 3 % are the largest or least of the nine, and 0.69 their median: 0.45 of independent ranges once
/// filtered by medians of 3 x 3, 0.70 twice.
inline constexpr int block_rows = 16, median_passes = 2;
/// A return is dropped unless at least so many of the pixels around it confirm it. In SMP pixels lack a return the more often,
/// the more the ranges around them differ: 0.3 % where they span less than 4 mm, 4 % at 16 to 64 mm, 8 % beyond, whatever the
/// strength beside them. Fitted on rough slopes.
inline constexpr int least_confirming = 2;
inline constexpr double confirming_m = 0.01;
/// Most ranges are multiples of it.
inline constexpr double range_sample_m = 1.0 / 640;

/// Values in which the modes differ, beside FrequencyMode.
struct ModeRow {
  const char* name = "";  // as the HTTP API has it
  double centre_hz = 0, horizontal_deg = 0, vertical_deg = 0, beam_deg = 0, range_cell_m = 0;
  float rate_hz = 0;
};
std::span<const ModeRow> mode_rows();
std::span<const std::shared_ptr<const SonarModel>> models();

}  // namespace sonar::waterlinked
