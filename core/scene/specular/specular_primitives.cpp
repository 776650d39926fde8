#include "core/scene/specular/specular_mesh.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr int disc_edges = 96;
constexpr double nearest_m = 1e-3;  // a sonar that is nearer to the surface gets no echo from it

Vec3d axis(int k) { return {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0}; }
double component(Vec3d v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

bool is_audible(const SpecularPoint& p, const SpecularQuery& q) {
  if (p.range_m < nearest_m || p.range_m > q.max_range_m) return false;
  // If the foot is outside the surface, the echo comes from the edge, and falls with the distance in Fresnel units.
  double gap = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double beside = std::max({p.from[k], -p.to[k], 0.0});
    if (beside > farthest_edge_in_units * fresnel_unit_m(q.wavelength_m, p.range_m, p.curvature[k])) return false;
    gap = std::max(gap, beside);
  }
  return gap <= farthest_edge_in_ranges * p.range_m;
}

void keep(SpecularPoint p, const SpecularQuery& q, std::vector<SpecularPoint>& out) {
  if (is_audible(p, q)) out.push_back(std::move(p));
}

void sphere(const Primitive& shape, const SpecularQuery& q, std::vector<SpecularPoint>& out) {
  const double d = length(q.sonar_m);
  if (d <= shape.radius_m) return;
  SpecularPoint p;
  // The normal points from the centre to the sonar. Both principal radii are the radius of the sphere.
  p.normal = (1 / d) * q.sonar_m;
  p.foot_m = shape.radius_m * p.normal;
  p.along[0] = std::abs(p.normal.z) < 0.9 ? cross(p.normal, Vec3d{0, 0, 1}) : cross(p.normal, Vec3d{1, 0, 0});
  p.along[0] = (1 / length(p.along[0])) * p.along[0];
  p.along[1] = cross(p.normal, p.along[0]);
  p.curvature = {1 / shape.radius_m, 1 / shape.radius_m};
  p.range_m = d - shape.radius_m;
  keep(std::move(p), q, out);
}

/// A flat face across axis k at `place`, with half extents along the two axes after k. `side`: direction of its outer side.
struct Face {
  int k = 2;
  double place = 0, side = 1;
  double half_u = 0, half_v = 0;
};

/// Computes the face's mirror point, if the sonar is on its side `toward` (+1 or -1 along axis k).
SpecularPoint of_face(const Face& f, double toward, const SpecularQuery& q) {
  const int u = (f.k + 1) % 3, v = (f.k + 2) % 3;
  SpecularPoint p;
  p.normal = toward * axis(f.k);
  p.along = {axis(u), axis(v)};
  // The sonar's projection onto the face's plane, and the face's bounds relative to it.
  p.range_m = toward * (component(q.sonar_m, f.k) - f.place);
  p.foot_m = q.sonar_m - p.range_m * p.normal;
  const double at_u = component(q.sonar_m, u), at_v = component(q.sonar_m, v);
  p.from = {-f.half_u - at_u, -f.half_v - at_v};
  p.to = {f.half_u - at_u, f.half_v - at_v};
  return p;
}

void add_disc(SpecularPoint& p, double radius_m) {
  // A polygon with the area of the circle.
  const double r = radius_m * std::sqrt(2 * pi / disc_edges / std::sin(2 * pi / disc_edges));
  const double x = 0.5 * (p.from[0] + p.to[0]), y = 0.5 * (p.from[1] + p.to[1]);
  for (int i = 0; i < disc_edges; ++i) {
    const double a = 2 * pi * i / disc_edges, b = 2 * pi * (i + 1) / disc_edges;
    p.outline.push_back({x + r * std::cos(a), y + r * std::sin(a), x + r * std::cos(b), y + r * std::sin(b)});
  }
}

