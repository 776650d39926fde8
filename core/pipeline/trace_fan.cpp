#include "core/pipeline/trace_fan.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace sonar {
namespace {

constexpr int edge_depth = 4;  // edges are found to 1/16 of a base interval
constexpr int deepest = 6;     // a surface that still will not interpolate hides itself
// A surface strays from the straight line between two hits by about a quarter of what its slopes promise; beyond a pulse width of
// that a middle that happens to lie on the line proves nothing: the rays may fall in step with ripples.
constexpr float slope_tolerance_in_pulses = 4;

/// An elevation about the array axis, with what is derived from it once.
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
  for (int k = first; k < last; ++k) {
    const double u = columns.sine(k);
    sines.push_back({static_cast<float>(u), static_cast<float>(std::sqrt(std::max(0.0, 1 - u * u)))});
  }
  return sines;
}

/// Sixteen rays on their way: fills a packet lane by lane. Rays decide shadows only, so float directions do.
class PacketFiller {
 public:
  PacketFiller(const PingPlan& plan, const PingScalars& scalars, float far_m)
      : origin_(scalars.position_in_scene), far_m_(far_m), conical_(plan.switches.conical) {
    for (int i = 0; i < 9; ++i) m_[i] = static_cast<float>(scalars.world_from_sonar.m[i / 3][i % 3]);
  }

  void add(ColumnSine column, Elevation e) {
    const auto i = static_cast<std::size_t>(count_++);
    const float x = column.across * e.cosine, y = conical_ ? column.along : column.along * e.cosine;
    const float z = conical_ ? column.across * e.sine : e.sine;
    packet.direction_x[i] = m_[0] * x + m_[1] * y + m_[2] * z;
    packet.direction_y[i] = m_[3] * x + m_[4] * y + m_[5] * z;
    packet.direction_z[i] = m_[6] * x + m_[7] * y + m_[8] * z;
    packet.origin_x[i] = origin_.x;
    packet.origin_y[i] = origin_.y;
    packet.origin_z[i] = origin_.z;
    packet.far[i] = far_m_;
  }
  void trace(const RayScene& scene) {
    scene.trace(packet, count_ == RayPacket::size ? 0xFFFFu : (1u << count_) - 1u, true);
    traced += static_cast<std::size_t>(count_);
  }
  void clear() { count_ = 0; }

