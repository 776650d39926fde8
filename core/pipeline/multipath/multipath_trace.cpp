#include "core/pipeline/multipath/multipath_trace.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/fan_refinement.hpp"

namespace sonar {
namespace {

constexpr double fan_edge_two_way = 0.01;  // the square of 0.1 in the one-way pattern
constexpr float lift_m = 1e-4f;            // distance from the mirror at which reflected rays start

/// Traces up to sixteen rays via mirrors.
class ChainTracer {
 public:
  ChainTracer(const RayScene& scene, const PingScalars& scalars, const FlatFaces& faces, const std::vector<FlatMirror>& mirrors)
      : scene_(scene), faces_(faces), mirrors_(mirrors), origin_(scalars.position_in_scene) {
    for (int i = 0; i < 9; ++i) turn_[i] = static_cast<float>(scalars.world_from_sonar.m[i / 3][i % 3]);
    mirror_of_face_.assign(faces.faces.size(), BounceMap::no_mirror);
    for (std::size_t m = 0; m < mirrors.size(); ++m) {
      mirror_of_face_[static_cast<std::size_t>(mirrors[m].face)] = static_cast<std::uint8_t>(m);
      normals_.push_back(to_float(scalars.world_from_sonar * mirrors[m].normal));
    }
  }

  void clear() { count_ = 0; }
  void add(Vec3 direction_in_sonar, float far_m) {
    const auto i = static_cast<std::size_t>(count_++);
    const Vec3 d = direction_in_sonar;
    packet.origin_x[i] = origin_.x, packet.origin_y[i] = origin_.y, packet.origin_z[i] = origin_.z;
    packet.direction_x[i] = turn_[0] * d.x + turn_[1] * d.y + turn_[2] * d.z;
    packet.direction_y[i] = turn_[3] * d.x + turn_[4] * d.y + turn_[5] * d.z;
    packet.direction_z[i] = turn_[6] * d.x + turn_[7] * d.y + turn_[8] * d.z;
    packet.far[i] = far_[i] = far_m;
    travelled[i] = 0;
  }
  int count() const { return count_; }
  std::uint32_t all() const { return count_ == RayPacket::size ? 0xFFFFu : (1u << count_) - 1u; }

  /// Follows the active rays to the next surface. `travelled` grows, or the ray's object becomes RayPacket::miss.
  void go(std::uint32_t active, bool coherent) {
    scene_.trace(packet, active, coherent);
    for (std::size_t i = 0; i < RayPacket::size; ++i) {
      if (!(active >> i & 1)) continue;
      ++traced;
      if (packet.object[i] != RayPacket::miss) travelled[i] += packet.far[i];
    }
  }

  /// Returns the mirror that a ray has just hit, or no_mirror, and reflects the ray.
  std::uint8_t bounce(std::size_t i) {
    if (packet.object[i] == RayPacket::miss) return BounceMap::no_mirror;
    const int face = faces_.face_of(packet.object[i], packet.triangle[i]);
    if (face < 0) return BounceMap::no_mirror;
    const std::uint8_t mirror = mirror_of_face_[static_cast<std::size_t>(face)];
    if (mirror == BounceMap::no_mirror) return mirror;
    const Vec3 n = normals_[mirror];
    const Vec3 d{packet.direction_x[i], packet.direction_y[i], packet.direction_z[i]};
    const float along = dot(n, d);
    // A rough mirror reflects only at grazing angles. Below least_reflectance the ray ends here.
    if (std::abs(mirrors_[mirror].reflectance(static_cast<double>(along))) <= least_reflectance) return BounceMap::no_mirror;
    // d' = d - 2 (d . n) n. The new ray starts slightly above the mirror, so that it does not hit the mirror again.
    const float lift = along > 0 ? -lift_m : lift_m;
    packet.origin_x[i] += packet.far[i] * d.x + lift * n.x;
    packet.origin_y[i] += packet.far[i] * d.y + lift * n.y;
    packet.origin_z[i] += packet.far[i] * d.z + lift * n.z;
    packet.direction_x[i] = d.x - 2 * along * n.x;
    packet.direction_y[i] = d.y - 2 * along * n.y;
    packet.direction_z[i] = d.z - 2 * along * n.z;
    // The limit applies to the length of the unfolded path, not to the length of one leg [m].
    packet.far[i] = far_[i] - travelled[i];
    return packet.far[i] > 0 ? mirror : BounceMap::no_mirror;
  }

