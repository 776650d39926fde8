#include "core/scene/specular/specular_mesh.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

constexpr double bary_slack = 1e-6;     // tolerance: a point on an edge must not be lost between its two triangles
constexpr double edge_units = 4;        // distance beyond the edge of a curved surface that is searched, in Fresnel units
constexpr double twins_in_units = 0.5;  // mirror points nearer to each other than this count as one
constexpr double walk_units = 16;       // an edge beyond this does not change the echo
constexpr double trusted_units = 2;  // if the surface leaves its osculating arc farther out than this, the echo does not change

/// True if the foot lies within the outline.
bool within(const std::vector<OutlineEdge>& outline, Vec3d foot) {
  bool in = false;
  for (const OutlineEdge& e : outline)
    if ((e.y0 > foot.y) != (e.y1 > foot.y) && foot.x < e.x0 + (foot.y - e.y0) / (e.y1 - e.y0) * (e.x1 - e.x0)) in = !in;
  return in;
}

double to_outline(const std::vector<OutlineEdge>& outline, Vec3d foot) {
  double nearest = HUGE_VAL;
  for (const OutlineEdge& e : outline) {
    const double dx = e.x1 - e.x0, dy = e.y1 - e.y0;
    const double t = std::clamp(((foot.x - e.x0) * dx + (foot.y - e.y0) * dy) / std::max(dx * dx + dy * dy, 1e-30), 0.0, 1.0);
    nearest = std::min(nearest, std::hypot(e.x0 + t * dx - foot.x, e.y0 + t * dy - foot.y));
  }
  return nearest;
}

}  // namespace

/// Finds points of flat faces in closed form, and points of curved surfaces by a search in the tree of balls and normal cones.
void SpecularMesh::find(const SpecularQuery& query, std::vector<SpecularPoint>& out) const {
  find_on_faces(query, out);
  find_on_curves(query, out);
}

void SpecularMesh::find_on_faces(const SpecularQuery& q, std::vector<SpecularPoint>& out) const {
  for (const Face& face : faces_) {
    const Vec3d to_sonar = q.sonar_m - face.origin;
    const double height = dot(to_sonar, face.normal), range = std::abs(height);
    const double x = dot(to_sonar, face.along[0]), y = dot(to_sonar, face.along[1]);
    const double gap = std::max({face.from[0] - x, x - face.to[0], face.from[1] - y, y - face.to[1], 0.0});
    const double farthest =
        std::min(farthest_edge_in_units * fresnel_unit_m(q.wavelength_m, range, 0), farthest_edge_in_ranges * range);
    if (range < 1e-3 || range > q.max_range_m || gap > farthest) continue;
    if (!within(face.outline, {x, y, 0}) && to_outline(face.outline, {x, y, 0}) > farthest) continue;
    SpecularPoint p;
    p.normal = height > 0 ? face.normal : -1.0 * face.normal;
    p.along = face.along;
    p.range_m = range;
    p.foot_m = q.sonar_m - range * p.normal;
    p.from = {face.from[0] - x, face.from[1] - y};
    p.to = {face.to[0] - x, face.to[1] - y};
    p.material = face.material;
    for (const OutlineEdge& e : face.outline) p.outline.push_back({e.x0 - x, e.y0 - y, e.x1 - x, e.y1 - y});
    out.push_back(std::move(p));
  }
}

void SpecularMesh::find_on_curves(const SpecularQuery& q, std::vector<SpecularPoint>& out) const {
  if (nodes_.empty()) return;
  const std::size_t first = out.size();
  std::vector<std::uint32_t> to_visit{0};
  while (!to_visit.empty()) {
    const std::uint32_t at = to_visit.back();
    const Node& node = nodes_[at];
    to_visit.pop_back();
    const Vec3d to_sonar = q.sonar_m - to_double(node.centre);
    const double distance = length(to_sonar), radius = static_cast<double>(node.radius);
    if (distance - radius > q.max_range_m) continue;
    if (distance > radius) {
      const double off = std::acos(std::clamp(-dot(to_sonar, q.ahead) / distance, -1.0, 1.0));
      if (off - std::asin(radius / distance) > q.widest_rad) continue;
      // Directions to the sonar fill a cone around to_sonar. At the surface's edges they may lie slightly outside.
      const double beside = 2 * edge_units * fresnel_unit_m(q.wavelength_m, distance, 0) / distance;
      const double spread = std::asin(radius / distance) + static_cast<double>(node.angle_rad) + beside;
      const double between = std::acos(std::clamp(std::abs(dot(to_sonar, to_double(node.axis))) / distance, 0.0, 1.0));
      if (spread < pi / 2 && between > spread) continue;
    }
    if (node.second_child != 0) {
      to_visit.push_back(node.second_child);
      to_visit.push_back(at + 1);
      continue;
    }
    for (std::uint32_t t = node.first; t < node.first + node.count; ++t) solve(t, q, out);
  }
  // Two triangles may both have a point on their common edge. If their materials differ, each has half of the echo.
  for (std::size_t i = first; i < out.size(); ++i) {
    const double apart = twins_in_units * std::min(fresnel_unit_m(q.wavelength_m, out[i].range_m, out[i].curvature[0]),
                                                   fresnel_unit_m(q.wavelength_m, out[i].range_m, out[i].curvature[1]));
    const auto twin = [&](const SpecularPoint& other) {
      return other.material == out[i].material && length(other.foot_m - out[i].foot_m) < apart;
    };
    out.erase(std::remove_if(out.begin() + static_cast<std::ptrdiff_t>(i) + 1, out.end(), twin), out.end());
  }
}

