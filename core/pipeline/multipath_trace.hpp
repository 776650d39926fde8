// What is visible by way of mirrors: the rays of a fan are followed through up to two flat mirrors. Every direction meets one
// chain of mirrors, so one map of directions serves all ways; multipath_scatter asks it which places a way reaches.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/multipath_legs.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// Directions that echoes by way of mirrors leave and come by: columns as in PingPlan, elevations wider than for direct echoes,
/// because only one way of two may be far off the axis: out to 0.1 of the one-way pattern.
struct BounceFan {
  double half_angle_rad = 0;
  float first_tangent = 0, bins_per_tangent = 0;
  int bins = 0;
  std::vector<float> elevation_rad;
};
BounceFan make_bounce_fan(const PingPlan& plan);

/// Part of the map that a way owns; empty when it owns nothing.
struct LegWindow {
  int first_column = std::numeric_limits<int>::max(), last_column = -1;  // inclusive
  int first_bin = std::numeric_limits<int>::max(), last_bin = -1;
  bool empty() const { return last_column < first_column; }
};

/// Per column, over the tangent of elevation, after 0, 1 and 2 bounces: 1 / x of the surface met, x along the unfolded way (see
/// DepthMap), 0 = none; and the mirror that surface is.
struct BounceMap {
  static constexpr std::uint8_t no_mirror = 0xFF;
  static constexpr int mirror_room = most_mirrors + 1;
  BounceFan fan;
  int columns = 0;
  std::array<std::vector<float>, 3> inverse_x;                            // [columns][bins + 1]
  std::array<std::vector<std::uint8_t>, 2> mirror;                        // [columns][bins + 1]
  std::array<LegWindow, (most_mirrors + 1) * (most_mirrors + 1)> window;  // [first + 1][second + 1] of a leg

  const LegWindow& window_of(const Leg& leg) const { return window[index(leg.first, leg.second)]; }
  static std::size_t index(int first, int second) { return static_cast<std::size_t>((first + 1) * mirror_room + second + 1); }
};

/// Returns the number of rays.
std::size_t trace_bounces(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, const FlatFaces& faces,
                          const std::vector<FlatMirror>& mirrors, Parallel& pool, BounceMap& map);

/// One line followed through the mirrors of a leg to a place: whether nothing is in the way.
bool reaches(const RayScene& scene, const PingScalars& scalars, const FlatFaces& faces, const std::vector<FlatMirror>& mirrors,
             const Leg& leg, Vec3d place);

}  // namespace sonar
