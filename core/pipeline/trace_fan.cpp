#include "core/pipeline/trace_fan.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/kernel_math.hpp"

namespace sonar {
namespace {

/// An elevation about the array axis, and values computed from it once.
struct Elevation {
  float angle_rad, cosine, sine;
};
Elevation elevation_at(float angle_rad) { return {angle_rad, std::cos(angle_rad), std::sin(angle_rad)}; }

/// A column's direction sine u, and sqrt(1 - u^2).
struct ColumnSine {
  float along, across;
};
std::vector<ColumnSine> column_sines(const Columns& columns, int first, int last) {
  std::vector<ColumnSine> sines;
  sines.reserve(static_cast<std::size_t>(last - first));
  for (int k = first; k < last; ++k) {
    const double u = columns.sine(k);
    sines.push_back({static_cast<float>(u), static_cast<float>(std::sqrt(std::max(0.0, 1 - u * u)))});
  }
  return sines;
}

/// Fills a packet of sixteen rays lane by lane. Rays only determine shadows, so float directions are accurate enough.
class PacketFiller {
 public:
  PacketFiller(const PingPlan& plan, const PingScalars& scalars, float far_m)
      : origin_(scalars.position_in_scene), far_m_(far_m), conical_(plan.switches.conical) {
    for (int i = 0; i < 9; ++i) m_[i] = static_cast<float>(scalars.world_from_sonar.m[i / 3][i % 3]);
  }

  void add(ColumnSine column, Elevation e) {
    const auto i = static_cast<std::size_t>(count_++);
    // Inverse of eq. 11: a unit direction in sonar axes from the column's u and the elevation psi.
    const auto [x, y, z] = ray_in_sonar(conical_, column.along, column.across, e.cosine, e.sine);
    packet.direction_x[i] = m_[0] * x + m_[1] * y + m_[2] * z;
    packet.direction_y[i] = m_[3] * x + m_[4] * y + m_[5] * z;
    packet.direction_z[i] = m_[6] * x + m_[7] * y + m_[8] * z;
    // Positions are relative to RayScene::origin() [m], so that floats are small even far from the world's origin.
    packet.origin_x[i] = origin_.x;
    packet.origin_y[i] = origin_.y;
    packet.origin_z[i] = origin_.z;
    // Largest true range whose echoes reach the last sample [m].
    packet.far[i] = far_m_;
  }
  void trace(const RayScene& scene, bool coherent = true) {
    // Bit i is lane i. The last packet of a row may be partly filled.
    scene.trace(packet, count_ == RayPacket::size ? 0xFFFFu : (1u << count_) - 1u, coherent);
    traced += static_cast<std::size_t>(count_);
  }
  void clear() { count_ = 0; }
  float far_m() const { return far_m_; }

  RayPacket packet{};
  std::size_t traced = 0;

 private:
  Vec3 origin_;
  float far_m_;
  bool conical_;
  float m_[9];
  int count_ = 0;
};

class FanTracer {
 public:
  FanTracer(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last, FanScratch& scratch)
      : scene_(scene),
        plan_(plan),
        filler_(plan, scalars, static_cast<float>(scalars.max_range_m)),
        first_(first),
        last_(last),
        s_(scratch) {
    for (int i = 0; i < 3; ++i) {
      ahead_[i] = static_cast<float>(scalars.world_from_sonar.m[i][0]);
      port_[i] = static_cast<float>(scalars.world_from_sonar.m[i][1]);
    }
    // One pulse width [m]. The depth map needs no higher accuracy (docs/acoustics.md, section 2).
    tolerance_m_ = static_cast<float>(plan.pulse_width_m);
    columns_ = column_sines(plan.columns, first, last);
    base_.reserve(plan.fan.elevation_rad.size());
    for (const float angle : plan.fan.elevation_rad) base_.push_back(elevation_at(angle));
  }

  std::size_t run(DepthMap& seen) {
    trace_base();
    refine();
    draw(seen);
    return filler_.traced;
  }

 private:
  using Sample = FanScratch::Sample;

