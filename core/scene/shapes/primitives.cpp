#include "core/scene/shapes/primitives.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/scene/shapes/terrain.hpp"

namespace sonar {
namespace {

using Index = std::uint32_t;
constexpr double sagitta_m = 1e-3;

Index add_vertex(Mesh& mesh, Vec3d p) {
  mesh.vertices.push_back(to_float(p));
  return static_cast<Index>(mesh.vertices.size() - 1);
}
void add_triangle(Mesh& mesh, Index a, Index b, Index c) {
  mesh.triangles.push_back({a, b, c});
  mesh.material.push_back(0);
}
void add_quad(Mesh& mesh, Index a, Index b, Index c, Index d) {  // counter-clockwise from outside
  add_triangle(mesh, a, b, c);
  add_triangle(mesh, a, c, d);
}

int patches(double length_m, double patch_m) {
  return static_cast<int>(std::clamp(std::ceil(length_m / patch_m), 1.0, double{most_patches}));
}

struct ProfilePoint {
  double radius, z;
};

// Revolves a profile, from bottom to top, about z. Ends with radius 0 become poles; other ends stay open.
Mesh revolve(const std::vector<ProfilePoint>& profile, int segments) {
  Mesh mesh;
  const auto n = static_cast<Index>(segments);
  std::vector<Index> first;  // vertex of each ring
  for (const ProfilePoint& p : profile) {
    first.push_back(static_cast<Index>(mesh.vertices.size()));
    const Index count = p.radius > 0 ? n : 1;
    for (Index i = 0; i < count; ++i) {
      const double a = 2 * pi * i / n;
      add_vertex(mesh, {p.radius * std::cos(a), p.radius * std::sin(a), p.z});
    }
  }
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    const bool pole_below = profile[k].radius <= 0, pole_above = profile[k + 1].radius <= 0;
    for (Index i = 0; i < n; ++i) {
      const Index j = (i + 1) % n, below = first[k], above = first[k + 1];
      if (pole_below) {
        add_triangle(mesh, below, above + j, above + i);
      } else if (pole_above) {
        add_triangle(mesh, below + i, below + j, above);
      } else {
        add_quad(mesh, below + i, below + j, above + j, above + i);
      }
    }
  }
  return mesh;
}

// Adds a straight part to a profile, divided so that facets are not needlessly long and thin.
void add_straight(std::vector<ProfilePoint>& profile, ProfilePoint to) {
  const ProfilePoint from = profile.back();
  const int n = patches(std::hypot(to.radius - from.radius, to.z - from.z), 0.5);
  for (int i = 1; i <= n; ++i) {
    const double t = static_cast<double>(i) / n;
    profile.push_back({from.radius + t * (to.radius - from.radius), from.z + t * (to.z - from.z)});
  }
}
// Adds the arc of a sphere of radius r about z0 between two latitudes [rad], without its first point.
void add_arc(std::vector<ProfilePoint>& profile, double r, double z0, double from, double to, int steps) {
  for (int i = 1; i <= steps; ++i) {
    const double a = from + (to - from) * i / steps;
    const bool pole = i == steps && to > pi / 2 - 1e-9;
    profile.push_back({pole ? 0 : r * std::cos(a), z0 + r * std::sin(a)});
  }
}

}  // namespace

int segments_for(double radius_m) {
  if (radius_m <= sagitta_m) return 16;
  const double half_angle = std::acos(1 - sagitta_m / radius_m);
  return static_cast<int>(std::clamp(std::ceil(pi / half_angle / 2) * 2, 16.0, 512.0));
}

Mesh make_plane(double length_x_m, double length_y_m, double patch_m) {
  Mesh mesh;
  const int nx = patches(length_x_m, patch_m), ny = patches(length_y_m, patch_m);
  for (int j = 0; j <= ny; ++j) {
    for (int i = 0; i <= nx; ++i) {
      add_vertex(mesh, {length_x_m * (static_cast<double>(i) / nx - 0.5), length_y_m * (static_cast<double>(j) / ny - 0.5), 0});
    }
  }
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const auto a = static_cast<Index>(j * (nx + 1) + i), up = static_cast<Index>(nx + 1);
      add_quad(mesh, a, a + 1, a + 1 + up, a + up);
    }
  }
  return mesh;
}

