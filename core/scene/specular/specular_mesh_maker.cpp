// Prepares a mesh for the search of mirror points: patches, outlines, normals, curvatures, and the tree for the search.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "core/scene/specular/specular_mesh_maker.hpp"

namespace sonar {
namespace {

constexpr double flat_rad = 0.003;    // facets of one plane may differ by this much, because coordinates are float
constexpr std::uint32_t in_leaf = 8;  // triangles
constexpr std::uint32_t no_owner = ~0u;

struct VertexHash {
  std::size_t operator()(const std::array<float, 3>& v) const {
    std::size_t h = 0;
    for (const float f : v) h = (h ^ std::hash<float>{}(f)) * 0x9E3779B97F4A7C15u;
    return h ^ (h >> 31);
  }
};

}  // namespace

SpecularMesh::SpecularMesh(const Mesh& mesh, const std::vector<bool>& wanted) { Maker(*this, mesh, wanted).make(); }

SpecularMesh::Maker::Maker(SpecularMesh& out, const Mesh& mesh, const std::vector<bool>& wanted) : out_(out) {
  std::unordered_map<std::array<float, 3>, std::uint32_t, VertexHash> known;
  // Vertices at one position become one vertex, so that facets that only touch become neighbours. + 0.0f turns -0 into 0.
  const auto weld = [&](std::uint32_t v) {
    const Vec3 p = mesh.vertices[v];
    const auto [at, is_new] = known.try_emplace({p.x + 0.0f, p.y + 0.0f, p.z + 0.0f}, static_cast<std::uint32_t>(place_.size()));
    if (is_new) place_.push_back(to_double(p));
    return at->second;
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint16_t material = mesh.material[t];
    if (material >= wanted.size() || !wanted[material]) continue;
    Facet f;
    for (std::size_t k = 0; k < 3; ++k) f.vertex[k] = weld(mesh.triangles[t][k]);
    f.material = material;
    const Vec3d n = cross(place_[f.vertex[1]] - place_[f.vertex[0]], place_[f.vertex[2]] - place_[f.vertex[0]]);
    f.area = 0.5 * length(n);
    f.normal = unit_vector(n);
    if (f.area > 0) facets_.push_back(f);
  }
}

void SpecularMesh::Maker::make() {
  join_edges();
  // Every facet belongs to one patch of smoothly joined facets. Flat patches become polygons, others curved surfaces.
  triangle_now_.resize(facets_.size(), -1);
  std::vector<std::uint32_t> patch;
  for (std::uint32_t f = 0; f < facets_.size(); ++f) {
    if (facets_[f].patch != no_owner) continue;
    grow(f, patch);
    if (is_flat(patch))
      add_face(patch);
    else
      add_curved(patch);
  }
  if (!out_.triangles_.empty()) plant();
}

// Facets that share an edge are neighbours. An edge with more than two facets joins none of them.
void SpecularMesh::Maker::join_edges() {
  struct Side {
    std::uint32_t a, b, facet, corner;
  };
  std::vector<Side> sides;
  for (std::uint32_t f = 0; f < facets_.size(); ++f)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t p = facets_[f].vertex[(k + 1) % 3], q = facets_[f].vertex[(k + 2) % 3];
      sides.push_back({std::min(p, q), std::max(p, q), f, k});
    }
  // After this sort, equal edges are neighbours.
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.a, x.b, x.facet, x.corner) < std::tie(y.a, y.b, y.facet, y.corner);
  });
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].a == sides[i].a && sides[end].b == sides[i].b) ++end;
    if (end == i + 2) {
      facets_[sides[i].facet].across[sides[i].corner] = static_cast<std::int32_t>(sides[i + 1].facet);
      facets_[sides[i + 1].facet].across[sides[i + 1].corner] = static_cast<std::int32_t>(sides[i].facet);
    }
    i = end;
  }
}

// True if the two facets have opposite directions along their shared edge. Facets with the same outer side have this property.
bool SpecularMesh::Maker::same_side(const Facet& a, std::size_t corner, const Facet& b) const {
  const std::uint32_t p = a.vertex[(corner + 1) % 3], q = a.vertex[(corner + 2) % 3];
  for (std::size_t k = 0; k < 3; ++k)
    if (b.vertex[k] == q && b.vertex[(k + 1) % 3] == p) return true;
  return false;
}