  ColumnSine column(int k) const { return columns_[static_cast<std::size_t>(k)]; }
  Sample& at(std::int32_t i) { return s_.samples[static_cast<std::size_t>(i)]; }
  int elevations() const { return static_cast<int>(base_.size()); }

  /// Converts a lane of the packet to the sample for which it was traced.
  void store(int lane, Elevation e, ColumnSine column, Sample& sample) const {
    sample.elevation_rad = e.angle_rad;
    // x of the unit direction. The map holds 1 / x; for flat beams it holds 1 / h, where h is the horizontal distance.
    sample.forward = plan_.switches.conical ? column.across * e.cosine : e.cosine;
    sample.tangent = e.sine / e.cosine;
    const auto i = static_cast<std::size_t>(lane);
    sample.surface = SurfaceHit::by(filler_.packet, i, filler_.packet.far[i], sample.forward);
  }

  /// Traces elevation by elevation, with packets of sixteen neighbouring columns, which are a fraction of a degree apart.
  void trace_base() {
    const int n = elevations();
    // The base samples, [columns][elevations], come first; refine() appends middles and links them by `next`.
    s_.samples.resize(static_cast<std::size_t>(last_ - first_) * static_cast<std::size_t>(n));
    for (int e = 0; e < n; ++e) {
      const Elevation elevation = base_[static_cast<std::size_t>(e)];
      if (e < plan_.fan.side_elevations || e >= n - plan_.fan.side_elevations) {
        trace_side(e, elevation);
        continue;
      }
      if (last_ - first_ <= RayPacket::size / 2) {
        trace_few(e);
        e = n - plan_.fan.side_elevations - 1;
        continue;
      }
      for (int from = first_; from < last_; from += RayPacket::size) {
        const int to = std::min(from + RayPacket::size, last_);
        filler_.clear();
        for (int k = from; k < to; ++k) filler_.add(column(k - first_), elevation);
        filler_.trace(scene_);
        for (int k = from; k < to; ++k) store_base(k - from, k - first_, e);
      }
    }
  }

  /// Traces a few columns at all elevations from `e` on, with several elevations per packet.
  void trace_few(int e) {
    const int n = elevations(), end = n - plan_.fan.side_elevations, columns = last_ - first_;
    for (const int rows = RayPacket::size / columns; e < end; e += rows) {
      const int to = std::min(e + rows, end);
      filler_.clear();
      for (int row = e; row < to; ++row)
        for (int k = 0; k < columns; ++k) filler_.add(column(k), base_[static_cast<std::size_t>(row)]);
      filler_.trace(scene_);
      for (int row = e; row < to; ++row)
        for (int k = 0; k < columns; ++k) store_base((row - e) * columns + k, k, row);
    }
  }
  void store_base(int lane, int k, int e) {
    const int n = elevations();
    const std::int32_t index = k * n + e;
    store(lane, base_[static_cast<std::size_t>(e)], column(k), at(index));
    at(index).next = e + 1 < n ? index + 1 : -1;
    at(index).edge_above = false;
  }

  /// Traces the side lobes. A few columns, possibly of several groups, share a ray. All of them get its result.
  void trace_side(int e, Elevation elevation) {
    const int n = elevations(), step = PingPlan::side_columns;
    for (int from = first_; from < last_;) {
      filler_.clear();
      ColumnSine sines[RayPacket::size];
      int lanes = 0, to = from;
      for (; lanes < RayPacket::size && to < last_; ++lanes, to += step - to % step) {
        const double u = plan_.columns.sine(plan_.side_column(to));
        sines[lanes] = {static_cast<float>(u), static_cast<float>(std::sqrt(std::max(0.0, 1 - u * u)))};
        filler_.add(sines[lanes], elevation);
      }
      filler_.trace(scene_);
      // A ray counts once, in the group of its first column.
      if (from % step != 0) --filler_.traced;
      for (int k = from; k < std::min(to, last_); ++k) {
        const int lane = k / step - from / step;
        const std::int32_t index = (k - first_) * n + e;
        store(lane, elevation, sines[lane], at(index));
        at(index).next = e + 1 < n ? index + 1 : -1;
        at(index).edge_above = false;
      }
      from = to;
    }
  }

