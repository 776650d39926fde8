#include "core/scene/specular/flat_faces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>

#include "core/scene/specular/specular_mesh.hpp"

namespace sonar {
namespace {

constexpr double least_area_m2 = 0.05;
constexpr double least_width_m = 0.1;        // smallest area divided by greatest extent; narrower faces diffract
constexpr double same_plane_m = 2e-4;        // width of a bin of offsets: an eighth of a wavelength at 1 MHz
constexpr double same_normal = 1 - 1e-6;     // cosine of 1.4 mrad; a neighbour whose normal differs by less is coplanar
constexpr double most_gentle_border = 0.25;  // fraction of the border at gentle bends; above it, the surface is curved

using Triangles = std::vector<std::uint32_t>;

struct Plane {
  Vec3d normal;
  double offset_m = 0;
};

Vec3d corner(const Mesh& mesh, std::uint32_t triangle, std::size_t i) {
  return to_double(mesh.vertices[mesh.triangles[triangle][i]]);
}
/// Twice the area, along the normal.
Vec3d area_vector(const Mesh& mesh, std::uint32_t t) {
  const Vec3d a = corner(mesh, t, 0);
  return cross(corner(mesh, t, 1) - a, corner(mesh, t, 2) - a);
}
/// Makes the normal's largest component positive. Both sides of a sheet are one mirror.
Vec3d one_sided(Vec3d n) {
  const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  const double leading = z >= x && z >= y ? n.z : y >= x ? n.y : n.x;
  return leading < 0 ? -1.0 * n : n;
}

struct Candidate {
  Plane plane;  // plane of the largest triangle
  double largest_m2 = 0, area_m2 = 0;
  std::uint16_t material = 0;
  Triangles triangles;
};

/// Collects coplanar triangles of one material. Bins are rounded normals and offsets. If a plane is close to a border of its bin,
/// the bins beyond that border are searched, too.
class FaceSorter {
 public:
  void add(const Mesh& mesh, std::uint32_t t) {
    const Vec3d twice = area_vector(mesh, t);
    const double area = 0.5 * length(twice);
    if (!(area > 0)) return;
    const Vec3d n = one_sided((0.5 / area) * twice);
    Candidate& c = candidate_of({n, dot(n, corner(mesh, t, 0))}, mesh.material[t]);
    // The plane of the largest triangle has the smallest rounding error.
    if (area > c.largest_m2) c.plane = {n, dot(n, corner(mesh, t, 0))}, c.largest_m2 = area;
    c.material = mesh.material[t];
    c.area_m2 += area;
    c.triangles.push_back(t);
  }
  std::vector<Candidate> faces() {
    std::vector<Candidate> all;
    for (auto& [key, c] : found_) all.push_back(std::move(c));
    return all;
  }

 private:
  using Key = std::array<std::int64_t, 5>;

  Candidate& candidate_of(const Plane& p, std::uint16_t material) {
    const std::array<double, 4> x{p.normal.x * normal_steps, p.normal.y * normal_steps, p.normal.z * normal_steps,
                                  p.offset_m / same_plane_m};
    Key own{};
    std::array<int, 4> beside{};  // the next bin if its border is close
    for (std::size_t i = 0; i < 4; ++i) {
      own[i] = std::llround(x[i]);
      const double over = x[i] - static_cast<double>(own[i]);
      if (std::abs(over) > 0.5 - close_to_border) beside[i] = over > 0 ? 1 : -1;
    }
    own[4] = material;
    // The bin of the rounded plane, then those across a nearby border.
    for (int pick = 0; pick < 16; ++pick) {
      Key key = own;
      bool sensible = true;
      for (std::size_t i = 0; i < 4; ++i) {
        if (!(pick >> i & 1)) continue;
        sensible = sensible && beside[i] != 0;
        key[i] += beside[i];
      }
      if (!sensible) continue;
      if (const auto it = found_.find(key); it != found_.end()) return it->second;
    }
    return found_[own];
  }

