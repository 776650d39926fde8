// Finds mirror points of triangle meshes. The mesh is prepared once: facets that meet at small angles form patches. A plane
// patch becomes a face with an outline. Any other patch becomes a curved surface with normals and curvatures at its vertices.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/scene/specular/specular_point.hpp"

namespace sonar {

/// Facets that meet at a smaller angle than this count as parts of one smooth surface.
inline constexpr double smooth_edge_rad = 0.42;

class SpecularMesh {
 public:
  /// Prepares the triangles whose material is set in `wanted` (by index into Scene::materials).
  SpecularMesh(const Mesh& mesh, const std::vector<bool>& wanted);

  /// Appends the mirror points whose echoes may be strong enough. The caller tests whether they are hidden.
  void find(const SpecularQuery& query, std::vector<SpecularPoint>& out) const;

  std::size_t faces() const { return faces_.size(); }
  std::size_t curved_triangles() const { return triangles_.size(); }

 private:
  /// A face: facets in one plane.
  struct Face {
    Vec3d origin, normal;
    std::array<Vec3d, 2> along;
    std::array<double, 2> from{}, to{};  // bounds of the outline
    std::vector<OutlineEdge> outline;    // relative to the origin
    std::uint16_t material = 0;
  };
  struct Vertex {
    Vec3 position, normal;
    std::array<float, 6> bend{};  // symmetric: xx xy xz yy yz zz of d normal / d position [1/m]
  };
  struct Triangle {
    std::array<std::uint32_t, 3> vertex{};
    std::array<std::int32_t, 3> across{-1, -1, -1};  // the triangle across the edge opposite to each vertex; -1: the surface ends
    std::uint16_t material = 0;
  };
  /// A node of a tree over the curved triangles. It has a ball around its triangles and a cone around their normals.
  struct Node {
    Vec3 centre, axis;
    float radius = 0, angle_rad = 0;
    std::uint32_t first = 0, count = 0;  // triangles of a leaf
    std::uint32_t second_child = 0;      // the first child follows its parent; 0 in a leaf
  };
  /// The point of a triangle at which the interpolated normal passes through the sonar.
  struct Foot {
    std::array<double, 3> weight{};  // weights of the vertices; outside the triangle, at least one is negative
    Vec3d normal;                    // on the side of the mesh's normals
    double height_m = 0;             // height of the sonar along the normal
  };
  class Maker;

  void find_on_faces(const SpecularQuery& query, std::vector<SpecularPoint>& out) const;
  void find_on_curves(const SpecularQuery& query, std::vector<SpecularPoint>& out) const;
  std::optional<Foot> foot_on(const Triangle& triangle, Vec3d sonar_m) const;
  void bend_at(const Triangle& triangle, const std::array<double, 3>& weight, double side, SpecularPoint& point) const;
  void solve(std::uint32_t triangle, const SpecularQuery& query, std::vector<SpecularPoint>& out) const;
  double walk(std::uint32_t triangle, Vec3d from, Vec3d direction, const SpecularPoint& point, std::size_t axis,
              double unit_m) const;

  std::vector<Face> faces_;
  std::vector<Vertex> vertices_;
  std::vector<Triangle> triangles_;  // in the order of the leaves
  std::vector<Node> nodes_;
};

// Computes mirror points of spheres, cylinders, boxes and planes in closed form, from outside and, for tanks, from inside. So
// core/pipeline/specular gets exact radii and extents instead of those of facets.

/// Appends the mirror points of the primitive whose echoes may be strong enough. The caller tests whether they are hidden.
/// Kind::none has no mirror points.
void find_specular_points(const Primitive& primitive, const SpecularQuery& query, std::vector<SpecularPoint>& out);

}  // namespace sonar
