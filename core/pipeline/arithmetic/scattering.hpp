// Echo of a scatterer: Lambert cross-sections, spreading, absorption, carrier phase (docs/acoustics.md, section 3).
// The file uses only C++17 and the standard library.
#pragma once

#include <cmath>

#include "core/base/host_device.hpp"

namespace sonar {

/// Lower limit of the cosine of incidence in the area of a facet per solid angle. Without it the area would be infinite at
/// silhouettes.
inline constexpr double cosine_floor = 1e-3;
/// Range [m] below which there are no echoes. This range is inside the housing, where 1/r^2 does not apply.
inline constexpr double nearest_scatterer_m = 1e-2;

/// mu [1/sr] from 10 log10 mu [dB].
SONAR_HD inline double lambert_coefficient(double lambert_db) { return std::pow(10.0, 0.1 * lambert_db); }

/// Lambert's sigma_b = mu cos^2(incidence) per unit surface area.
SONAR_HD inline double lambert_per_area(double mu, double cosine) { return mu * cosine * cosine; }
/// Surface area [m^2] seen in a solid angle at range r.
SONAR_HD inline double footprint_area_m2(double cosine, double range_m, double solid_angle_sr) {
  const double c = std::fabs(cosine);
  return range_m * range_m * solid_angle_sr / (c > cosine_floor ? c : cosine_floor);
}

/// Amplitude absorption [Np/m] from dB/m: 1 Np = 8.686 dB.
SONAR_HD inline double nepers_from_db(double db) { return db * 0.11512925464970228; }

/// Two-way pressure factor 1/r^2 exp(-2 alpha r); alpha one way [Np/m]. 0 at ranges below nearest_scatterer_m, and for NaN.
SONAR_HD inline double two_way_transmission(double range_m, double alpha_np_per_m) {
  if (!(range_m >= nearest_scatterer_m)) return 0;
  return std::exp(-2 * alpha_np_per_m * range_m) / (range_m * range_m);
}

/// A phase in turns, modulo 1: an echo is multiplied by exp(-i 2 pi turns), turns = 2 f r / c. It is a double, because the
/// rounding of a float range would cause an error of 1e-3 of the signal at 900 kHz (docs/acoustics.md, section 1).
SONAR_HD inline double fraction_of_turn(double turns) { return turns - std::floor(turns); }

}  // namespace sonar