  RayPacket packet{};
  float travelled[RayPacket::size] = {};
  std::size_t traced = 0;

 private:
  const RayScene& scene_;
  const FlatFaces& faces_;
  const std::vector<FlatMirror>& mirrors_;
  Vec3 origin_;
  float turn_[9], far_[RayPacket::size] = {};
  std::vector<std::uint8_t> mirror_of_face_;
  std::vector<Vec3> normals_;  // normals of the mirrors, in world axes
  int count_ = 0;
};

/// The sequence of surfaces that a ray in one direction hits.
struct Chain : FanSample {
  SurfaceHit surface[3];
  std::uint8_t mirror[2] = {BounceMap::no_mirror, BounceMap::no_mirror};

  int stages() const { return mirror[0] == BounceMap::no_mirror ? 1 : mirror[1] == BounceMap::no_mirror ? 2 : 3; }
  const SurfaceHit& surface_at(int stage) const { return surface[stage]; }
  bool same_mirrors(const Chain& b) const { return std::equal(mirror, mirror + 2, b.mirror); }
};

/// Traces columns [first, last), at most one packet wide. It refines samples where neighbours differ, and draws them into the
/// map.
class ColumnsTracer {
 public:
  ColumnsTracer(ChainTracer& rays, const PingPlan& plan, float far_m, int first, int last, BounceMap& map)
      : rays_(rays), plan_(plan), map_(map), far_m_(far_m), first_(first), last_(last) {}

  void run() {
    trace_base();
    refine();
    for (int k = 0; k < columns(); ++k) draw(k);
  }

 private:
  int columns() const { return last_ - first_; }
  std::int32_t elevations() const { return static_cast<std::int32_t>(map_.fan.elevation_rad.size()); }
  Chain& at(std::int32_t i) { return samples_[static_cast<std::size_t>(i)]; }

  void aim(float elevation_rad, int column, Chain& chain) {
    const double u = plan_.columns.sine(first_ + column);
    // A ray of column u at elevation psi (docs/acoustics.md, section 1).
    const auto along = static_cast<float>(u), across = static_cast<float>(std::sqrt(std::max(0.0, 1 - u * u)));
    const float cosine = std::cos(elevation_rad), sine = std::sin(elevation_rad);
    const bool conical = plan_.switches.conical;
    chain.elevation_rad = elevation_rad;
    chain.tangent = sine / cosine;
    chain.forward = conical ? across * cosine : cosine;
    rays_.add(ray_in_sonar(conical, along, across, cosine, sine), far_m_);
  }
  /// Follows the packet. Lane i belongs to the sample index[i].
  void follow(const std::array<std::int32_t, RayPacket::size>& index) {
    std::uint32_t active = rays_.all();
    // Up to two bounces: stage s is the surface that is hit after s mirrors.
    for (std::size_t stage = 0; stage < 3 && active; ++stage) {
      rays_.go(active, stage == 0);
      for (std::size_t i = 0; i < RayPacket::size; ++i) {
        if (!(active >> i & 1)) continue;
        Chain& chain = at(index[i]);
        chain.surface[stage] = SurfaceHit::by(rays_.packet, i, rays_.travelled[i], chain.forward);
        if (stage < 2) chain.mirror[stage] = rays_.bounce(i);
        if (stage == 2 || chain.mirror[stage] == BounceMap::no_mirror) active &= ~(1u << i);
      }
    }
  }

  void trace_base() {
    const std::int32_t n = elevations();
    samples_.assign(static_cast<std::size_t>(columns()) * static_cast<std::size_t>(n), {});
    // Lanes are columns, because neighbouring columns at one elevation mostly hit the same mirror.
    std::array<std::int32_t, RayPacket::size> index{};
    for (std::int32_t e = 0; e < n; ++e) {
      rays_.clear();
      for (int k = 0; k < columns(); ++k) {
        const std::int32_t i = index[static_cast<std::size_t>(k)] = k * n + e;
        aim(map_.fan.elevation_rad[static_cast<std::size_t>(e)], k, at(i));
        at(i).next = e + 1 < n ? i + 1 : -1;
      }
      follow(index);
    }
  }