Mesh make_box(Vec3d size_m, double patch_m) {
  Mesh mesh;
  const std::array<double, 3> size{size_m.x, size_m.y, size_m.z};
  std::array<int, 3> n{};
  for (std::size_t k = 0; k < 3; ++k) n[k] = patches(size[k], patch_m);
  std::map<std::array<int, 3>, Index> known;  // edges and corners belong to several faces
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [place, is_new] = known.try_emplace(at, 0);
    if (is_new) {
      std::array<double, 3> p{};
      for (std::size_t k = 0; k < 3; ++k) p[k] = size[k] * (static_cast<double>(at[k]) / n[k] - 0.5);
      place->second = add_vertex(mesh, {p[0], p[1], p[2]});
    }
    return place->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const bool high : {false, true}) {
      for (int i = 0; i < n[u]; ++i) {
        for (int j = 0; j < n[v]; ++j) {
          const auto corner = [&](int du, int dv) {
            std::array<int, 3> at{};
            at[axis] = high ? n[axis] : 0;
            at[u] = i + du;
            at[v] = j + dv;
            return vertex(at);
          };
          if (high) {
            add_quad(mesh, corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
          } else {
            add_quad(mesh, corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0));
          }
        }
      }
    }
  }
  return mesh;
}

Mesh make_sphere(double radius_m, int segments) { return make_capsule(radius_m, 0, segments); }

Mesh make_capsule(double radius_m, double length_m, int segments) {
  const double half = length_m / 2;
  const int steps = std::max(segments / 4, 4);
  std::vector<ProfilePoint> profile{{0, -half - radius_m}};
  add_arc(profile, radius_m, -half, -pi / 2, 0, steps);
  if (length_m > 0) add_straight(profile, {radius_m, half});
  add_arc(profile, radius_m, half, 0, pi / 2, steps);
  return revolve(profile, segments);
}

Mesh make_cylinder(double radius_m, double length_m, int segments, Caps caps) {
  const double half = length_m / 2;
  std::vector<ProfilePoint> profile;
  if (caps == Caps::none) {
    profile.push_back({radius_m, -half});
  } else {
    profile.push_back({0, -half});
    add_straight(profile, {radius_m, -half});
  }
  add_straight(profile, {radius_m, half});
  if (caps == Caps::both) add_straight(profile, {0, half});
  return revolve(profile, segments);
}

Mesh make_cone(double base_radius_m, double top_radius_m, double length_m, int segments) {
  const double half = length_m / 2;
  std::vector<ProfilePoint> profile{{0, -half}};
  add_straight(profile, {base_radius_m, -half});
  add_straight(profile, {top_radius_m, half});
  if (top_radius_m > 0) add_straight(profile, {0, half});
  return revolve(profile, segments);
}

Mesh make_torus(double radius_m, double tube_radius_m, int segments) {
  Mesh mesh;
  const auto n = static_cast<Index>(segments), m = static_cast<Index>(segments_for(tube_radius_m));
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < m; ++j) {
      const double a = 2 * pi * i / n, b = 2 * pi * j / m, r = radius_m + tube_radius_m * std::cos(b);
      add_vertex(mesh, {r * std::cos(a), r * std::sin(a), tube_radius_m * std::sin(b)});
    }
  }
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < m; ++j) {
      const Index i1 = (i + 1) % n, j1 = (j + 1) % m;
      add_quad(mesh, i * m + j, i1 * m + j, i1 * m + j1, i * m + j1);
    }
  }
  return mesh;
}

Mesh make_rock(Vec3d semi_axes_m, double bumpiness, std::uint32_t seed, int segments) {
  Mesh mesh = make_sphere(1, segments);
  for (Vec3& v : mesh.vertices) {
    const Vec3d u = to_double(v);
    double bump = 0, weight = 1;
    for (std::uint32_t octave = 0; octave < 4; ++octave, weight *= 0.55) {
      const double f = 1.3 * std::pow(2.1, octave);
      bump += weight * value_noise({f * u.x, f * u.y, f * u.z}, seed, octave);
    }
    const double s = std::max(1 + bumpiness * bump, 0.2);
    v = to_float({s * semi_axes_m.x * u.x, s * semi_axes_m.y * u.y, s * semi_axes_m.z * u.z});
  }
  return mesh;
}

}  // namespace sonar