  void refine() {
    FanRefinement<Sample> refinement(s_.samples, s_.open, s_.halves, tolerance_m_, first_);
    // Goes elevation by elevation over all columns. So packets of middles have neighbouring directions, too.
    const int n = elevations();
    for (int e = 0; e + 1 < n; ++e)
      for (int k = 0; k < last_ - first_; ++k) {
        const std::int32_t below = k * n + e;
        if (plan_.fan.is_side(e))
          at(below).edge_above = at(below).surface.object != at(below + 1).surface.object;
        else
          refinement.consider_base(below, below + 1, k);
      }
    // If the rays of neighbouring columns end farther apart than this [m], they share too few triangles to be traced as one
    // bundle.
    constexpr double bundled_m = 0.06;
    const bool bundled = plan_.columns.spacing * static_cast<double>(filler_.far_m()) < bundled_m;
    std::array<Elevation, RayPacket::size> middle;
    const auto trace = [&](std::span<const FanInterval> intervals) {
      // FanRefinement expects the samples of the middles after all others, in the order of the intervals.
      filler_.clear();
      for (std::size_t i = 0; i < intervals.size(); ++i) {
        middle[i] = elevation_at(refinement.middle_rad(intervals[i]));
        filler_.add(column(intervals[i].column), middle[i]);
      }
      filler_.trace(scene_, bundled);
      for (std::size_t i = 0; i < intervals.size(); ++i)
        store(static_cast<int>(i), middle[i], column(intervals[i].column), s_.samples.emplace_back());
    };
    refinement.run(trace);
  }

  /// Slope of the map from this column to the next, along the plane n . p = o of the facet that was hit. There 1 / x = (n_x +
  /// n_y u / (s cos psi) + n_z tan psi) / o, s^2 = 1 - u^2. For flat beams 1 / h = (n_x s + n_y u + n_z tan psi) / o.
  float per_column(const Sample& a, ColumnSine column) const {
    const SurfaceHit& hit = a.surface;
    if (hit.object == RayPacket::miss || hit.offset == 0) return 0;
    const float to_port = hit.normal.x * port_[0] + hit.normal.y * port_[1] + hit.normal.z * port_[2];
    const auto spacing = static_cast<float>(plan_.columns.spacing);
    if (plan_.switches.conical) return -spacing * to_port / (hit.offset * column.across * column.across * a.forward);
    const float forward = hit.normal.x * ahead_[0] + hit.normal.y * ahead_[1] + hit.normal.z * ahead_[2];
    return -spacing * (to_port - forward * column.along / column.across) / hit.offset;
  }

  /// Draws the map: linear between hits of one surface, and the farther value across edges.
  void draw(DepthMap& seen) {
    const Fan& fan = plan_.fan;
    const int n = elevations();
    seen.has_upper_marks = has_upper_marks(scene_.scene().objects.size());
    for (int k = 0; k < last_ - first_; ++k) {
      float *map = seen.column(first_ + k), *slope = seen.per_column.data() + seen.at(first_ + k);
      int bin = 0;
      for (std::int32_t i = k * n; at(i).next >= 0; i = at(i).next) {
        const Sample &a = at(i), &b = at(at(i).next);
        // Bins up to `end` lie between a and b; the last interval gets bins that rounding left over.
        const float top = bin_of_tangent(fan.axis, b.tangent);
        const int end = at(at(i).next).next < 0 ? fan.bins : std::min(static_cast<int>(top), fan.bins);
        // 1 / x is linear in tan psi along a plane (docs/acoustics.md, section 2). 0 is infinitely far, so the smaller value is
        // the farther surface.
        const float inverse_a = a.surface.inverse_x, inverse_b = b.surface.inverse_x, farther = std::min(inverse_a, inverse_b);
        const float per_tangent = (inverse_b - inverse_a) / (b.tangent - a.tangent);
        if (bin > end) continue;
        const Sample& of = inverse_b < inverse_a ? b : a;
        const std::int32_t mark = surface_mark(of.surface.object);
        const float aside = per_column(of, column(k));
        std::fill(slope + bin, slope + end + 1, seen.has_upper_marks ? with_upper_mark(aside, mark) : aside);
        if (a.edge_above) {
          std::fill(map + bin, map + end + 1, with_mark(farther, mark));
        } else {
          const float* __restrict tangent = fan.tangent.data();
          // Because of rounding, a bin may lie slightly outside [a, b]. 1 / x must not become negative there.
          for (int place = bin; place <= end; ++place)
            map[place] = with_mark(std::max(0.0f, inverse_a + per_tangent * (tangent[place] - a.tangent)), mark);
        }
        bin = end + 1;
      }
    }
  }

