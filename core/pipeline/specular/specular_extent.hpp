// How much of a mirror's echo reaches the sonar when only a part of the surface is there to be seen: Fresnel integrals over the
// visible part (docs/acoustics.md, section 3). Used by specular.
#pragma once

#include <array>
#include <bitset>
#include <complex>
#include <span>

#include "core/scene/mirrors/mirror_point.hpp"

namespace sonar {

/// The extent cut into cells about the place that matters most, to tell which parts are hidden. Outermost cells go on to the
/// edge.
struct MirrorWindow {
  static constexpr std::size_t cells = 16;
  std::array<std::array<double, cells + 1>, 2> edge{};  // along the principal directions [m]
  std::bitset<cells * cells> hidden;                    // y * cells + x
};
MirrorWindow make_window(const MirrorPoint& point, double wavelength_m);

/// K_1 K_2 of eq. 7 with its phase: 1 for an endless mirror, i for each focus on the way (time convention e^{+i 2 pi f t}).
std::complex<double> mirror_factor(const MirrorPoint& point, double wavelength_m);
/// The same without the cells that are hidden.
std::complex<double> mirror_factor(const MirrorPoint& point, double wavelength_m, const MirrorWindow& window);

/// Whether a place in the tangent plane belongs to the surface.
bool on_surface(const MirrorPoint& point, double x, double y);
/// The place of the surface that is nearest to the foot.
std::array<double, 2> nearest_on_surface(const MirrorPoint& point);

}  // namespace sonar
