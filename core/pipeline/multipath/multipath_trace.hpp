// Traces the view via mirrors: the rays of a fan are followed via up to two flat mirrors. Each direction has one sequence of
// mirrors, so one map is enough for all paths. multipath_scatter uses this map to find the points that each path reaches.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/pipeline/multipath/multipath_paths.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// Directions in which echoes via mirrors leave and arrive. Columns are those of PingPlan. Elevations extend farther than for
/// direct echoes, to 0.1 of the one-way pattern, because only one of the two paths may be far off the axis.
struct BounceFan {
  double half_angle_rad = 0;
  float first_tangent = 0, bins_per_tangent = 0;
  int bins = 0;
  std::vector<float> elevation_rad;
};
BounceFan make_bounce_fan(const PingPlan& plan);

/// The part of a block of columns that belongs to one path. It may be empty.
struct PathWindow {
  int first_bin = std::numeric_limits<int>::max(), last_bin = -1;  // inclusive
  bool empty() const { return last_bin < first_bin; }
};

/// For each column, nodes spaced evenly in the tangent of elevation.
struct BounceMap {
  static constexpr std::uint8_t no_mirror = 0xFF;
  struct Node {
    /// [n]: 1 / x of the surface that is hit after n bounces (0: none). x is measured along the unfolded path, as in DepthMap.
    float inverse_x[3];
    std::uint8_t mirror[2];  // index of the first and the second mirror, or no_mirror
  };
  BounceFan fan;
  int columns = 0;
  std::vector<Node> nodes;  // [columns][bins + 1]
  static constexpr int block_columns = RayPacket::size;
  std::vector<std::array<PathWindow, (most_mirrors + 1) * (most_mirrors + 1)>> windows;  // per block of columns, by index_of

  static std::size_t index_of(int first, int second) {
    return static_cast<std::size_t>((first + 1) * (most_mirrors + 1) + second + 1);
  }
  const PathWindow& window(std::size_t block, const Path& path) const {
    return windows[block][index_of(path.first, path.second)];
  }
  bool owns_nothing(const Path& path) const;
};

/// Traces the fan. Returns the number of rays.
std::size_t trace_bounces(const PingContext& context, const FlatFaces& faces, const std::vector<FlatMirror>& mirrors,
                          BounceMap& map);

/// Follows a path via its mirrors to a point, and returns true if no surface blocks the path.
bool reaches(const RayScene& scene, const PingScalars& scalars, const FlatFaces& faces, const std::vector<FlatMirror>& mirrors,
             const Path& path, Vec3d place);

}  // namespace sonar