// Finds, with Newton's method, the point p0 + a e1 + b e2 of the triangle from which the interpolated normal, t long, ends at the
// sonar.
std::optional<SpecularMesh::Foot> SpecularMesh::foot_on(const Triangle& triangle, Vec3d sonar_m) const {
  const Vertex &v0 = vertices_[triangle.vertex[0]], &v1 = vertices_[triangle.vertex[1]], &v2 = vertices_[triangle.vertex[2]];
  const Vec3d p0 = to_double(v0.position), e1 = to_double(v1.position) - p0, e2 = to_double(v2.position) - p0;
  const Vec3d n0 = to_double(v0.normal), d1 = to_double(v1.normal) - n0, d2 = to_double(v2.normal) - n0;
  double a = 1.0 / 3, b = 1.0 / 3;
  double t = dot(sonar_m - (p0 + a * e1 + b * e2), n0 + a * d1 + b * d2);
  const bool inner = triangle.across[0] >= 0 && triangle.across[1] >= 0 && triangle.across[2] >= 0;
  const double most_sides = inner ? 3 : 1e3;  // in triangle sides; outside an edge the foot may be far away
  for (int i = 0; i < 12; ++i) {
    const Vec3d m = n0 + a * d1 + b * d2;
    const Vec3d miss = sonar_m - (p0 + a * e1 + b * e2 + t * m);
    const Vec3d c1 = e1 + t * d1, c2 = e2 + t * d2, c12 = cross(c1, c2);
    const double det = dot(c12, m);
    if (!(std::abs(det) > 1e-12 * length(c1) * length(c2) * length(m))) return {};
    const double da = dot(cross(miss, c2), m) / det, db = dot(cross(c1, miss), m) / det, dt = dot(c12, miss) / det;
    a += da, b += db, t += dt;
    // The problem is nearly linear. Therefore a point far outside the triangle does not converge to one inside.
    if (!(std::abs(a - 0.5) < most_sides && std::abs(b - 0.5) < most_sides)) return {};
    if (std::abs(da) + std::abs(db) < 1e-9) {
      const Vec3d normal = n0 + a * d1 + b * d2;
      return Foot{{1 - a - b, a, b}, unit_vector(normal), t * length(normal)};
    }
  }
  return {};
}

// Computes principal directions and curvatures from the tensors at the vertices. `weight` sums to one; `side` is -1 on the back.
void SpecularMesh::bend_at(const Triangle& triangle, const std::array<double, 3>& weight, double side, SpecularPoint& p) const {
  double s[6] = {};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 6; ++i) s[i] += weight[k] * static_cast<double>(vertices_[triangle.vertex[k]].bend[i]);
  const auto bend = [&](Vec3d x, Vec3d y) {
    const Vec3d sy{s[0] * y.x + s[1] * y.y + s[2] * y.z, s[1] * y.x + s[3] * y.y + s[4] * y.z,
                   s[2] * y.x + s[4] * y.y + s[5] * y.z};
    return side * dot(x, sy);
  };
  const Vec3d u1 = unit_vector(cross(p.normal, std::abs(p.normal.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0}));
  const Vec3d u2 = cross(p.normal, u1);
  const double turn = 0.5 * std::atan2(2 * bend(u1, u2), bend(u1, u1) - bend(u2, u2));
  p.along[0] = std::cos(turn) * u1 + std::sin(turn) * u2;
  p.along[1] = cross(p.normal, p.along[0]);
  p.curvature = {bend(p.along[0], p.along[0]), bend(p.along[1], p.along[1])};
}

