// The geometry of surface cells: triangles projected along the dominant axis of their normals, the half-open test that gives
// every lattice point exactly one owner, and the cubes of tiles.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "core/base/geometry.hpp"
#include "core/scene/scene.hpp"

namespace sonar::lattice {

/// A triangle in permuted coordinates: u, v span the lattice plane, w is along the dominant axis of the normal.
struct Facet {
  double u[3], v[3], w[3];
  double nu, nv, nw;  // unit normal
};

inline double component(Vec3 p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }
constexpr int u_axis(int axis) { return (axis + 1) % 3; }
constexpr int v_axis(int axis) { return (axis + 2) % 3; }

inline Vec3d normal_of(const Mesh& mesh, std::uint32_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const Vec3d a = to_double(mesh.vertices[t[0]]), b = to_double(mesh.vertices[t[1]]), c = to_double(mesh.vertices[t[2]]);
  const Vec3d n = cross(b - a, c - a);
  const double len = length(n);
  return len > 0 ? (1.0 / len) * n : Vec3d{};
}

inline int dominant_axis(Vec3d n) {
  const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  return z >= x && z >= y ? 2 : (y >= x ? 1 : 0);
}

inline Facet facet_of(const Mesh& mesh, std::uint32_t triangle, int axis) {
  Facet f{};
  for (int i = 0; i < 3; ++i) {
    const Vec3 p = mesh.vertices[mesh.triangles[triangle][static_cast<std::size_t>(i)]];
    f.u[i] = component(p, u_axis(axis));
    f.v[i] = component(p, v_axis(axis));
    f.w[i] = component(p, axis);
  }
  const Vec3d n = normal_of(mesh, triangle);
  const double xyz[3] = {n.x, n.y, n.z};
  f.nu = xyz[u_axis(axis)];
  f.nv = xyz[v_axis(axis)];
  f.nw = xyz[axis];
  return f;
}

/// Twice the signed area of (p, q, x). Both directions of an edge use the same operands in the same order. Two triangles that
/// share an edge therefore get exactly opposite values.
inline double edge(double pu, double pv, double qu, double qv, double xu, double xv) {
  const bool forward = pu < qu || (pu == qu && pv < qv);
  if (forward) return (qu - pu) * (xv - pv) - (qv - pv) * (xu - pu);
  return -((pu - qu) * (xv - qv) - (pv - qv) * (xu - qu));
}

/// True if the point belongs to the facet. A point on a shared edge belongs to exactly one of the two triangles (top-left rule).
inline bool owns(const Facet& f, double xu, double xv) {
  const double turn = f.nw > 0 ? 1.0 : -1.0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const double e = turn * edge(f.u[i], f.v[i], f.u[j], f.v[j], xu, xv);
    if (e < 0) return false;
    if (e == 0) {
      const double du = turn * (f.u[j] - f.u[i]), dv = turn * (f.v[j] - f.v[i]);
      if (!(dv < 0 || (dv == 0 && du > 0))) return false;
    }
  }
  return true;
}

/// Height of the facet's plane over a lattice point.
inline double height(const Facet& f, double xu, double xv) {
  return f.w[0] - (f.nu * (xu - f.u[0]) + f.nv * (xv - f.v[0])) / f.nw;
}

/// Bounds of a facet. They are computed once for all tests with cubes.
struct FacetBounds {
  double low[3], high[3];  // along u, v, w
  double u[3], v[3], du[3], dv[3], edge_reach[3];
  double u0, v0, w0, nu, nv, nw, normal_reach;
};

inline FacetBounds bounds_of(const Facet& f) {
  FacetBounds b{};
  const double* corner[3] = {f.u, f.v, f.w};
  for (int a = 0; a < 3; ++a) {
    const double* c = corner[a];
    const double least = c[0] < c[1] ? c[0] : c[1], most = c[0] > c[1] ? c[0] : c[1];
    b.low[a] = least < c[2] ? least : c[2];
    b.high[a] = most > c[2] ? most : c[2];
  }
  const double turn = f.nw > 0 ? 1.0 : -1.0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    b.u[i] = f.u[i], b.v[i] = f.v[i];
    b.du[i] = turn * (f.u[j] - f.u[i]), b.dv[i] = turn * (f.v[j] - f.v[i]);
    b.edge_reach[i] = std::abs(b.du[i]) + std::abs(b.dv[i]);
  }
  b.u0 = f.u[0], b.v0 = f.v[0], b.w0 = f.w[0];
  b.nu = f.nu, b.nv = f.nv, b.nw = f.nw;
  b.normal_reach = std::abs(f.nu) + std::abs(f.nv) + std::abs(f.nw);
  return b;
}

/// True if the facet may own points inside the cube. The result can be true for a facet that owns none, but is never false for
/// a facet that owns one.
inline bool may_touch(const FacetBounds& f, double cu, double cv, double cw, double half) {
  const double slack = half * 1e-6 + 1e-9;
  const double h = half + slack;
  const double centre[3] = {cu, cv, cw};
  for (int a = 0; a < 3; ++a)
    if (f.low[a] > centre[a] + h || f.high[a] < centre[a] - h) return false;
  const double off = f.nu * (cu - f.u0) + f.nv * (cv - f.v0) + f.nw * (cw - f.w0);
  if (std::abs(off) > h * f.normal_reach) return false;
  for (int i = 0; i < 3; ++i)
    if (f.du[i] * (cv - f.v[i]) - f.dv[i] * (cu - f.u[i]) + h * f.edge_reach[i] < 0) return false;
  return true;
}

/// Size of a cell, 2^-level, and the edge of a cube (and tile), 16 cells [m]. |level| must be below 1000.
inline double cell_size_m(int level) { return std::bit_cast<double>(static_cast<std::uint64_t>(1023 - level) << 52); }
inline double tile_edge_m(int level) { return 16 * cell_size_m(level); }

/// Converts permuted coordinates back to object coordinates.
inline Vec3d from_permuted(double u, double v, double w, int axis) {
  double xyz[3];
  xyz[u_axis(axis)] = u;
  xyz[v_axis(axis)] = v;
  xyz[axis] = w;
  return {xyz[0], xyz[1], xyz[2]};
}

}  // namespace sonar::lattice
