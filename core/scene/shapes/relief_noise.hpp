// Smooth random fields for generated terrain and boulders. They use Philox, so the same seed gives the same terrain on every
// machine. Only the loading of scenes uses them.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/random.hpp"

namespace sonar {

/// Smooth value noise on the unit lattice in space, in -1..1. Two fields with the same seed differ if their `stream` differs.
double value_noise(Vec3d p, std::uint32_t seed, std::uint32_t stream);

/// Gradient noise over a rectangle of the plane, about -1..1, with features of one wavelength. The constructor draws the
/// gradients of the lattice.
class GradientField {
 public:
  /// The field covers |x| <= half_x and |y| <= half_y [m].
  GradientField(double half_x_m, double half_y_m, double wavelength_m, std::uint32_t seed, std::uint32_t stream);
  double operator()(double x_m, double y_m) const;

 private:
  struct Slope {
    float x, y;
  };
  double wavelength_m_;
  int first_x_, first_y_, columns_, rows_;
  std::vector<Slope> slopes_;
};

}  // namespace sonar