  static constexpr double normal_steps = 1e3, close_to_border = 0.1;
  std::map<Key, Candidate> found_;
};

bool is_narrow(const Mesh& mesh, const Candidate& c) {
  Vec3d low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const std::uint32_t t : c.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d p = corner(mesh, t, i);
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  return c.area_m2 < least_width_m * length(high - low);
}

/// The triangles that share each edge of a mesh.
class Edges {
 public:
  explicit Edges(const Mesh& mesh) {
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i) sharing_[key(mesh, t, i)].push_back(t);
  }
  const Triangles& at(const Mesh& mesh, std::uint32_t triangle, std::size_t i) const {
    return sharing_.at(key(mesh, triangle, i));
  }

 private:
  static std::uint64_t key(const Mesh& mesh, std::uint32_t t, std::size_t i) {
    const auto [low, high] = std::minmax(mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]);
    return static_cast<std::uint64_t>(high) << 32 | low;
  }
  std::unordered_map<std::uint64_t, Triangles> sharing_;
};

/// True if the face is a facet of a curved surface: along much of its border its neighbours meet it at a small angle.
bool curves_on(const Mesh& mesh, const Edges& edges, const Candidate& c) {
  const double gentle_bend = std::cos(smooth_edge_rad);
  double border_m = 0, gentle_m = 0;
  for (const std::uint32_t t : c.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d from = corner(mesh, t, i), to = corner(mesh, t, (i + 1) % 3);
      double cosine = -1;  // cosine of the smallest angle to another triangle at this edge
      for (const std::uint32_t other : edges.at(mesh, t, i)) {
        if (other == t) continue;
        const Vec3d n = area_vector(mesh, other);
        cosine = std::max(cosine, std::abs(dot(n, c.plane.normal)) / std::max(length(n), 1e-30));
      }
      if (cosine > same_normal) continue;  // a coplanar neighbour: no border
      border_m += length(to - from);
      if (cosine > gentle_bend) gentle_m += length(to - from);
    }
  return gentle_m > most_gentle_border * border_m;
}

}  // namespace

FlatFaces find_flat_faces(const Scene& scene, double least_reflection) {
  std::vector<bool> reflects;
  for (const Material& m : scene.materials) reflects.push_back(std::abs(static_cast<double>(m.reflection)) >= least_reflection);
  FlatFaces found;
  std::vector<Triangles> triangles_of;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const Object& object = scene.objects[o];
    if (!object.visible) continue;
    FaceSorter sorter;
    for (std::uint32_t t = 0; t < object.mesh->triangles.size(); ++t)
      if (reflects[object.mesh->material[t]]) sorter.add(*object.mesh, t);
    std::vector<Candidate> faces = sorter.faces();
    std::erase_if(faces, [&](const Candidate& c) { return c.area_m2 < least_area_m2 || is_narrow(*object.mesh, c); });
    if (faces.empty()) continue;
    const Edges edges(*object.mesh);
    for (Candidate& c : faces) {
      if (curves_on(*object.mesh, edges, c)) continue;
      found.faces.push_back({static_cast<int>(o), c.material, c.plane.normal, c.plane.offset_m, c.area_m2});
      triangles_of.push_back(std::move(c.triangles));
    }
  }
  std::vector<std::size_t> order(found.faces.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  // The largest faces come first, because a ping uses only the first most_mirrors of them.
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return found.faces[a].area_m2 > found.faces[b].area_m2; });
  FlatFaces sorted;
  sorted.of_triangle.resize(scene.objects.size());
  for (const std::size_t i : order) {
    const FlatFace& face = found.faces[i];
    const auto object = static_cast<std::size_t>(face.object);
    auto& of = sorted.of_triangle[object];
    if (of.empty()) of.assign(scene.objects[object].mesh->triangles.size(), -1);
    for (const std::uint32_t t : triangles_of[i]) of[t] = static_cast<std::int32_t>(sorted.faces.size());
    sorted.faces.push_back(face);
  }
  return sorted;
}

}  // namespace sonar
