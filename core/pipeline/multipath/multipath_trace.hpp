// What is visible by way of mirrors: the rays of a fan are followed through up to two flat mirrors. Every direction meets one
// chain of mirrors, so one map of directions serves all ways; multipath_scatter asks it which places a way reaches.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/multipath/multipath_legs.hpp"
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

/// Part of a block of columns that a way owns; empty when it owns nothing.
struct LegWindow {
  int first_bin = std::numeric_limits<int>::max(), last_bin = -1;  // inclusive
  bool empty() const { return last_bin < first_bin; }
};

/// Per column, over the tangent of elevation.
struct BounceMap {
  static constexpr std::uint8_t no_mirror = 0xFF;
  struct Node {
    float inverse_x[3];      // after 0, 1, 2 bounces: 1 / x of the surface met, x along the unfolded way (DepthMap), 0 = none
    std::uint8_t mirror[2];  // which the first and the second of them are, or no_mirror
  };
  BounceFan fan;
  int columns = 0;
  std::vector<Node> nodes;  // [columns][bins + 1]
  static constexpr int block_columns = RayPacket::size;
  std::vector<std::array<LegWindow, (most_mirrors + 1) * (most_mirrors + 1)>> windows;  // per block of columns, by index_of

  static std::size_t index_of(int first, int second) {
    return static_cast<std::size_t>((first + 1) * (most_mirrors + 1) + second + 1);
  }
  const LegWindow& window(std::size_t block, const Leg& leg) const { return windows[block][index_of(leg.first, leg.second)]; }
  bool owns_nothing(const Leg& leg) const;
};

/// Returns the number of rays.
std::size_t trace_bounces(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, const FlatFaces& faces,
                          const std::vector<FlatMirror>& mirrors, Parallel& pool, BounceMap& map);

/// One line followed through the mirrors of a leg to a place: whether nothing is in the way.
bool reaches(const RayScene& scene, const PingScalars& scalars, const FlatFaces& faces, const std::vector<FlatMirror>& mirrors,
             const Leg& leg, Vec3d place);

}  // namespace sonar
