// Kernel bodies of the fan of rays. They compute the same values as trace_fan, in another order: one thread refines the
// interval between two base rays from bottom to top and draws it into the depth map immediately. So no samples are stored, and
// results do not depend on the order of threads. FanRefinement (core/pipeline/fan_refinement.hpp) contains the rule for
// refining. Tests compare the results.
#pragma once

#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "cuda/counting.hpp"
#include "cuda/trace_ray.hpp"

namespace sonar::cuda {

namespace fan {
inline constexpr int deepest = 4;  // equals that of FanRefinement
inline constexpr float slope_tolerance_in_pulses = 2, golden_turn = 0.61803399f, widest_skew = 0.15f;
}  // namespace fan

/// Sine and cosine are rounded from double. So they are the same on host and device.
SONAR_HD inline BaseElevation elevation_at(float angle_rad) {
  const auto angle = static_cast<double>(angle_rad);
  return {angle_rad, static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
}

SONAR_HD inline FanRay look(const PingView& p, ColumnSine column, BaseElevation e) {
  const SeaView& s = p.sea;
  const float* m = s.world_from_sonar;
  const Vec3 d = ray_in_sonar(s.conical != 0, column.along, column.across, e.cosine, e.sine);
  const Vec3 along{m[0] * d.x + m[1] * d.y + m[2] * d.z, m[3] * d.x + m[4] * d.y + m[5] * d.z,
                   m[6] * d.x + m[7] * d.y + m[8] * d.z};
  const Ray ray{{s.origin[0], s.origin[1], s.origin[2]}, {along.x, along.y, along.z}};
  const RayHit hit = trace_ray(p.tracer, ray, s.far_m);
  FanRay r{};
  r.elevation_rad = e.angle_rad;
  r.forward = s.conical != 0 ? column.across * e.cosine : e.cosine;
  r.tangent = e.sine / e.cosine;
  r.object = hit.object;
  r.direction = along;
  if (hit.object == no_object) return r;
  r.range_m = hit.range_m;
  const float x = hit.range_m * r.forward;
  r.inverse_x = 1.0f / (x < 1e-4f ? 1e-4f : x);
  r.normal = hit.normal;
  r.offset = hit.range_m * dot(hit.normal, along);
  return r;
}

/// Traces base ray `i` of [elevations][columns].
SONAR_HD inline void trace_base(const PingView& p, std::uint32_t i) {
  const std::uint32_t columns = static_cast<std::uint32_t>(p.sea.columns);
  const auto e = static_cast<std::int32_t>(i / columns), sides = p.sea.side_elevations, step = p.sea.side_columns;
  auto column = static_cast<std::int32_t>(i % columns);
  // In the side lobes a few columns share one ray.
  if (e < sides || e >= p.sea.elevations - sides) {
    column = column - column % step + step / 2;
    if (column >= p.sea.columns) column = p.sea.columns - 1;
  }
  p.fan_rays[i] = look(p, p.column_sines[column], p.base_elevations[e]);
}

SONAR_HD inline bool far_apart(const FanRay& a, const FanRay& b, float tolerance_m) {
  return std::fabs(a.range_m - b.range_m) > tolerance_m;
}
SONAR_HD inline float middle_rad(const FanRay& a, const FanRay& b, int column, int depth) {
  const float below = a.elevation_rad, above = b.elevation_rad;
  if (a.object != b.object) return 0.5f * (below + above);
  const float turns = fan::golden_turn * static_cast<float>(column) + 0.5f * static_cast<float>(depth);
  const float part = 0.5f + fan::widest_skew * (2 * (turns - std::floor(turns)) - 1);
  return below + part * (above - below);
}
SONAR_HD inline bool planes_agree(const FanRay& a, const FanRay& b, float tolerance_m) {
  const float most = fan::slope_tolerance_in_pulses * tolerance_m;
  return std::fabs(a.offset / dot(a.normal, b.direction) - b.range_m) <= most &&
         std::fabs(b.offset / dot(b.normal, a.direction) - a.range_m) <= most;
}
SONAR_HD inline bool interpolates(const FanRay& a, const FanRay& m, const FanRay& b, float tolerance_m) {
  if (a.object != m.object || a.object != b.object) return false;
  if (m.object == no_object) return true;
  const float part = (m.tangent - a.tangent) / (b.tangent - a.tangent);
  const float expected_x = 1.0f / (a.inverse_x + part * (b.inverse_x - a.inverse_x));
  if (std::fabs(expected_x / m.forward - m.range_m) > tolerance_m) return false;
  return planes_agree(a, m, tolerance_m) && planes_agree(b, m, tolerance_m);
}

/// Computes the same as FanTracer::per_column (core/pipeline/trace_fan.cpp).
SONAR_HD inline float per_column(const SeaView& s, const FanRay& a, ColumnSine column) {
  if (a.object == no_object || a.offset == 0) return 0;
  const float* m = s.world_from_sonar;
  const float to_port = a.normal.x * m[1] + a.normal.y * m[4] + a.normal.z * m[7];
  if (s.conical != 0) return -s.column_spacing * to_port / (a.offset * column.across * column.across * a.forward);
  const float forward = a.normal.x * m[0] + a.normal.y * m[3] + a.normal.z * m[6];
  return -s.column_spacing * (to_port - forward * column.along / column.across) / a.offset;
}

/// Draws the depth map of one column from bottom to top.
struct DepthPen {
  const SeaView* sea;
  ColumnSine column;
  float *map, *slope;  // [bins + 1]
  int bin;

  SONAR_HD static int bin_below(const SeaView& s, float tangent) {
    const int bin = static_cast<int>(bin_of_tangent(s.axis, tangent));
    return bin < s.bins ? bin : s.bins;
  }
  SONAR_HD void draw(const FanRay& a, const FanRay& b, bool edge, bool last) {
    const int end = last ? sea->bins : bin_below(*sea, b.tangent);
    const float farther = b.inverse_x < a.inverse_x ? b.inverse_x : a.inverse_x;
    const float per_tangent = (b.inverse_x - a.inverse_x) / (b.tangent - a.tangent);
    const FanRay& of = b.inverse_x < a.inverse_x ? b : a;
    const std::int32_t mark = surface_mark(of.object);
    const float aside = per_column(*sea, of, column);
    for (; bin <= end; ++bin) {
      const float tangent = tangent_of_bin(sea->axis, static_cast<float>(bin));
      const float between = a.inverse_x + per_tangent * (tangent - a.tangent);
      map[bin] = with_mark(edge ? farther : (0.0f < between ? between : 0.0f), mark);
      slope[bin] = sea->has_upper_marks != 0 ? with_upper_mark(aside, mark) : aside;
    }
  }
};

SONAR_HD inline void note(const FanRay& r, float widest_rad, FirstHit& nearest) {
  if (r.object == no_object || !(std::fabs(r.elevation_rad) <= widest_rad)) return;
  if (nearest.object != no_object && nearest.range_m <= r.range_m) return;
  nearest.range_m = r.range_m;
  nearest.object = r.object;
}

/// Refines interval `i` of [elevations - 1][columns].
SONAR_HD inline void refine(const PingView& p, std::uint32_t i) {
  const SeaView& s = p.sea;
  const auto columns = static_cast<std::uint32_t>(s.columns);
  const std::uint32_t e = i / columns, column = i % columns;
  const ColumnSine sine = p.column_sines[column];
  const auto sides = static_cast<std::uint32_t>(s.side_elevations);
  const bool side = e < sides || e + 1 + sides >= static_cast<std::uint32_t>(s.elevations);
  struct Above {
    FanRay ray;
    int depth;
    bool settled;  // true: can be interpolated from the ray below
  };
  Above above[fan::deepest + 2];
  int waiting = 1;
  FanRay below = p.fan_rays[i];
  above[0] = {p.fan_rays[i + columns], 0, false};
  const std::int64_t of_column = static_cast<std::int64_t>(column) * (s.bins + 1);
  DepthPen pen{&s, sine, p.depth + of_column, p.depth_slope + of_column, e == 0 ? 0 : DepthPen::bin_below(s, below.tangent) + 1};
  FirstHit nearest{0, no_object};
  if (e == 0) note(below, s.truth_half_width_rad, nearest);
  std::uint32_t rays = 0;
  while (waiting > 0) {
    Above& top = above[waiting - 1];
    bool edge = false;
    if (!top.settled) {
      const bool same = below.object == top.ray.object;
      const bool open = !same || (!side && far_apart(below, top.ray, s.pulse_width_m));
      if (open && !side && top.depth < fan::deepest) {
        const BaseElevation middle = elevation_at(middle_rad(below, top.ray, static_cast<int>(column), top.depth));
        const FanRay between = look(p, sine, middle);
        ++rays;
        top.settled = interpolates(below, between, top.ray, s.pulse_width_m);
        ++top.depth;
        above[waiting] = {between, top.depth, top.settled};
        ++waiting;
        continue;
      }
      edge = open;
    }
    pen.draw(below, top.ray, edge, waiting == 1 && e + 2 == static_cast<std::uint32_t>(s.elevations));
    note(top.ray, s.truth_half_width_rad, nearest);
    below = top.ray;
    --waiting;
  }
  if (p.first_hits != nullptr) p.first_hits[i] = nearest;
  if (rays > 0) add_count(p.counters[0], rays);
}

/// Finds, for column `i`, the nearest hit of its intervals; if two are equally near, the lower one.
SONAR_HD inline void first_hits(const PingView& p, std::uint32_t i) {
  FirstHit nearest{0, no_object};
  for (int e = 0; e + 1 < p.sea.elevations; ++e) {
    const FirstHit here = p.first_hits[static_cast<std::uint32_t>(e) * static_cast<std::uint32_t>(p.sea.columns) + i];
    if (here.object != no_object && (nearest.object == no_object || here.range_m < nearest.range_m)) nearest = here;
  }
  p.column_truth[i] = nearest;
}

}  // namespace sonar::cuda