void SpecularMesh::solve(std::uint32_t index, const SpecularQuery& q, std::vector<SpecularPoint>& out) const {
  const Triangle& triangle = triangles_[index];
  const std::optional<Foot> foot = foot_on(triangle, q.sonar_m);
  if (!foot) return;
  // If the foot lies outside the triangle, it counts only if the surface ends there. The echo then comes from the edge.
  std::array<double, 3> held{};
  for (std::size_t k = 0; k < 3; ++k) {
    if (foot->weight[k] < -bary_slack && triangle.across[k] >= 0) return;
    held[k] = std::max(foot->weight[k], 0.0);
  }
  const double sum = held[0] + held[1] + held[2];
  const bool inside = sum <= 1 + bary_slack;
  const double side = foot->height_m > 0 ? 1 : -1;
  SpecularPoint p;
  p.range_m = std::abs(foot->height_m);
  if (p.range_m < 1e-3 || p.range_m > q.max_range_m) return;
  p.normal = side * foot->normal;
  p.foot_m = q.sonar_m - p.range_m * p.normal;
  p.material = triangle.material;
  // To second order, the curved surface lies above its facet by half of the height of the corners' planes above this point.
  double bulge = 0;
  Vec3d entry;
  for (std::size_t k = 0; k < 3; ++k) {
    held[k] /= sum;
    const Vertex& v = vertices_[triangle.vertex[k]];
    bulge += 0.5 * held[k] * dot(to_double(v.position) - p.foot_m, to_double(v.normal));
    entry = entry + held[k] * to_double(v.position);
  }
  const Vec3d beside = entry - p.foot_m;
  if (inside) {
    p.range_m -= side * bulge;
    p.foot_m = q.sonar_m - p.range_m * p.normal;
  }
  bend_at(triangle, held, side, p);
  for (std::size_t k = 0; k < 2; ++k) {
    const double unit_m = fresnel_unit_m(q.wavelength_m, p.range_m, p.curvature[k]);
    const double gap = inside ? 0 : dot(beside, p.along[k]);
    if (std::abs(gap) > edge_units * unit_m) return;
    p.from[k] = gap - walk(index, entry, -1.0 * p.along[k], p, k, unit_m);
    p.to[k] = gap + walk(index, entry, p.along[k], p, k, unit_m);
  }
  out.push_back(std::move(p));
}

// Extent of the surface from a point on a triangle in one direction: the distance to its edge, or infinite if the edge is too
// far to matter. Parts that deviate from the osculating arc by more than a quarter wavelength contribute nothing.
double SpecularMesh::walk(std::uint32_t index, Vec3d from, Vec3d direction, const SpecularPoint& point, std::size_t axis,
                          double unit_m) const {
  constexpr double unlimited = std::numeric_limits<double>::infinity();
  const Vec3d cut = cross(point.normal, direction);  // the walk stays in the plane of normal and direction
  const double quarter_of_wave = unit_m * unit_m * std::abs(bending(point.range_m, point.curvature[axis])) / point.range_m;
  double walked = 0, risen = 0;
  std::int32_t came_from = -1;
  for (int step = 0; step < 4096; ++step) {
    const Triangle& triangle = triangles_[index];
    Vec3d p[3], n[3];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = to_double(vertices_[triangle.vertex[k]].position);
      n[k] = to_double(vertices_[triangle.vertex[k]].normal);
    }
    const Vec3d facing = cross(p[1] - p[0], p[2] - p[0]);
    Vec3d along = unit_vector(cross(cut, facing));
    if (dot(along, direction) < 0) along = -1.0 * along;
    if (dot(along, direction) < 0.3) return unlimited;  // the surface turns away and is not visible
    const double area2 = dot(facing, facing);
    double leave = HUGE_VAL;
    std::size_t through = 3;
    double share[3], rate[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d side = p[(k + 2) % 3] - p[(k + 1) % 3];
      share[k] = dot(cross(side, from - p[(k + 1) % 3]), facing) / area2;
      rate[k] = dot(cross(side, along), facing) / area2;
      if (came_from >= 0 && triangle.across[k] == came_from) continue;
      if (rate[k] >= -1e-12 / std::sqrt(std::sqrt(area2))) continue;
      const double s = std::max(share[k], 0.0) / -rate[k];
      if (s < leave) leave = s, through = k;
    }
    if (through == 3) return unlimited;  // because of rounding, the walk does not leave a corner
    from = from + leave * along;
    walked += leave;
    Vec3d normal;
    for (std::size_t k = 0; k < 3; ++k) normal = normal + (share[k] + leave * rate[k]) * n[k];
    const double up = dot(normal, point.normal), over = dot(normal, direction) / (std::abs(up) > 1e-6 ? up : 1e-6);
    if (std::abs(over) > 1.5) return unlimited;
    risen += std::abs(over - std::tan(std::clamp(point.curvature[axis] * walked, -1.0, 1.0))) * leave;
    if (walked > walk_units * unit_m) return unlimited;
    if (triangle.across[through] < 0) return walked;
    if (risen > quarter_of_wave && walked > unit_m) return walked > trusted_units * unit_m ? unlimited : walked;
    came_from = static_cast<std::int32_t>(index);
    index = static_cast<std::uint32_t>(triangle.across[through]);
  }
  return unlimited;
}

}  // namespace sonar