  const RayScene& scene_;
  const PingPlan& plan_;
  PacketFiller filler_;
  int first_, last_;
  FanScratch& s_;
  float tolerance_m_ = 0, ahead_[3], port_[3];  // ahead_, port_: x and y axes of the sonar in the world
  std::vector<ColumnSine> columns_;
  std::vector<Elevation> base_;
};

/// The hit of a ray of the fixed fan; its object is RayPacket::miss if the ray does not scatter.
FanHit hit_of(const RayPacket& p, std::size_t i, int column, int ray, float elevation_rad) {
  FanHit hit{column, ray, p.far[i], elevation_rad, 0, p.object[i], p.triangle[i]};
  // Cosine of incidence on the facet, the same from both sides: |n . d| / |n|.
  const Vec3 normal{p.normal_x[i], p.normal_y[i], p.normal_z[i]};
  const Vec3 along{p.direction_x[i], p.direction_y[i], p.direction_z[i]};
  const float size = length(normal);
  // Triangles without an area have no normal.
  if (size > 0)
    hit.cosine = std::abs(dot(normal, along)) / size;
  else
    hit.object = RayPacket::miss;
  return hit;
}

}  // namespace

std::size_t trace_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last,
                      FanScratch& scratch, DepthMap& seen) {
  return FanTracer(scene, plan, scalars, first, last, scratch).run(seen);
}

void trace_fixed_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last,
                     std::vector<FanHit>& hits) {
  PacketFiller filler(plan, scalars, static_cast<float>(scalars.max_range_m));
  // Every ray is a scatterer, as in Choi 2025 (docs/acoustics.md, section 8). Elevations are uniform and the same in every
  // column.
  const int rays = plan.fixed_fan;
  const std::vector<ColumnSine> sines = column_sines(plan.columns, first, last);
  // A packet has the rays of a few neighbouring columns and elevations. They share more boxes and triangles than as many rays
  // of one column.
  for (int from = first; from < last; from += fixed_fan_columns) {
    const int columns = std::min(fixed_fan_columns, last - from), at_once = RayPacket::size / columns;
    const std::size_t begin = hits.size();
    hits.resize(begin + static_cast<std::size_t>(columns) * static_cast<std::size_t>(rays));  // in the order of columns
    for (int ray = 0; ray < rays; ray += at_once) {
      const int end = std::min(ray + at_once, rays);
      const auto for_each_lane = [&](auto&& act) {
        for (int i = ray, lane = 0; i < end; ++i)
          for (int k = from; k < from + columns; ++k) act(k, i, lane++);
      };
      const auto elevation = [&](int i) {
        const FixedFanRay& r = plan.fixed_fan_rays[static_cast<std::size_t>(i)];
        return Elevation{r.elevation_rad, r.cosine, r.sine};
      };
      filler.clear();
      for_each_lane([&](int k, int i, int) { filler.add(sines[static_cast<std::size_t>(k - first)], elevation(i)); });
      filler.trace(scene);
      for_each_lane([&](int k, int i, int lane) {
        const std::size_t to = begin + static_cast<std::size_t>((k - from) * rays + i);
        hits[to] = hit_of(filler.packet, static_cast<std::size_t>(lane), k, i, elevation(i).angle_rad);
        // No direction has |u| of 1 or more.
        if (!(sines[static_cast<std::size_t>(k - first)].across > 0)) hits[to].object = RayPacket::miss;
      });
    }
    const auto is_miss = [](const FanHit& hit) { return hit.object == RayPacket::miss; };
    hits.erase(std::remove_if(hits.begin() + static_cast<std::ptrdiff_t>(begin), hits.end(), is_miss), hits.end());
  }
}

}  // namespace sonar
