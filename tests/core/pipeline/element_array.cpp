#include "tests/core/pipeline/element_array.hpp"

#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"

namespace sonar::reference {
namespace {

/// Returns the distance between a point at range r and direction sine u and an element at y, minus r.
double detour_m(double range_m, double sine, double element_y_m) {
  const double way = std::sqrt(range_m * range_m - 2 * range_m * sine * element_y_m + element_y_m * element_y_m);
  return (element_y_m * element_y_m - 2 * range_m * sine * element_y_m) / (way + range_m);
}

}  // namespace

ElementArray::ElementArray(const FrequencyMode& mode, double sound_speed_mps, double pitch_wavelengths)
    : turns_per_s_(static_cast<double>(mode.centre_hz)), sound_speed_mps_(sound_speed_mps) {
  const Taper taper = mode.pattern.azimuth_taper;
  const double aperture = aperture_in_wavelengths(taper, static_cast<double>(mode.pattern.azimuth_width_rad));
  const TaperSeries series = taper_series(taper);
  const int count = static_cast<int>(std::lround(aperture / pitch_wavelengths));
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const double p = (i + 0.5 - 0.5 * count) * pitch_wavelengths / aperture;  // position on the aperture
    double shading = 1;
    for (int m = 1; m < taper_terms; ++m) shading += 2 * series.c[m] * std::cos(2 * pi * m * p);
    place_m_.push_back(p * aperture * sound_speed_mps / turns_per_s_);
    weight_.push_back(shading);
    sum += shading;
  }
  for (double& w : weight_) w /= sum;
}

std::vector<std::vector<Complex>> ElementArray::beams(std::span<const PlacedScatterer> scatterers,
                                                      std::span<const double> beam_sines, const Grid& grid, const Envelope& p,
                                                      double reach_s) const {
  std::vector<std::vector<Complex>> s(beam_sines.size(), std::vector<Complex>(static_cast<std::size_t>(grid.samples)));
  const double across_s =
      std::abs(place_m_.front()) / sound_speed_mps_ * 2;  // elements may receive earlier or later by this time
  for (std::size_t j = 0; j < beam_sines.size(); ++j)
    for (const PlacedScatterer& scatterer : scatterers) {
      const double r = length(scatterer.in_sonar), sine = scatterer.in_sonar.y / r, delay_s = 2 * r / grid.sound_speed_mps;
      for (int n = 0; n < grid.samples; ++n) {
        const double off_s = grid.time_s(n) - delay_s, focus_m = grid.first_range_m + n * grid.spacing_m;
        if (std::abs(off_s) > reach_s + across_s) continue;
        Complex sum;
        for (std::size_t e = 0; e < place_m_.size(); ++e) {
          // The rest of the path difference of this element after the beam's own delay.
          const double left_s =
              (detour_m(r, sine, place_m_[e]) - detour_m(focus_m, beam_sines[j], place_m_[e])) / sound_speed_mps_;
          sum += weight_[e] * p(off_s - left_s) * std::polar(1.0, -2 * pi * turns_per_s_ * left_s);
        }
        s[j][static_cast<std::size_t>(n)] += scatterer.amplitude * sum;
      }
    }
  return s;
}

}  // namespace sonar::reference