// Finds the smooth surface around a facet, and reverses facets with the wrong orientation.
void SpecularMesh::Maker::grow(std::uint32_t seed, std::vector<std::uint32_t>& patch) {
  patch.assign(1, seed);
  facets_[seed].patch = seed;
  for (std::size_t i = 0; i < patch.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Facet& f = facets_[patch[i]];
      if (f.across[k] < 0) continue;
      Facet& g = facets_[static_cast<std::size_t>(f.across[k])];
      if (g.patch != no_owner || g.material != f.material) continue;
      const bool same = same_side(f, k, g);
      // An edge is smooth if its facets meet at less than smooth_edge_rad.
      const double cosine = dot(f.normal, g.normal) * (same ? 1 : -1);
      if (cosine < std::cos(smooth_edge_rad)) continue;
      if (!same) {
        std::swap(g.vertex[1], g.vertex[2]);
        std::swap(g.across[1], g.across[2]);
        g.normal = -1.0 * g.normal;
      }
      g.patch = seed;
      patch.push_back(static_cast<std::uint32_t>(f.across[k]));
    }
  }
  std::sort(patch.begin(), patch.end());
}

bool SpecularMesh::Maker::is_flat(const std::vector<std::uint32_t>& patch) const {
  Vec3d mean;
  // Area-weighted mean normal. The patch is flat if all facets agree with this normal and lie in one plane.
  for (const std::uint32_t f : patch) mean = mean + facets_[f].area * facets_[f].normal;
  mean = unit_vector(mean);
  const Vec3d at = place_[facets_[patch.front()].vertex[0]];
  double size = 0, off = 0;
  for (const std::uint32_t f : patch) {
    if (dot(mean, facets_[f].normal) < std::cos(flat_rad)) return false;
    for (const std::uint32_t v : facets_[f].vertex) {
      size = std::max(size, length(place_[v] - at));
      off = std::max(off, std::abs(dot(mean, place_[v] - at)));
    }
  }
  return off < 1e-5 + 1e-5 * size;
}

void SpecularMesh::Maker::add_face(const std::vector<std::uint32_t>& patch) {
  Face face;
  struct Side {
    Vec3d p, q;
  };
  std::vector<Side> sides;
  double longest = 0;
  const std::uint32_t id = facets_[patch.front()].patch;
  for (const std::uint32_t index : patch) {
    const Facet& f = facets_[index];
    face.normal = face.normal + f.area * f.normal;
    for (std::size_t k = 0; k < 3; ++k) {
      // Edges inside the patch are not part of the outline.
      if (f.across[k] >= 0 && facets_[static_cast<std::size_t>(f.across[k])].patch == id) continue;
      const Side side{place_[f.vertex[(k + 1) % 3]], place_[f.vertex[(k + 2) % 3]]};
      sides.push_back(side);
      const double l = length(side.q - side.p);
      if (l > longest) longest = l, face.along[0] = side.q - side.p;
    }
  }
  if (sides.empty()) return;
  face.normal = unit_vector(face.normal);
  // Axes in the plane: along the longest edge, and perpendicular to it.
  face.along[0] = unit_vector(face.along[0] - dot(face.along[0], face.normal) * face.normal);
  face.along[1] = cross(face.normal, face.along[0]);
  face.origin = sides.front().p;
  face.material = facets_[patch.front()].material;
  face.from = {HUGE_VAL, HUGE_VAL}, face.to = {-HUGE_VAL, -HUGE_VAL};
  // The outline in those axes, and its bounds.
  for (const Side& s : sides) {
    const Vec3d p = s.p - face.origin, q = s.q - face.origin;
    face.outline.push_back({dot(p, face.along[0]), dot(p, face.along[1]), dot(q, face.along[0]), dot(q, face.along[1])});
    const OutlineEdge& e = face.outline.back();
    face.from = {std::min({face.from[0], e.x0, e.x1}), std::min({face.from[1], e.y0, e.y1})};
    face.to = {std::max({face.to[0], e.x0, e.x1}), std::max({face.to[1], e.y0, e.y1})};
  }
  out_.faces_.push_back(std::move(face));
}

