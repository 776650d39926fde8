#include "core/pipeline/specular/specular.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/pipeline/arithmetic/fresnel.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"

namespace sonar {
namespace {

using Complex = std::complex<double>;
constexpr double window_in_units = 5.7;  // four Fresnel radii; beyond it only edges contribute, and they contribute little
constexpr double window_in_radii = 0.5;
constexpr int strips_per_cell = 4;

/// One principal direction: the integral of exp(-i pi (q x)^2 / 2), scaled to 1 over all x. Beyond a focus the conjugate is
/// integrated, which gives i over all x.
struct Direction {
  double q = 1;
  bool focused = false;
  /// F(q x) / (1 - i), F = C + iS (conjugate F before a focus). K_i of docs/acoustics.md, eq. 19, is the difference of two such
  /// values.
  Complex upto(double x) const {
    const FresnelPair f = fresnel(q * x);
    return Complex(f.c, focused ? f.s : -f.s) / Complex(1, -1);
  }
  Complex part(double from, double to) const { return to > from ? upto(to) - upto(from) : Complex{}; }
};

Direction direction_of(const SpecularPoint& p, std::size_t k, double wavelength_m) {
  // q of eq. 19 [1/m]; 1 + r / R is negative beyond a focus.
  return {1 / fresnel_unit_m(wavelength_m, p.range_m, p.curvature[k]), bending(p.range_m, p.curvature[k]) < 0};
}

/// Finds pairs of positions at which the surface begins and ends along a line of constant y.
void crossings(const SpecularPoint& p, double y, std::vector<double>& x) {
  x.clear();
  if (p.outline.empty()) {
    x = {p.from[0], p.to[0]};
    return;
  }
  for (const OutlineEdge& e : p.outline)
    // Even-odd rule: sorted crossings form pairs, which are the intervals inside the outline.
    if ((e.y0 > y) != (e.y1 > y)) x.push_back(e.x0 + (y - e.y0) / (e.y1 - e.y0) * (e.x1 - e.x0));
  std::sort(x.begin(), x.end());
}

/// The integral along one strip without the hidden cells of its row.
Complex along_strip(const Direction& d, const std::vector<double>& x, const SpecularWindow& w, std::size_t row) {
  Complex sum;
  const bool some_hidden = w.hidden.any();
  for (std::size_t i = 0; i + 1 < x.size(); i += 2) {
    if (!some_hidden) {
      sum += d.part(x[i], x[i + 1]);
      continue;
    }
    for (std::size_t c = 0; c < SpecularWindow::cells; ++c) {
      if (w.hidden[row * SpecularWindow::cells + c]) continue;
      const double low = c == 0 ? x[i] : std::max(x[i], w.edge[0][c]);
      const double high = c + 1 == SpecularWindow::cells ? x[i + 1] : std::min(x[i + 1], w.edge[0][c + 1]);
      sum += d.part(low, high);
    }
  }
  return sum;
}

}  // namespace

SpecularWindow make_window(const SpecularPoint& p, double wavelength_m) {
  SpecularWindow w;
  for (std::size_t k = 0; k < 2; ++k) {
    // The window reaches four Fresnel radii to each side of the foot, or of the nearest point of the surface.
    double reach = window_in_units * fresnel_unit_m(wavelength_m, p.range_m, p.curvature[k]);
    // Eq. 19 assumes a parabola, which does not hold beyond half a radius of curvature [m].
    if (p.curvature[k] != 0) reach = std::min(reach, window_in_radii / std::abs(p.curvature[k]));
    const double middle = std::clamp(0.0, p.from[k], p.to[k]);
    const double from = std::max(p.from[k], middle - reach), to = std::min(p.to[k], middle + reach);
    for (std::size_t c = 0; c <= SpecularWindow::cells; ++c)
      w.edge[k][c] = from + (to - from) * static_cast<double>(c) / SpecularWindow::cells;
  }
  return w;
}

Complex specular_factor(const SpecularPoint& p, double wavelength_m) {
  if (!p.outline.empty()) return specular_factor(p, wavelength_m, make_window(p, wavelength_m));
  return direction_of(p, 0, wavelength_m).part(p.from[0], p.to[0]) * direction_of(p, 1, wavelength_m).part(p.from[1], p.to[1]);
}

Complex specular_factor(const SpecularPoint& p, double wavelength_m, const SpecularWindow& w) {
  const Direction across = direction_of(p, 0, wavelength_m), up = direction_of(p, 1, wavelength_m);
  std::vector<double> x;
  Complex sum;
  // K_1 K_2 as a sum over strips. Each term is the integral over y of one strip times the integral over its intervals in x.
  const auto strip = [&](double from, double to, std::size_t row) {
    if (!(to > from)) return;
    // An infinite strip has no middle, so the extent of the surface in x at the foot (y = 0) is used.
    const double middle = std::isinf(from) || std::isinf(to) ? 0 : 0.5 * (from + to);
    crossings(p, middle, x);
    sum += up.part(from, to) * along_strip(across, x, w, row);
  };
  const auto& edge = w.edge[1];
  // Adds the part below the window, the rows of cells of the window in four strips each, and the part above the window.
  strip(p.from[1], edge.front(), 0);
  for (std::size_t row = 0; row < SpecularWindow::cells; ++row)
    for (int s = 0; s < strips_per_cell; ++s) {
      const double step = (edge[row + 1] - edge[row]) / strips_per_cell;
      strip(edge[row] + s * step, edge[row] + (s + 1) * step, row);
    }
  strip(edge.back(), p.to[1], SpecularWindow::cells - 1);
  return sum;
}

bool on_surface(const SpecularPoint& p, double x, double y) {
  if (p.outline.empty()) return x >= p.from[0] && x <= p.to[0] && y >= p.from[1] && y <= p.to[1];
  std::vector<double> edges;
  crossings(p, y, edges);
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2)
    if (x >= edges[i] && x <= edges[i + 1]) return true;
  return false;
}

