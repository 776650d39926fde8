// A receive array, element by element: every echo is delayed to every element, shaded, focused and summed in double. It is the
// slow reference for eq. (9), which uses only the far-field pattern of an array (docs/acoustics.md, section 6).
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/sonar/sonar_model.hpp"
#include "tests/core/pipeline/reference.hpp"

namespace sonar::reference {

/// A scattering point: its position, and its amplitude at the array's centre including the carrier.
struct PlacedScatterer {
  Vec3d in_sonar;
  Complex amplitude;
};

class ElementArray {
 public:
  /// Makes elements along y, `pitch_wavelengths` apart. They cover the aperture of the pattern's azimuth width and are shaded
  /// by its taper.
  ElementArray(const FrequencyMode& mode, double sound_speed_mps, double pitch_wavelengths = 0.5);
  int elements() const { return static_cast<int>(place_m_.size()); }

  using Envelope = std::function<Complex(double)>;  // p(t)
  /// Returns s_j[n] of beams that are focused at every range of the grid. [beams][samples]
  std::vector<std::vector<Complex>> beams(std::span<const PlacedScatterer> scatterers, std::span<const double> beam_sines,
                                          const Grid& grid, const Envelope& p, double reach_s) const;

 private:
  double turns_per_s_, sound_speed_mps_;
  std::vector<double> place_m_, weight_;
};

}  // namespace sonar::reference