void SpecularMesh::Maker::add_curved(const std::vector<std::uint32_t>& patch) {
  const auto first_vertex = static_cast<std::uint32_t>(out_.vertices_.size());
  const auto first_triangle = static_cast<std::int32_t>(out_.triangles_.size());
  vertex_now_.resize(place_.size(), no_owner);
  // Gives new numbers to the patch's triangles and, below, to its vertices.
  for (std::size_t i = 0; i < patch.size(); ++i) triangle_now_[patch[i]] = first_triangle + static_cast<std::int32_t>(i);
  for (const std::uint32_t f : patch) {
    SpecularMesh::Triangle triangle;
    triangle.material = facets_[f].material;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& v = vertex_now_[facets_[f].vertex[k]];
      if (v == no_owner || v < first_vertex) {  // the vertex belongs to another patch; every patch has its own normals
        v = static_cast<std::uint32_t>(out_.vertices_.size());
        out_.vertices_.push_back({to_float(place_[facets_[f].vertex[k]]), {}, {}});
      }
      triangle.vertex[k] = v;
      const std::int32_t beyond = facets_[f].across[k];
      const bool joined = beyond >= 0 && facets_[static_cast<std::size_t>(beyond)].patch == facets_[f].patch;
      triangle.across[k] = joined ? triangle_now_[static_cast<std::size_t>(beyond)] : -1;
    }
    out_.triangles_.push_back(triangle);
  }
  set_normals(first_vertex, static_cast<std::uint32_t>(first_triangle));
  set_bends(first_vertex, static_cast<std::uint32_t>(first_triangle));
}