std::array<double, 2> nearest_on_surface(const SpecularPoint& p) {
  if (p.outline.empty()) return {std::clamp(0.0, p.from[0], p.to[0]), std::clamp(0.0, p.from[1], p.to[1])};
  if (on_surface(p, 0, 0)) return {0, 0};
  std::array<double, 2> best{};
  double nearest = HUGE_VAL;
  for (const OutlineEdge& e : p.outline) {
    const double dx = e.x1 - e.x0, dy = e.y1 - e.y0;
    // Foot of the perpendicular on an edge.
    // 1e-30 m^2: an edge without length is treated as a point.
    const double t = std::clamp(-(e.x0 * dx + e.y0 * dy) / std::max(dx * dx + dy * dy, 1e-30), 0.0, 1.0);
    const std::array<double, 2> at{e.x0 + t * dx, e.y0 + t * dy};
    if (const double l = std::hypot(at[0], at[1]); l < nearest) nearest = l, best = at;
  }
  return best;
}

namespace {

constexpr double least_reflection = 0.01;
constexpr double least_factor = 0.01;   // least K_vis in eq. 7
constexpr double sight_slack_m = 5e-3;  // tolerance: distance of facets from the true surface, and overlap of touching objects
constexpr double bent_slack = 0.1;      // tolerance added for curved surfaces, in radii of curvature
constexpr double most_bent_slack_m = 0.2;
constexpr std::size_t most_surfaces_of_a_mesh = 4;

/// Traces rays from the sonar to points of one object.
class Sight {
 public:
  Sight(const RayScene& scene, const PingScalars& s, std::uint32_t object, const Pose& object_in_world)
      : scene_(scene), s_(s), object_(object), object_in_world_(object_in_world) {}

