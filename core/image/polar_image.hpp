// The samples of a decoded ping of any make, by row (range) and beam, with the direction of each beam. draw_fan draws them;
// image_statistics measures them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace sonar {

/// Options that convert linear samples with a large range of values to brightness. Makes with such samples set them.
struct Shades {
  std::size_t per_mille = 999;  // thousandths of the samples that are within the colour map; brighter samples saturate
  float gamma = 1;              // brightness is (code / full scale)^gamma
};

struct PolarImage {
  std::size_t rows = 0, beams = 0;
  double row_spacing_m = 0;         // row i covers start_m + [i, i + 1) * row_spacing_m
  std::vector<double> azimuth_rad;  // [beams], positive to port, strictly falling
  std::vector<float> samples;       // [rows][beams], codes as sent
  float full_scale = 255;           // the code with the brightest colour
  double start_m = 0;               // range at which the samples begin
  Shades shades = {};

  float at(std::size_t row, std::size_t beam) const { return samples[row * beams + beam]; }
  /// Returns the code that `per_mille` of a thousand samples do not exceed, at least 1.
  float brightest(std::size_t per_mille) const {
    std::vector<float> codes = samples;
    const auto place = codes.begin() + static_cast<std::ptrdiff_t>((codes.size() - 1) * per_mille / 1000);
    std::nth_element(codes.begin(), place, codes.end());
    return std::max(1.0f, *place);
  }
  void shade(const Shades& of_make) {
    full_scale = brightest(of_make.per_mille);
    shades = of_make;
  }
  /// Returns the brightness of a code: 1 at full scale, where the colour map ends.
  float brightness(float code) const {
    const float part = code / full_scale;
    return shades.gamma == 1 ? part : std::pow(std::max(0.0f, part), shades.gamma);
  }
  double range_m() const { return start_m + static_cast<double>(rows) * row_spacing_m; }
};

}  // namespace sonar