  RayPacket packet;
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
    tolerance_m_ = static_cast<float>(plan.pulse_width_m);
    columns_ = column_sines(plan.columns, first, last);
    for (const float angle : plan.fan.elevation_rad) base_.push_back(elevation_at(angle));
  }

  std::size_t run(DepthMap& seen) {
    trace_base();
    open_intervals();
    for (int depth = 1; depth <= deepest && !s_.open.empty(); ++depth) halve_intervals();
    draw(seen);
    return filler_.traced;
  }

 private:
  using Sample = FanScratch::Sample;
  using Interval = FanScratch::Interval;

  ColumnSine column(int k) const { return columns_[static_cast<std::size_t>(k)]; }
  Sample& at(std::int32_t i) { return s_.samples[static_cast<std::size_t>(i)]; }
  int elevations() const { return static_cast<int>(base_.size()); }

  /// Turns a lane of the packet into the sample it was traced for.
  void take(int lane, Elevation e, ColumnSine column, Sample& sample) const {
    const auto i = static_cast<std::size_t>(lane);
    const bool hit = filler_.packet.object[i] != RayPacket::miss;
    sample.elevation_rad = e.angle_rad;
    sample.forward = plan_.switches.conical ? column.across * e.cosine : e.cosine;
    sample.tangent = e.sine / e.cosine;
    sample.object = filler_.packet.object[i];
    sample.range_m = hit ? filler_.packet.far[i] : 0;
    sample.inverse_x = hit ? 1.0f / std::max(sample.range_m * sample.forward, 1e-4f) : 0;
    sample.normal = {filler_.packet.normal_x[i], filler_.packet.normal_y[i], filler_.packet.normal_z[i]};
    sample.offset = sample.range_m * dot(sample.normal, direction(lane));
  }

  Vec3 direction(int lane) const {
    const auto i = static_cast<std::size_t>(lane);
    return {filler_.packet.direction_x[i], filler_.packet.direction_y[i], filler_.packet.direction_z[i]};
  }

  /// Elevation by elevation, sixteen neighbouring columns a packet: neighbours in a packet lie a fraction of a degree apart.
  void trace_base() {
    const int n = elevations();
    s_.samples.resize(static_cast<std::size_t>(last_ - first_) * static_cast<std::size_t>(n));
    for (int e = 0; e < n; ++e) {
      const Elevation elevation = base_[static_cast<std::size_t>(e)];
      for (int from = first_; from < last_; from += RayPacket::size) {
        const int to = std::min(from + RayPacket::size, last_);
        filler_.clear();
        for (int k = from; k < to; ++k) filler_.add(column(k - first_), elevation);
        filler_.trace(scene_);
        for (int k = from; k < to; ++k) {
          const std::int32_t index = (k - first_) * n + e;
          take(k - from, elevation, column(k - first_), at(index));
          at(index).next = e + 1 < n ? index + 1 : -1;
          at(index).edge_above = false;
        }
      }
    }
  }

  /// Whether an interval needs a look at its middle; what is left undecided becomes an edge.
  void consider(std::int32_t below, std::int32_t above, std::int32_t column, int depth, std::vector<Interval>& list) {
    Sample &a = at(below), &b = at(above);
    if (a.object != b.object) {
      a.edge_above = true;
      if (depth < edge_depth) list.push_back({below, above, column, depth});
    } else if (a.object != RayPacket::miss && std::abs(a.range_m - b.range_m) > tolerance_m_) {
      if (depth < deepest)
        list.push_back({below, above, column, depth});
      else
        a.edge_above = true;
    }
  }

  void open_intervals() {
    s_.open.clear();
    const int n = elevations();
    for (int e = 0; e + 1 < n; ++e)
      for (int k = 0; k < last_ - first_; ++k) consider(k * n + e, k * n + e + 1, k, 0, s_.open);
  }

  void halve_intervals() {
    s_.halves.clear();
    std::array<Elevation, RayPacket::size> middle;
    for (std::size_t from = 0; from < s_.open.size(); from += RayPacket::size) {
      const std::size_t n = std::min<std::size_t>(RayPacket::size, s_.open.size() - from);
      filler_.clear();
      for (std::size_t i = 0; i < n; ++i) {
        const Interval& v = s_.open[from + i];
        middle[i] = elevation_at(0.5f * (at(v.below).elevation_rad + at(v.above).elevation_rad));
        filler_.add(column(v.column), middle[i]);
      }
      filler_.trace(scene_);
      for (std::size_t i = 0; i < n; ++i) insert(s_.open[from + i], middle[i], static_cast<int>(i));
    }
    std::swap(s_.open, s_.halves);
  }

  void insert(const Interval& v, Elevation elevation, int lane) {
    const auto middle = static_cast<std::int32_t>(s_.samples.size());
    s_.samples.emplace_back();
    take(lane, elevation, column(v.column), at(middle));
    at(middle).next = v.above;
    at(middle).edge_above = false;
    at(v.below).next = middle;
    at(v.below).edge_above = false;
    if (lies_between(at(v.below), at(middle), at(v.above)) && slopes_agree(at(v.below), at(v.above), at(middle), lane)) return;
    consider(v.below, middle, v.column, v.depth + 1, s_.halves);
    consider(middle, v.above, v.column, v.depth + 1, s_.halves);
  }

  /// On a plane 1 / x is linear in the tangent; a middle that agrees to a pulse width needs no further look.
  bool lies_between(const Sample& a, const Sample& m, const Sample& b) const {
    if (a.object != b.object || m.object != a.object) return false;
    const float part = (m.tangent - a.tangent) / (b.tangent - a.tangent);
    const float expected_x = 1.0f / (a.inverse_x + part * (b.inverse_x - a.inverse_x));
    return std::abs(expected_x / m.forward - m.range_m) <= tolerance_m_;
  }

  /// Whether the planes through the two ends meet the middle's ray about where it hit.
  bool slopes_agree(const Sample& a, const Sample& b, const Sample& middle, int lane) const {
    const Vec3 along = direction(lane);
    const float within = slope_tolerance_in_pulses * tolerance_m_;
    return std::abs(a.offset / dot(a.normal, along) - middle.range_m) <= within &&
           std::abs(b.offset / dot(b.normal, along) - middle.range_m) <= within;
  }

  /// Linear between hits of one surface, the farther value across edges.
  void draw(DepthMap& seen) {
    const Fan& fan = plan_.fan;
    const int n = elevations();
    seen.first_column = first_;
    seen.columns = last_ - first_;
    seen.bins = fan.bins;
    seen.inverse_x.resize(static_cast<std::size_t>(seen.columns) * static_cast<std::size_t>(fan.bins + 1));
    for (int k = 0; k < seen.columns; ++k) {
      float* map = seen.inverse_x.data() + static_cast<std::ptrdiff_t>(k) * (fan.bins + 1);
      int bin = 0;
      for (std::int32_t i = k * n; at(i).next >= 0; i = at(i).next) {
        const Sample &a = at(i), &b = at(at(i).next);
        const float top = (b.tangent - fan.first_tangent) * fan.bins_per_tangent;
        const int end = at(at(i).next).next < 0 ? fan.bins : std::min(static_cast<int>(top), fan.bins);
        const float farther = std::min(a.inverse_x, b.inverse_x);
        const float per_tangent = (b.inverse_x - a.inverse_x) / (b.tangent - a.tangent);
        for (; bin <= end; ++bin) {
          const float tangent = fan.first_tangent + static_cast<float>(bin) / fan.bins_per_tangent;
          map[bin] = a.edge_above ? farther : std::max(0.0f, a.inverse_x + per_tangent * (tangent - a.tangent));
        }
      }
    }
  }

  const RayScene& scene_;
  const PingPlan& plan_;
  PacketFiller filler_;
  int first_, last_;
  FanScratch& s_;
  float tolerance_m_ = 0;
  std::vector<ColumnSine> columns_;
  std::vector<Elevation> base_;
};

}  // namespace

