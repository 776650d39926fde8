// Computes how much of a mirror's echo reaches the sonar if the surface is finite and partly hidden: Fresnel integrals over the
// visible part (docs/acoustics.md, section 3). Used by specular.
#pragma once

#include <array>
#include <bitset>
#include <complex>
#include <span>

#include "core/scene/specular/specular_point.hpp"

namespace sonar {

/// Divides the extent into cells around the point that contributes most, to find hidden parts. The outermost cells reach to the
/// edge.
struct SpecularWindow {
  static constexpr std::size_t cells = 16;
  std::array<std::array<double, cells + 1>, 2> edge{};  // along the principal directions [m]
  std::bitset<cells * cells> hidden;                    // y * cells + x
};
SpecularWindow make_window(const SpecularPoint& point, double wavelength_m);

/// K_1 K_2 of eq. 7 with its phase: 1 for an infinite mirror, a factor i for each focus on the path (time convention e^{+i 2 pi
/// f t}).
std::complex<double> specular_factor(const SpecularPoint& point, double wavelength_m);
/// The same factor without the cells that are hidden.
std::complex<double> specular_factor(const SpecularPoint& point, double wavelength_m, const SpecularWindow& window);

/// True if a point in the tangent plane belongs to the surface.
bool on_surface(const SpecularPoint& point, double x, double y);
/// The point of the surface that is nearest to the foot of the perpendicular from the sonar.
std::array<double, 2> nearest_on_surface(const SpecularPoint& point);

}  // namespace sonar
