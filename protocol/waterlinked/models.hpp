// The Sonar 3D-15 as a SonarModel with two modes, and the constants of its images. Sources: docs/protocols/waterlinked.md.
#pragma once

#include <memory>
#include <span>

#include "core/sonar/sonar_model.hpp"

namespace sonar::waterlinked {

inline constexpr int columns = 256, rows = 64;
inline constexpr double longest_range_m = 15, least_window_m = 0.1, pixel_scale_m = 50.0 / 65536;
inline constexpr std::uint32_t full_scale_strength = 400;  // linear; the assisted gain keeps 99 % of the pixels below 80 % of it

/// Traces of the device in the images of SMP, fitted to its shots 1 to 3 and the same in 4 to 6 (likeness_test.cpp); 0 = none.
/// Half of the ranges are equal to the one beside them, the more so where it is strong: beams in which the same scatterer
/// is the strongest report its range. Strengths have a correlation of 0.59 with those a row above and ranges are equal in half of
/// the cases, but 0.09 to 0.20 and 1 to 7 % across the edges of four blocks of 16 rows.
inline constexpr bool range_of_loudest = true;
inline constexpr int block_rows = 16;
/// The median of nine ranges, of itself and its neighbours, is the range of 0.69 of the pixels; 3 % have the largest or the
/// least.
inline constexpr int median_passes = 1;
/// The device drops returns that no pixel around them confirms: if the ranges around a pixel span less than 4 mm, 0.3 % of the
/// pixels have no return; 16 to 64 mm, 4 %; more, 8 %; at any strength of the neighbours. Fitted on rough slopes.
inline constexpr int least_confirming = 1;
inline constexpr double confirming_m = 0.007;
/// Most ranges are multiples of it.
inline constexpr double range_sample_m = 1.0 / 640;

/// Values in which the modes differ, beside FrequencyMode.
struct ModeRow {
  const char* name = "";  // as the HTTP API has it
  double centre_hz = 0, horizontal_deg = 0, vertical_deg = 0, beam_width_deg = 0, beam_height_deg = 0, range_cell_m = 0;
  float rate_hz = 0;
};
std::span<const ModeRow> mode_rows();
std::span<const std::shared_ptr<const SonarModel>> models();

}  // namespace sonar::waterlinked