  /// Returns a mask. Bit i is set if point i of the surface is the first hit of a ray towards it. At most 16 points.
  std::uint32_t seen(const SpecularPoint& point, std::span<const std::array<double, 2>> places) const {
    // The distance of facets from the true surface grows with its radius of curvature.
    double slack = sight_slack_m;
    const double sharpest = std::max(std::abs(point.curvature[0]), std::abs(point.curvature[1]));
    if (sharpest > 0) slack += std::min(bent_slack / sharpest, most_bent_slack_m);
    RayPacket rays{};
    float expected[RayPacket::size] = {};
    for (std::size_t i = 0; i < places.size(); ++i) {
      // A point is visible if the first hit of a ray to it belongs to this object at this range.
      const Vec3d there = transform(object_in_world_, point.place(places[i][0], places[i][1])) - s_.seen_from.position_m;
      const double r = length(there);
      const Vec3 d = to_float((1 / r) * there);
      rays.origin_x[i] = s_.position_in_scene.x, rays.origin_y[i] = s_.position_in_scene.y,
      rays.origin_z[i] = s_.position_in_scene.z;
      rays.direction_x[i] = d.x, rays.direction_y[i] = d.y, rays.direction_z[i] = d.z;
      expected[i] = static_cast<float>(r);
      rays.far[i] = static_cast<float>(r + slack);
    }
    scene_.trace(rays, (1u << places.size()) - 1, true);
    std::uint32_t seen = 0;
    for (std::size_t i = 0; i < places.size(); ++i)
      if (rays.object[i] == object_ && std::abs(rays.far[i] - expected[i]) < static_cast<float>(slack)) seen |= 1u << i;
    return seen;
  }

 private:
  const RayScene& scene_;
  const PingScalars& s_;
  std::uint32_t object_;
  Pose object_in_world_;
};

/// A point near a cell's middle, because a ray along an edge between two triangles can miss both.
double middle_of(const std::array<double, SpecularWindow::cells + 1>& edge, double cell) {
  const auto c = static_cast<std::size_t>(cell);
  const double part = cell - static_cast<double>(c) + 0.5137;
  return edge[c] + part * (edge[c + 1] - edge[c]);
}

/// Traces rays to points along the two principal directions and between them, to find whether all, a part or none of the surface
/// is visible.
enum class Part { none, some, all };
Part glance(const SpecularPoint& point, const SpecularWindow& w, const Sight& sight) {
  constexpr std::size_t n = SpecularWindow::cells;
  std::array<double, 2> middle{};
  for (std::size_t k = 0; k < 2; ++k) {
    const double from = w.edge[k].front(), size = w.edge[k].back() - from;
    const double part = std::clamp(size > 0 ? -from / size : 0.5, 0.02, 0.98);
    middle[k] = from + (part + 0.0037) * size;
  }
  int looked = 0, met = 0;
  std::array<std::array<double, 2>, n> places{};
  // At most 48 rays: to 16 points along each principal direction, and to a 4 x 4 grid.
  for (int pattern = 0; pattern < 3; ++pattern) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double quarter = static_cast<double>(n) / 4;
      std::array<double, 2> at{};
      if (pattern == 0) at = {middle_of(w.edge[0], static_cast<double>(i)), middle[1]};
      if (pattern == 1) at = {middle[0], middle_of(w.edge[1], static_cast<double>(i))};
      if (pattern == 2)
        at = {middle_of(w.edge[0], quarter * static_cast<double>(i % 4) + 1.5),
              middle_of(w.edge[1], quarter * static_cast<double>(i / 4) + 1.5)};
      if (on_surface(point, at[0], at[1])) places[count++] = at;
    }
    if (count == 0) continue;
    looked += static_cast<int>(count);
    met += std::popcount(sight.seen(point, std::span(places).first(count)));
  }
  return met == 0 ? Part::none : (met == looked ? Part::all : Part::some);
}

void hide(const SpecularPoint& point, SpecularWindow& w, const Sight& sight) {
  constexpr std::size_t n = SpecularWindow::cells;
  std::array<std::array<double, 2>, n> places{};
  std::array<std::size_t, n> cell{};
  for (std::size_t row = 0; row < n; ++row) {
    std::size_t count = 0;
    for (std::size_t c = 0; c < n; ++c) {
      const std::array<double, 2> at{middle_of(w.edge[0], static_cast<double>(c)),
                                     middle_of(w.edge[1], static_cast<double>(row))};
      // Cells outside the surface need no ray.
      if (!on_surface(point, at[0], at[1])) continue;
      cell[count] = row * n + c;
      places[count++] = at;
    }
    if (count == 0) continue;
    const std::uint32_t seen = sight.seen(point, std::span(places).first(count));
    for (std::size_t i = 0; i < count; ++i)
      if (!((seen >> i) & 1)) w.hidden.set(cell[i]);
  }
}

