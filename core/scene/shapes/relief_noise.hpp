// Smooth random fields for made terrain and boulders, drawn from Philox: the same seed gives the same ground everywhere.
// Used when a scene is loaded; pings never call it.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/random.hpp"

namespace sonar {

/// Value noise on the unit lattice in space, -1..1, smooth; `stream` tells fields of one seed apart.
double value_noise(Vec3d p, std::uint32_t seed, std::uint32_t stream);

/// Gradient noise over a rectangle of the plane, about -1..1, with features of one wavelength. The lattice is drawn once.
class GradientField {
 public:
  /// Covers |x| <= half_x, |y| <= half_y, in metres.
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
