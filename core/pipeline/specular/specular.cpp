#include "core/pipeline/specular/specular.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/specular/specular_extent.hpp"

namespace sonar {
namespace {

constexpr double least_reflection = 0.01;
constexpr double least_factor = 0.01;   // least K_vis in eq. 7
constexpr double sight_slack_m = 5e-3;  // tolerance: distance of facets from the true surface, and overlap of touching objects
constexpr double bent_slack = 0.1;      // the same tolerance in radii of curvature
constexpr double most_bent_slack_m = 0.2;
constexpr std::size_t most_surfaces_of_a_mesh = 4;

/// Traces rays from the sonar to points of one object.
class Sight {
 public:
  Sight(const RayScene& scene, const PingScalars& s, std::uint32_t object, const Pose& object_in_world)
      : scene_(scene), s_(s), object_(object), object_in_world_(object_in_world) {}

  /// Bit i: point i of the surface is the first hit of a ray towards it. At most 16 points.
  std::uint32_t seen(const SpecularPoint& point, std::span<const std::array<double, 2>> places) const {
    // The distance of facets from the true surface grows with its curvature.
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

/// Determines whether all, a part or none of the surface is visible, from rays along the two principal directions and between
/// them.
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
  // 48 rays in all: along each principal direction, and over a 4 x 4 grid.
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
  // K_1 K_2 of eq. 7 and 19 over the whole extent. If cells are hidden, they are left out.
  const std::complex<double> whole = specular_factor(point, wavelength_m);
  if (point.outline.empty() && std::abs(whole) < least_factor) return 0;
  SpecularWindow window = make_window(point, wavelength_m);
  const Part part = glance(point, window, sight);
  if (part == Part::none) return 0;
  if (part == Part::all) return whole;
  hide(point, window, sight);
  return specular_factor(point, wavelength_m, window);
}

/// Largest angle of columns from straight ahead; it is larger if the sonar turns during the ping.
double widest_direction_rad(const PingPlan& plan) {
  // Bearings are measured at reception (29). A turning sonar receives echoes from farther aside, by at most this angle [rad].
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
  // Surfaces are stored by their set of reflecting materials, because this set depends on the frequency. So a ping does not
  // depend on earlier pings.
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
  // Feet outside this cone cannot be received in any column.
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
      // range). The strength is Rc r^2 / (2 r sqrt((1 + r / R1) (1 + r / R2))), times K_1 K_2 (visible_factor).
      const double bends = bending(point.range_m, point.curvature[0]) * bending(point.range_m, point.curvature[1]);
      const double strength = reflection * r * r / (2 * point.range_m * std::sqrt(std::abs(bends)));
      // point_echo() applies the phase of range r. (7) has the phase of the foot's range, and K has the rest.
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