/// K_vis with its phase, for the visible part of the surface.
std::complex<double> visible_factor(const SpecularPoint& point, double wavelength_m, const Sight& sight) {
  // K_1 K_2 of eq. 7 and 19 over the whole extent
  const std::complex<double> whole = specular_factor(point, wavelength_m);
  if (point.outline.empty() && std::abs(whole) < least_factor) return 0;
  SpecularWindow window = make_window(point, wavelength_m);
  const Part part = glance(point, window, sight);
  if (part == Part::none) return 0;
  if (part == Part::all) return whole;
  hide(point, window, sight);
  return specular_factor(point, wavelength_m, window);
}

/// Largest angle of columns from straight ahead, with a margin for a sonar that turns during the ping.
double widest_direction_rad(const PingPlan& plan) {
  // Bearings are measured at reception (eq. 29). A turning sonar receives echoes from up to this angle [rad] farther aside.
  constexpr double while_turning_rad = 0.05;
  const double sine = std::min(1.0, plan.columns.first_sine + plan.columns.spacing);
  return std::acos(std::sqrt(1 - sine * sine) * std::cos(std::min(plan.widest_about_axis_rad(plan.fan.reach_rad), pi / 2))) +
         while_turning_rad;
}

}  // namespace

double coherent_reflection(const Material& m, double wavelength_m) {
  // Rc e^{-2 k^2 h^2} (docs/acoustics.md, eq. 18). From k h = 1.5 on, the surface is rough.
  const double kh = 2 * pi / wavelength_m * static_cast<double>(m.roughness_m);
  if (!(kh < smooth_below_kh)) return 0;
  const double left = static_cast<double>(m.reflection) * std::exp(-2 * kh * kh);
  return std::abs(left) < least_reflection ? 0 : left;
}

SpecularEchoes::PreparedMesh& SpecularEchoes::prepared(std::size_t object, const std::shared_ptr<const Mesh>& mesh) {
  if (object < mesh_of_.size() && mesh_of_[object] < meshes_.size() && meshes_[mesh_of_[object]].mesh == mesh)
    return meshes_[mesh_of_[object]];
  mesh_of_.resize(std::max(mesh_of_.size(), object + 1));
  const auto at = std::find_if(meshes_.begin(), meshes_.end(), [&](const PreparedMesh& m) { return m.mesh == mesh; });
  mesh_of_[object] = static_cast<std::size_t>(at - meshes_.begin());
  if (at != meshes_.end()) return *at;
  PreparedMesh made;
  made.mesh = mesh;
  made.materials = mesh->material;
  std::sort(made.materials.begin(), made.materials.end());
  made.materials.erase(std::unique(made.materials.begin(), made.materials.end()), made.materials.end());
  Vec3d low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const Vec3 v : mesh->vertices) {
    const Vec3d p = to_double(v);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  // A ball around the mesh. With it, objects out of range are skipped without a search.
  made.centre_m = 0.5 * (low + high);
  made.radius_m = 0.5 * length(high - low);
  return meshes_.emplace_back(std::move(made));
}

void SpecularEchoes::forget_unused() {
  std::erase_if(meshes_, [](const PreparedMesh& m) { return m.mesh.use_count() == 1; });
  mesh_of_.clear();
}