// Computes the mean normal of the facets around a vertex. The weights are the angles of the facets at the vertex, so that the
// result does not depend on the diagonals of quads.
void SpecularMesh::Maker::set_normals(std::uint32_t first_vertex, std::uint32_t first_triangle) {
  // n_v = sum of angle_f n_f over the facets around the vertex.
  std::vector<Vec3d> sum(out_.vertices_.size() - first_vertex);
  for (std::size_t t = first_triangle; t < out_.triangles_.size(); ++t) {
    const auto& v = out_.triangles_[t].vertex;
    Vec3d p[3];
    for (std::size_t k = 0; k < 3; ++k) p[k] = to_double(out_.vertices_[v[k]].position);
    const Vec3d n = unit_vector(cross(p[1] - p[0], p[2] - p[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      const double cosine = dot(unit_vector(p[(k + 1) % 3] - p[k]), unit_vector(p[(k + 2) % 3] - p[k]));
      sum[v[k] - first_vertex] = sum[v[k] - first_vertex] + std::acos(std::clamp(cosine, -1.0, 1.0)) * n;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) out_.vertices_[first_vertex + i].normal = to_float(unit_vector(sum[i]));
}

// Computes the change of the normal over each triangle by least squares over its edges (Rusinkiewicz 2004), and the mean of
// these changes at the vertices, weighted by area.
void SpecularMesh::Maker::set_bends(std::uint32_t first_vertex, std::uint32_t first_triangle) {
  const std::size_t vertices = out_.vertices_.size() - first_vertex;
  std::vector<std::array<double, 6>> sum(vertices);
  std::vector<double> weight(vertices);
  for (std::size_t t = first_triangle; t < out_.triangles_.size(); ++t) {
    const auto& v = out_.triangles_[t].vertex;
    Vec3d p[3], n[3];
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = to_double(out_.vertices_[v[k]].position), n[k] = to_double(out_.vertices_[v[k]].normal);
    const Vec3d facing = cross(p[1] - p[0], p[2] - p[0]);
    const Vec3d e1 = unit_vector(p[1] - p[0]), e2 = unit_vector(cross(facing, e1));
    // Normal equations of II e = dn over the three edges, II = (a b; b c) in the axes e1, e2.
    double xx = 0, xy = 0, yy = 0, bx = 0, bm = 0, by = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d e = p[(k + 1) % 3] - p[k], d = n[(k + 1) % 3] - n[k];
      const double ex = dot(e, e1), ey = dot(e, e2), dx = dot(d, e1), dy = dot(d, e2);
      xx += ex * ex, xy += ex * ey, yy += ey * ey;
      bx += ex * dx, bm += ey * dx + ex * dy, by += ey * dy;
    }
    // [xx xy 0; xy xx+yy xy; 0 xy yy] (a b c) = (bx bm by)
    const double m = xx + yy, det = xx * (m * yy - xy * xy) - xy * xy * yy;
    if (!(std::abs(det) > 1e-300)) continue;
    const double a = (bx * (m * yy - xy * xy) - xy * (bm * yy - xy * by)) / det;
    const double b = (xx * (bm * yy - by * xy) - bx * xy * yy) / det;
    const double c = (xx * (m * by - bm * xy) - xy * (xy * by) + bx * xy * xy) / det;
    // II in object axes, as a symmetric 3 x 3 matrix.
    const auto entry = [&](double ui, double vi, double uj, double vj) {
      return a * ui * uj + b * (ui * vj + vi * uj) + c * vi * vj;
    };
    const std::array<double, 6> s{entry(e1.x, e2.x, e1.x, e2.x), entry(e1.x, e2.x, e1.y, e2.y), entry(e1.x, e2.x, e1.z, e2.z),
                                  entry(e1.y, e2.y, e1.y, e2.y), entry(e1.y, e2.y, e1.z, e2.z), entry(e1.z, e2.z, e1.z, e2.z)};
    const double area = length(facing);
    for (const std::uint32_t corner : v) {
      for (std::size_t i = 0; i < 6; ++i) sum[corner - first_vertex][i] += area * s[i];
      weight[corner - first_vertex] += area;
    }
  }
  for (std::size_t i = 0; i < vertices; ++i)
    for (std::size_t j = 0; j < 6; ++j)
      out_.vertices_[first_vertex + i].bend[j] = static_cast<float>(weight[i] > 0 ? sum[i][j] / weight[i] : 0);
}

void SpecularMesh::Maker::plant() {
  std::vector<std::uint32_t> order(out_.triangles_.size());
  std::iota(order.begin(), order.end(), 0u);
  for (const SpecularMesh::Triangle& t : out_.triangles_) {
    const auto corner = [&](std::size_t k) { return out_.vertices_[t.vertex[k]].position; };
    middle_.push_back(corner(0) + corner(1) + corner(2));
  }
  // Builds a tree over the triangles' centres; triangles get the order of its leaves.
  branch(order, 0, static_cast<std::uint32_t>(order.size()));
  std::vector<std::int32_t> now(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) now[order[i]] = static_cast<std::int32_t>(i);
  std::vector<SpecularMesh::Triangle> sorted;
  for (const std::uint32_t t : order) {
    sorted.push_back(out_.triangles_[t]);
    for (std::int32_t& beyond : sorted.back().across)
      if (beyond >= 0) beyond = now[static_cast<std::size_t>(beyond)];
  }
  out_.triangles_ = std::move(sorted);
}

void SpecularMesh::Maker::branch(std::vector<std::uint32_t>& order, std::uint32_t first, std::uint32_t last) {
  const std::size_t at = out_.nodes_.size();
  out_.nodes_.emplace_back();
  Vec3d low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, axis;
  const auto each = [&](auto&& visit) {
    for (std::uint32_t i = first; i < last; ++i)
      for (const std::uint32_t v : out_.triangles_[order[i]].vertex) visit(out_.vertices_[v]);
  };
  each([&](const SpecularMesh::Vertex& v) {
    const Vec3d p = to_double(v.position);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    axis = axis + to_double(v.normal);
  });
  const Vec3d centre = 0.5 * (low + high), size = high - low;
  // Ball around the points and cone around the normals. A node can contain a foot only if the direction to the sonar lies in
  // the cone.
  axis = unit_vector(axis);
  double cosine = length(axis) > 0.5 ? 1 : -1, radius = 0;
  each([&](const SpecularMesh::Vertex& v) {
    radius = std::max(radius, length(to_double(v.position) - centre));
    cosine = std::min(cosine, dot(axis, to_double(v.normal)));
  });
  Node node{to_float(centre),
            to_float(axis),
            static_cast<float>(radius * 1.0001 + 1e-6),
            static_cast<float>(std::acos(std::clamp(cosine, -1.0, 1.0)) + 1e-3),
            first,
            last - first,
            0};
  if (last - first > in_leaf) {
    const std::uint32_t middle = first + (last - first) / 2;
    const int k = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    const auto place = [&](std::uint32_t t) { return k == 0 ? middle_[t].x : k == 1 ? middle_[t].y : middle_[t].z; };
    // Splits at the median along the longest side. Equal values are sorted by index, so that the tree is always the same.
    std::nth_element(order.begin() + first, order.begin() + middle, order.begin() + last, [&](std::uint32_t a, std::uint32_t b) {
      const float pa = place(a), pb = place(b);
      return pa != pb ? pa < pb : a < b;
    });
    branch(order, first, middle);
    node.count = 0;
    node.second_child = static_cast<std::uint32_t>(out_.nodes_.size());
    branch(order, middle, last);
  }
  out_.nodes_[at] = node;
}

}  // namespace sonar