  void refine() {
    // The tolerance, one pulse width [m], applies to the unfolded path.
    FanRefinement<Chain> refinement(samples_, open_, halves_, static_cast<float>(plan_.pulse_width_m), first_);
    for (std::int32_t e = 0; e + 1 < elevations(); ++e)
      for (int k = 0; k < columns(); ++k) refinement.consider_base(k * elevations() + e, k * elevations() + e + 1, k);
    const auto trace = [&](std::span<const FanInterval> intervals) {
      std::array<std::int32_t, RayPacket::size> index{};
      rays_.clear();
      for (std::size_t i = 0; i < intervals.size(); ++i) {
        index[i] = static_cast<std::int32_t>(samples_.size());
        const float middle = refinement.middle_rad(intervals[i]);
        aim(middle, intervals[i].column, samples_.emplace_back());
      }
      follow(index);
    };
    refinement.run(trace);
  }

  void draw(int k) {
    const BounceFan& fan = map_.fan;
    // Nodes are uniform in the tangent of elevation, between consecutive samples.
    int bin = 0;
    for (std::int32_t i = k * elevations(); at(i).next >= 0; i = at(i).next) {
      const Chain &a = at(i), &b = at(at(i).next);
      const float top = (b.tangent - fan.first_tangent) * fan.bins_per_tangent;
      const int end = b.next < 0 ? fan.bins : std::min(static_cast<int>(top), fan.bins);
      for (; bin <= end; ++bin) {
        const float tangent = fan.first_tangent + static_cast<float>(bin) / fan.bins_per_tangent;
        draw_node(a, b, std::clamp((tangent - a.tangent) / (b.tangent - a.tangent), 0.0f, 1.0f), first_ + k, bin);
      }
    }
  }
  /// Draws a node between two samples. The map is linear between hits of one sequence of surfaces. Across an edge, the map has
  /// the mirrors of the nearer sample, and after them the farther surface.
  void draw_node(const Chain& a, const Chain& b, float part, int column, int bin) {
    const std::size_t node =
        static_cast<std::size_t>(column) * static_cast<std::size_t>(map_.fan.bins + 1) + static_cast<std::size_t>(bin);
    const Chain& nearer = part < 0.5f ? a : b;
    // If the mirrors at a stage differ, the later stages are those of the nearer sample.
    bool same_mirrors = true;
    for (std::size_t stage = 0; stage < 3; ++stage) {
      float seen = nearer.surface[stage].inverse_x;
      if (same_mirrors)
        seen =
            a.edge_above
                ? std::min(a.surface[stage].inverse_x, b.surface[stage].inverse_x)
                : std::max(0.0f, a.surface[stage].inverse_x + part * (b.surface[stage].inverse_x - a.surface[stage].inverse_x));
      map_.nodes[node].inverse_x[stage] = seen;
      if (stage == 2) break;
      map_.nodes[node].mirror[stage] = nearer.mirror[stage];
      same_mirrors = same_mirrors && a.mirror[stage] == b.mirror[stage];
    }
  }