void SpecularEchoes::candidates(const Object& object, PreparedMesh& mesh, const SpecularQuery& query) {
  points_.clear();
  if (object.primitive.kind != Primitive::Kind::none) {
    find_specular_points(object.primitive, query, points_);
    for (SpecularPoint& p : points_) p.material = mesh.materials.front();
    return;
  }
  mirrors_.assign(reflection_.size(), false);
  for (const std::uint16_t m : mesh.materials) mirrors_[m] = reflection_[m] != 0;
  // The set of reflecting materials depends on the frequency. Each set has its own surfaces, so that a ping does not use the
  // surfaces of a ping at another frequency.
  auto at = std::find_if(mesh.surfaces.begin(), mesh.surfaces.end(),
                         [this](const PreparedMesh::Surface& s) { return s.mirrors == mirrors_; });
  if (at == mesh.surfaces.end()) {
    if (mesh.surfaces.size() >= most_surfaces_of_a_mesh) mesh.surfaces.erase(mesh.surfaces.begin());
    at = mesh.surfaces.insert(mesh.surfaces.end(), {mirrors_, std::make_unique<const SpecularMesh>(*mesh.mesh, mirrors_)});
  }
  at->mesh->find(query, points_);
}

void SpecularEchoes::find(const PingContext& context, std::vector<PointEcho>& echoes) {
  const Scene& scene = context.scene();
  const PingPlan& plan = context.plan;
  const PingScalars& s = context.scalars;
  SpecularQuery query;
  query.wavelength_m = s.sound_speed_mps / static_cast<double>(plan.mode.centre_hz);
  query.max_range_m = s.max_range_m;
  // Echoes of foot points outside this cone reach no column.
  query.widest_rad = widest_direction_rad(plan);
  reflection_.clear();
  for (const Material& m : scene.materials) reflection_.push_back(coherent_reflection(m, query.wavelength_m));
  if (std::all_of(reflection_.begin(), reflection_.end(), [](double c) { return c == 0; })) return;

  const Pose world_in_sonar = inverse(s.seen_from);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    if (!object.visible || object.mesh->triangles.empty()) continue;
    PreparedMesh& mesh = prepared(i, object.mesh);
    if (std::all_of(mesh.materials.begin(), mesh.materials.end(), [&](std::uint16_t m) { return reflection_[m] == 0; })) continue;
    const Pose in_world = scene.in_world(object, context.bodies_in_world);
    const Pose world_in_object = inverse(in_world);
    query.sonar_m = transform(world_in_object, s.seen_from.position_m);
    query.ahead = rotate(world_in_object.orientation, rotate(s.seen_from.orientation, Vec3d{1, 0, 0}));
    if (length(query.sonar_m - mesh.centre_m) - mesh.radius_m > query.max_range_m) continue;
    candidates(object, mesh, query);
    const Sight sight(context.rays, s, static_cast<std::uint32_t>(i), in_world);
    for (const SpecularPoint& point : points_) {
      const double reflection = reflection_[point.material];
      if (reflection == 0) continue;
      const std::array<double, 2> at = nearest_on_surface(point);
      const Vec3d from_sonar = transform(world_in_sonar, transform(in_world, point.place(at[0], at[1])));
      const double r = length(from_sonar);
      // docs/acoustics.md, eq. 7, without the factors of point_echo (source, absorption, patterns, 1 / r^2, phase of its own
      // range). The strength is Rc r^2 / (2 r0 sqrt(|(1 + r0 / R1) (1 + r0 / R2)|)), with r0 = point.range_m, times K_1 K_2.
      const double bends = bending(point.range_m, point.curvature[0]) * bending(point.range_m, point.curvature[1]);
      const double strength = reflection * r * r / (2 * point.range_m * std::sqrt(std::abs(bends)));
      // point_echo() applies the phase of range r. Eq. 7 has the phase of the foot's range, so the difference is removed.
      const double beside_turns = (r - point.range_m) * s.turns_per_m;
      std::optional<PointEcho> echo = point_echo(from_sonar, std::polar(1.0, 2 * pi * fraction_of_turn(beside_turns)), plan, s);
      if (!echo) continue;
      // Occlusion and the Fresnel integrals come last, because they take the most time.
      const std::complex<double> factor = visible_factor(point, query.wavelength_m, sight);
      if (std::abs(factor) < least_factor) continue;
      echo->amplitude *= strength * factor;
      echo->instance = static_cast<std::uint32_t>(i + 1);
      echoes.push_back(*echo);
    }
  }
}

}  // namespace sonar
