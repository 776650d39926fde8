// Makes a SpecularMesh. Only specular_mesh uses it.
#pragma once

#include <vector>

#include "core/scene/specular/specular_mesh.hpp"

namespace sonar {

class SpecularMesh::Maker {
 public:
  Maker(SpecularMesh& out, const Mesh& mesh, const std::vector<bool>& wanted);
  void make();

 private:
  struct Facet {
    std::array<std::uint32_t, 3> vertex{};           // into place_
    std::array<std::int32_t, 3> across{-1, -1, -1};  // facet across the edge opposite to each vertex
    Vec3d normal;
    double area = 0;
    std::uint16_t material = 0;
    std::uint32_t patch = ~0u;  // index of the patch's first facet
  };

  void join_edges();
  bool same_side(const Facet& a, std::size_t corner, const Facet& b) const;
  void grow(std::uint32_t seed, std::vector<std::uint32_t>& patch);
  bool is_flat(const std::vector<std::uint32_t>& patch) const;
  void add_face(const std::vector<std::uint32_t>& patch);
  void add_curved(const std::vector<std::uint32_t>& patch);
  void set_normals(std::uint32_t first_vertex, std::uint32_t first_triangle);
  void set_bends(std::uint32_t first_vertex, std::uint32_t first_triangle);
  void plant();
  void branch(std::vector<std::uint32_t>& order, std::uint32_t first, std::uint32_t last);

  SpecularMesh& out_;
  std::vector<Vec3d> place_;  // vertices; equal positions are one vertex
  std::vector<Facet> facets_;
  std::vector<std::uint32_t> vertex_now_;   // by index in place_: the last vertex that was made for this position
  std::vector<std::int32_t> triangle_now_;  // by index in facets_: the curved triangle that was made of the facet
  std::vector<Vec3> middle_;                // middles of the curved triangles, times three
};

}  // namespace sonar