void box(const Primitive& shape, const SpecularQuery& q, std::vector<SpecularPoint>& out) {
  const double half[3] = {shape.size_m.x / 2, shape.size_m.y / 2, shape.size_m.z / 2};
  bool within = true;
  for (int k = 0; k < 3; ++k) within = within && std::abs(component(q.sonar_m, k)) < half[k];
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1.0, 1.0}) {
      if (shape.inside && k == 2 && side > 0) continue;  // open at the top
      const Face face{k, side * half[k], side, half[(k + 1) % 3], half[(k + 2) % 3]};
      // From outside, only the near faces are visible; from inside, all faces.
      const bool outside = side * component(q.sonar_m, k) > half[k];
      if (outside || within || shape.inside) keep(of_face(face, outside ? side : -side, q), q, out);
    }
}

void cylinder(const Primitive& shape, const SpecularQuery& q, std::vector<SpecularPoint>& out) {
  const double a = shape.radius_m, half = shape.size_m.z / 2;
  const double d = std::hypot(q.sonar_m.x, q.sonar_m.y);
  // The nearest wall on the radius through the sonar. R1 is the cylinder's radius, R2 is infinite.
  const Vec3d outward = d > 1e-12 ? Vec3d{q.sonar_m.x / d, q.sonar_m.y / d, 0} : Vec3d{1, 0, 0};
  const auto wall = [&](Vec3d at, Vec3d normal, double range_m, double curvature) {
    SpecularPoint p;
    p.normal = normal;
    p.foot_m = a * at + q.sonar_m.z * Vec3d{0, 0, 1};
    p.along = {cross(Vec3d{0, 0, 1}, normal), {0, 0, 1}};
    p.curvature = {curvature, 0};
    p.range_m = range_m;
    // A concave wall is a mirror over half of its circle. A convex wall ends only where it curves away.
    p.from = {curvature < 0 ? -pi * a / 2 : -infinite, -half - q.sonar_m.z};
    p.to = {curvature < 0 ? pi * a / 2 : infinite, half - q.sonar_m.z};
    keep(std::move(p), q, out);
  };
  const bool within = d < a && std::abs(q.sonar_m.z) < half;
  if (d > a) {
    wall(outward, outward, d - a, 1 / a);
  } else if (within || shape.inside) {
    // Seen from inside there are two mirror points: on the near wall and on the wall across the axis. Both walls are concave.
    wall(outward, -1.0 * outward, a - d, -1 / a);
    wall(-1.0 * outward, outward, a + d, -1 / a);
  }
  for (const double side : {-1.0, 1.0}) {
    if (shape.inside && side > 0) continue;
    const Face face{2, side * half, side, a, a};
    const bool outside = side * q.sonar_m.z > half;
    if (!outside && !within && !shape.inside) continue;
    SpecularPoint p = of_face(face, outside ? side : -side, q);
    if (!is_audible(p, q)) continue;
    add_disc(p, a);
    out.push_back(std::move(p));
  }
}

}  // namespace

double bending(double range_m, double curvature_per_m) {
  constexpr double least = 0.05;
  // 1 + r / R of eq. 7. It must not be 0, which it would be at a focus.
  const double f = 1 + range_m * curvature_per_m;
  return f >= 0 ? std::max(f, least) : std::min(f, -least);
}

double fresnel_unit_m(double wavelength_m, double range_m, double curvature_per_m) {
  return 0.5 * std::sqrt(wavelength_m * range_m / std::abs(bending(range_m, curvature_per_m)));
}

void find_specular_points(const Primitive& primitive, const SpecularQuery& query, std::vector<SpecularPoint>& out) {
  switch (primitive.kind) {
    case Primitive::Kind::none:
      return;
    case Primitive::Kind::sphere:
      return sphere(primitive, query, out);
    case Primitive::Kind::cylinder:
      return cylinder(primitive, query, out);
    case Primitive::Kind::box:
      return box(primitive, query, out);
    case Primitive::Kind::plane: {
      const Face face{2, 0, 1, primitive.size_m.x / 2, primitive.size_m.y / 2};
      return keep(of_face(face, query.sonar_m.z >= 0 ? 1.0 : -1.0, query), query, out);
    }
  }
}

}  // namespace sonar