std::size_t trace_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last,
                      FanScratch& scratch, DepthMap& seen) {
  return FanTracer(scene, plan, scalars, first, last, scratch).run(seen);
}

void trace_fixed_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last, int rays,
                     std::vector<FanHit>& hits) {
  PacketFiller filler(plan, scalars, static_cast<float>(scalars.max_range_m));
  const double step = 2 * plan.fan.half_angle_rad / rays;
  const std::vector<ColumnSine> sines = column_sines(plan.columns, first, last);
  for (int column = first; column < last; ++column) {
    const ColumnSine sine = sines[static_cast<std::size_t>(column - first)];
    if (!(sine.across > 0)) continue;
    for (int from = 0; from < rays; from += RayPacket::size) {
      const int to = std::min(from + RayPacket::size, rays);
      const auto elevation = [&](int ray) { return static_cast<float>((ray + 0.5) * step - plan.fan.half_angle_rad); };
      filler.clear();
      for (int ray = from; ray < to; ++ray) filler.add(sine, elevation_at(elevation(ray)));
      filler.trace(scene);
      for (int ray = from; ray < to; ++ray) {
        const auto i = static_cast<std::size_t>(ray - from);
        const RayPacket& p = filler.packet;
        if (p.object[i] == RayPacket::miss) continue;
        const Vec3 normal{p.normal_x[i], p.normal_y[i], p.normal_z[i]};
        const Vec3 along{p.direction_x[i], p.direction_y[i], p.direction_z[i]};
        const float size = length(normal);
        if (!(size > 0)) continue;
        hits.push_back({column, ray, p.far[i], elevation(ray), std::abs(dot(normal, along)) / size, p.object[i], p.triangle[i]});
      }
    }
  }
}

}  // namespace sonar