  ChainTracer& rays_;
  const PingPlan& plan_;
  BounceMap& map_;
  float far_m_;
  int first_, last_;
  std::vector<Chain> samples_;
  std::vector<FanInterval> open_, halves_;
};

/// Finds the part of a block of columns that belongs to each path.
void find_windows(std::size_t block, BounceMap& map) {
  auto& windows = map.windows[block];
  windows.fill({});
  windows[BounceMap::index_of(-1, -1)] = {0, map.fan.bins};  // the direct path has no mirror that limits it
  // The bounds over a block of columns allow whole tiles to be skipped (PathReach).
  const int row = map.fan.bins + 1, first = static_cast<int>(block) * BounceMap::block_columns;
  const auto number = [](std::uint8_t mirror) { return mirror == BounceMap::no_mirror ? -1 : static_cast<int>(mirror); };
  for (int k = first; k < std::min(first + BounceMap::block_columns, map.columns); ++k)
    for (int bin = 0; bin < row; ++bin) {
      const auto node = static_cast<std::size_t>(k) * static_cast<std::size_t>(row) + static_cast<std::size_t>(bin);
      const int a = number(map.nodes[node].mirror[0]), b = number(map.nodes[node].mirror[1]);
      if (a < 0) continue;
      for (const int second : {-1, b}) {
        PathWindow& w = windows[BounceMap::index_of(a, second)];
        w.first_bin = std::min(w.first_bin, bin), w.last_bin = std::max(w.last_bin, bin);
      }
    }
}

}  // namespace

BounceFan make_bounce_fan(const PingPlan& plan) {
  BounceFan fan;
  fan.half_angle_rad = plan.fan.half_angle_rad;
  if (plan.mode.pattern.elevation_taper != Taper::unit)
    fan.half_angle_rad = std::max(fan.half_angle_rad, std::min(elevation_reach_rad(plan.mode.pattern, fan_edge_two_way), 1.4));
  // The number of bins per tangent is that of the direct fan, but the angle is wider.
  const double tangent = std::tan(fan.half_angle_rad);
  fan.bins_per_tangent = plan.fan.axis.bins_per_tangent;
  fan.bins = static_cast<int>(std::ceil(2 * tangent * static_cast<double>(fan.bins_per_tangent)));
  fan.first_tangent = static_cast<float>(-tangent);
  // The density of elevations is that of the direct fan.
  const double step =
      2 * plan.fan.half_angle_rad / (static_cast<double>(plan.fan.elevation_rad.size()) - 2 * plan.fan.side_elevations);
  const int n = static_cast<int>(std::ceil(2 * fan.half_angle_rad / step)) + 1;
  for (int e = 0; e < n; ++e) {
    const double nudge = e == 0 || e == n - 1 ? 0 : 0.0137;  // moves rays off the edges between triangles, as in make_plan
    fan.elevation_rad.push_back(static_cast<float>(fan.half_angle_rad * (2 * (e + nudge) / (n - 1) - 1)));
  }
  return fan;
}

std::size_t trace_bounces(const PingContext& context, const FlatFaces& faces, const std::vector<FlatMirror>& mirrors,
                          BounceMap& map) {
  const PingPlan& plan = context.plan;
  map.fan = make_bounce_fan(plan);
  map.columns = plan.columns.count;
  const auto nodes = static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.fan.bins + 1);
  map.nodes.resize(nodes);
  const auto blocks = static_cast<std::size_t>((map.columns + BounceMap::block_columns - 1) / BounceMap::block_columns);
  map.windows.resize(blocks);
  // Each task traces one packet of columns and writes its own part of the map.
  std::vector<std::size_t> traced(blocks);
  context.pool.for_each(blocks, [&](std::size_t block, int) {
    ChainTracer rays(context.rays, context.scalars, faces, mirrors);
    const int first = static_cast<int>(block) * BounceMap::block_columns;
    const int last = std::min(first + BounceMap::block_columns, map.columns);
    ColumnsTracer(rays, plan, static_cast<float>(2 * context.scalars.max_range_m), first, last, map).run();
    find_windows(block, map);
    traced[block] = rays.traced;
  });
  return std::accumulate(traced.begin(), traced.end(), std::size_t{0});
}

bool BounceMap::owns_nothing(const Path& path) const {
  for (std::size_t block = 0; block < windows.size(); ++block)
    if (!window(block, path).empty()) return false;
  return true;
}

bool reaches(const RayScene& scene, const PingScalars& scalars, const FlatFaces& faces, const std::vector<FlatMirror>& mirrors,
             const Path& path, Vec3d place) {
  const Vec3d image = path.image_of(place);
  const double range = length(image);
  ChainTracer ray(scene, scalars, faces, mirrors);
  // The ray points to the image and is slightly shorter, so that the surface at the target point does not block it.
  ray.add(to_float((1 / range) * image), static_cast<float>(range * 0.9999));
  for (const int wanted : {path.first, path.second}) {
    ray.go(1u, false);
    if (wanted < 0) return ray.packet.object[0] == RayPacket::miss;
    if (ray.bounce(0) != static_cast<std::uint8_t>(wanted)) return false;
  }
  ray.go(1u, false);
  return ray.packet.object[0] == RayPacket::miss;
}

}  // namespace sonar
