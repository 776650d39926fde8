// Refines fans of rays. An interval between two directions of a column is halved until both ends are on a surface that can be
// interpolated, or until the interval counts as an edge. This is used for direct views (trace_fan) and for views via mirrors
// (multipath_trace).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// The hit of a ray at one stage of its path. Ranges are measured along the whole path, including the parts before mirrors.
struct SurfaceHit {
  std::uint32_t object = RayPacket::miss;
  float range_m = 0, inverse_x = 0;  // 1 / x, x = forward coordinate in the sonar's frame; 0 = no hit
  Vec3 normal;                       // normal of the facet, of any length, in world axes
  float offset = 0;                  // the facet's plane is normal . p = offset; p is relative to the sonar's last image
  Vec3 direction;                    // unit direction of the last leg, in the same axes

  /// Hit of a ray after `range_m` along the whole path; `forward`: x of the unit direction in which the path left the sonar.
  static SurfaceHit by(const RayPacket& rays, std::size_t lane, float range_m, float forward) {
    SurfaceHit surface;
    surface.object = rays.object[lane];
    const bool hit = surface.object != RayPacket::miss;
    surface.range_m = hit ? range_m : 0;
    surface.inverse_x = hit ? 1.0f / std::max(surface.range_m * forward, 1e-4f) : 0;
    surface.normal = {rays.normal_x[lane], rays.normal_y[lane], rays.normal_z[lane]};
    surface.direction = {rays.direction_x[lane], rays.direction_y[lane], rays.direction_z[lane]};
    surface.offset = surface.range_m * dot(surface.normal, surface.direction);
    return surface;
  }
};

/// One direction of a column. Derived types add the hits, one surface per stage.
struct FanSample {
  float elevation_rad = 0, tangent = 0, forward = 0;  // forward: x of the unit direction
  std::int32_t next = -1;                             // the sample above in the same column, -1 = last
  bool edge_above = false;                            // the interval up to `next` contains an edge: do not interpolate
};

/// An interval between two samples of a column whose middle must be traced.
struct FanInterval {
  std::int32_t below, above;
  std::int32_t column;
  int depth;
};

/// Sample: a FanSample with `int stages() const`, `const SurfaceHit& surface_at(int stage) const` and `bool same_mirrors(b)
/// const`. same_mirrors: true if both hit the same number of surfaces via the same mirrors.
template <class Sample>
class FanRefinement {
 public:
  /// The caller keeps the buffers from ping to ping. `first_column`: the first column's number in the plan; it makes a column's
  /// hits independent of the columns traced with it.
  FanRefinement(std::vector<Sample>& samples, std::vector<FanInterval>& open, std::vector<FanInterval>& halves,
                float pulse_width_m, int first_column)
      : samples_(samples), open_(open), halves_(halves), tolerance_m_(pulse_width_m), first_column_(first_column) {
    open_.clear();
  }

  /// Adds the interval between two neighbours to the open ones if its middle must be traced.
  void consider_base(std::int32_t below, std::int32_t above, std::int32_t column) { consider(below, above, column, 0, open_); }

  /// trace(intervals) traces the middles of intervals as one packet and appends their samples in order.
  template <class Trace>
  void run(const Trace& trace) {
    for (int depth = 1; depth <= deepest && !open_.empty(); ++depth) {
      halves_.clear();
      for (std::size_t from = 0; from < open_.size(); from += RayPacket::size) {
        const std::size_t n = std::min<std::size_t>(RayPacket::size, open_.size() - from);
        const auto first = static_cast<std::int32_t>(samples_.size());
        trace(std::span<const FanInterval>(open_).subspan(from, n));
        for (std::size_t i = 0; i < n; ++i) insert(open_[from + i], first + static_cast<std::int32_t>(i));
      }
      std::swap(open_, halves_);
    }
  }
  /// The elevation at which an interval is halved. If the interval contains an edge, this is its middle. Within one surface, this
  /// is near the middle, but different in each column. Rays in equal steps could hit only the crests of ripples, which would then
  /// look flat.
  float middle_rad(const FanInterval& v) {
    const float below = at(v.below).elevation_rad, above = at(v.above).elevation_rad;
    if (!hit_the_same(at(v.below), at(v.above))) return 0.5f * (below + above);
    const float turns = golden_turn * static_cast<float>(first_column_ + v.column) + 0.5f * static_cast<float>(v.depth);
    const float part = 0.5f + widest_skew * (2 * (turns - std::floor(turns)) - 1);
    return below + part * (above - below);
  }

