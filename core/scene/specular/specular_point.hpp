// Points on smooth surfaces that reflect sound straight back, because the surface's normal passes through the sonar. Each point
// has the curvatures and the extent of its surface. specular_primitives and specular_mesh find the points.
// core/pipeline/specular makes echoes of them.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// A piece of an outline in the tangent plane [m].
struct OutlineEdge {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// The foot of the perpendicular from the sonar, in object coordinates. If it lies outside its surface, the echo comes from the
/// surface's edge.
struct SpecularPoint {
  Vec3d foot_m;
  Vec3d normal;                       // unit, toward the sonar
  std::array<Vec3d, 2> along;         // principal directions, unit
  std::array<double, 2> curvature{};  // 1/m, along the principal directions; positive if the surface curves away from the sonar
  double range_m = 0;                 // sonar to foot

  // Extent of the surface from the foot along the principal directions (arc length) [m]; infinite if the surface ends only where
  // it curves away.
  std::array<double, 2> from{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  std::array<double, 2> to{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  std::vector<OutlineEdge> outline;  // closed, relative to the foot; empty = the rectangle of `from` and `to`
  std::uint16_t material = 0;

  /// The point at these arc lengths along the principal directions, on arcs of the two curvatures.
  Vec3d place(double x, double y) const {
    const auto arc = [](double s, double k) { return std::abs(k * s) > 1e-9 ? std::sin(k * s) / k : s; };
    const auto drop = [](double s, double k) { return std::abs(k * s) > 1e-4 ? (1 - std::cos(k * s)) / k : 0.5 * k * s * s; };
    return foot_m + arc(x, curvature[0]) * along[0] + arc(y, curvature[1]) * along[1] -
           (drop(x, curvature[0]) + drop(y, curvature[1])) * normal;
  }
};

/// Values of the sonar that the search for specular points uses.
struct SpecularQuery {
  Vec3d sonar_m;  // in object coordinates
  double wavelength_m = 1e-3;
  double max_range_m = 0;
  // A cone outside which no echoes are needed. By default the cone contains all directions.
  Vec3d ahead{1, 0, 0};
  double widest_rad = 4;
};

/// Surfaces whose nearest edge is farther from the foot than this number of Fresnel units sqrt(lambda rho) / 2 are ignored.
/// Their echoes are below -33 dB.
inline constexpr double farthest_edge_in_units = 10;
/// Surfaces more than about 30 degrees from the perpendicular are ignored, too.
inline constexpr double farthest_edge_in_ranges = 0.6;
/// sqrt(lambda rho) / 2 along a direction. This is the unit of length of the Fresnel integral.
double fresnel_unit_m(double wavelength_m, double range_m, double curvature_per_m);
/// 1 + range * curvature. The absolute value is at least 0.05 here, because ray theory is infinite at a focus.
double bending(double range_m, double curvature_per_m);

}  // namespace sonar