 private:
  // Edges are located to 1/16 of a base interval. A surface that cannot be interpolated even then counts as an edge.
  static constexpr int deepest = 4;
  // A surface deviates from the straight line between two hits by about a quarter (here half a pulse width) of the maximum
  // that its slopes allow. The middle may deviate by one pulse width more. The sum is the 1.5 of PingPlan::depth_tolerance_m.
  // With larger slopes a middle on the line proves nothing, because the rays may hit equal phases of ripples.
  static constexpr float slope_tolerance_in_pulses = 2;
  static constexpr float golden_turn = 0.61803399f;  // the multiples of this fraction of a turn are evenly distributed
  static constexpr float widest_skew = 0.15f;        // fraction of an interval, to either side of its middle

  Sample& at(std::int32_t i) { return samples_[static_cast<std::size_t>(i)]; }

  static bool hit_the_same(const Sample& a, const Sample& b) {
    if (!a.same_mirrors(b)) return false;
    for (int stage = 0; stage < a.stages(); ++stage)
      if (a.surface_at(stage).object != b.surface_at(stage).object) return false;
    return true;
  }

  /// Adds an interval to `list` if its middle must be traced. An interval is an edge if its ends hit different surfaces, or if
  /// they are far apart at the largest depth.
  void consider(std::int32_t below, std::int32_t above, std::int32_t column, int depth, std::vector<FanInterval>& list) {
    Sample &a = at(below), &b = at(above);
    const bool same = hit_the_same(a, b);
    if (same && !far_apart(a, b)) return;
    if (depth < deepest) list.push_back({below, above, column, depth});
    if (!same || depth >= deepest) a.edge_above = true;
  }
  bool far_apart(const Sample& a, const Sample& b) const {
    for (int stage = 0; stage < a.stages(); ++stage)
      if (std::abs(a.surface_at(stage).range_m - b.surface_at(stage).range_m) > tolerance_m_) return true;
    return false;
  }

  void insert(const FanInterval& v, std::int32_t middle) {
    at(middle).next = v.above;
    at(middle).edge_above = false;
    at(v.below).next = middle;
    at(v.below).edge_above = false;
    if (interpolates(at(v.below), at(middle), at(v.above))) return;
    consider(v.below, middle, v.column, v.depth + 1, halves_);
    consider(middle, v.above, v.column, v.depth + 1, halves_);
  }

  bool interpolates(const Sample& a, const Sample& m, const Sample& b) const {
    if (!hit_the_same(a, m) || !hit_the_same(a, b)) return false;
    const float part = (m.tangent - a.tangent) / (b.tangent - a.tangent);
    for (int stage = 0; stage < m.stages(); ++stage) {
      const SurfaceHit &below = a.surface_at(stage), &middle = m.surface_at(stage), &above = b.surface_at(stage);
      if (middle.object == RayPacket::miss) continue;
      const float expected_x = 1.0f / (below.inverse_x + part * (above.inverse_x - below.inverse_x));
      if (std::abs(expected_x / m.forward - middle.range_m) > tolerance_m_) return false;
      if (!(planes_agree(below, middle) && planes_agree(above, middle))) return false;
    }
    return true;
  }
  /// True if each hit's plane crosses the other hit's ray near the other hit.
  bool planes_agree(const SurfaceHit& a, const SurfaceHit& b) const {
    const float most = slope_tolerance_in_pulses * tolerance_m_;
    return std::abs(a.offset / dot(a.normal, b.direction) - b.range_m) <= most &&
           std::abs(b.offset / dot(b.normal, a.direction) - a.range_m) <= most;
  }

  std::vector<Sample>& samples_;
  std::vector<FanInterval>&open_, &halves_;
  float tolerance_m_;
  int first_column_;
};

}  // namespace sonar
