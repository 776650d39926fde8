#include "core/scene/files/mesh_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/letters.hpp"
#include "core/base/load_step.hpp"
#include "core/base/memory_left.hpp"
#include "core/scene/vertex_table.hpp"

namespace sonar {
namespace {

// Memory of the importer for each byte of a file; measured: 4 for PLY, 6 for OBJ.
constexpr std::uintmax_t memory_of_a_byte = 8;
constexpr std::uint64_t memory_of_a_triangle = 150;  // bytes during cleaning, if no two triangles share a corner

Vec3d z_up_from_y_up(Vec3d p) { return {p.x, -p.z, p.y}; }

}  // namespace

std::string mesh_extension(const std::filesystem::path& file) { return small_letters(file.extension().string()); }

bool is_mesh_extension(std::string_view extension) {
  static constexpr std::array<std::string_view, 6> known{".obj", ".stl", ".ply", ".gltf", ".glb", ".dae"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

tl::unexpected<Error> bad_mesh(const MeshFile& request, const std::string& what) {
  return failure(ErrorKind::bad_data, request.file.filename().string() + ": " + what);
}

Result<void> check_import_memory(const MeshFile& request, std::uintmax_t bytes) {
  return check_memory_for(request.file.filename().string(), memory_of_a_byte * bytes);
}

Result<LoadedMesh> finish_mesh(const MeshFile& request, bool y_up_by_default, std::uint64_t triangles,
                               std::vector<std::string> names, const TriangleSource& source) {
  if (triangles > max_mesh_triangles)
    return bad_mesh(request, "has more than " + std::to_string(max_mesh_triangles) + " triangles; simplify it");
  if (auto room = check_memory_for(request.file.filename().string(), memory_of_a_triangle * triangles); !room)
    return tl::make_unexpected(room.error());
  const bool y_up = request.up ? *request.up == UpAxis::y : y_up_by_default;
  const auto in_metres = [&](Vec3d p) { return request.scale * (y_up ? z_up_from_y_up(p) : p); };
  begin_load_step("triangles of " + request.file.filename().string(), triangles);
  std::uint64_t given = 0;
  auto cleaned = clean_triangles([&](const TriangleSink& take) {
    source([&](std::span<const Vec3d, 3> p, std::uint16_t material) {
      if (++given % 65536 == 0) load_step_reached(static_cast<double>(given) / static_cast<double>(2 * triangles));
      take(std::array{in_metres(p[0]), in_metres(p[1]), in_metres(p[2])}, material);
    });
  });
  if (!cleaned) return bad_mesh(request, cleaned.error().text);
  for (const std::uint16_t m : cleaned->mesh.material)
    if (m >= names.size()) return bad_mesh(request, "uses a material that it does not define");
  return LoadedMesh{std::move(*cleaned), std::move(names)};
}

namespace {

// A triangle has an area if its height divided by its longest side exceeds rounding errors.
bool has_area(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3d ab = to_double(b) - to_double(a), ac = to_double(c) - to_double(a), bc = ac - ab;
  const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
  return length(cross(ab, ac)) > 1e-6 * longest && longest > 1e-12;
}

bool is_within(Vec3d p, Vec3d low, Vec3d high) {  // false if a coordinate is not a number
  return p.x >= low.x && p.y >= low.y && p.z >= low.z && p.x <= high.x && p.y <= high.y && p.z <= high.z;
}

}  // namespace

Result<CentredMesh> clean_triangles(const TriangleSource& source, std::size_t most) {
  const auto bad = [](std::string what) { return failure(ErrorKind::bad_data, std::move(what)); };
  constexpr double huge = std::numeric_limits<double>::infinity();
  std::size_t count = 0;
  bool finite = true;
  Vec3d low{huge, huge, huge}, high{-huge, -huge, -huge};
  source([&](std::span<const Vec3d, 3> corners, std::uint16_t) {
    ++count;
    for (const Vec3d& p : corners) {
      finite = finite && is_finite(p);
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  });
  if (count == 0) return bad("has no triangles; export faces, not only points or lines");
  if (count > most) return bad("has more than " + std::to_string(most) + " triangles; simplify it");
  if (!finite) return bad("has vertices that are not finite numbers; export it again");
  const double far = std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), high.x, high.y, high.z});
  if (far > 1e7) return bad("reaches beyond 1e7 m; set \"scale\" (0.001 for millimetres) or move it to the origin");

  CentredMesh out;
  out.centre_m = 0.5 * (low + high);
  VertexTable vertices(out.mesh.vertices, count / 2);  // number of vertices of a closed surface
  out.mesh.triangles.reserve(count);
  out.mesh.material.reserve(count);
  // The file may have changed between the passes.
  std::size_t again = 0;
  bool same = true;
  source([&](std::span<const Vec3d, 3> corners, std::uint16_t material) {
    Vec3 p[3];
    for (std::size_t k = 0; k < 3; ++k) {
      same = same && is_within(corners[k], low, high);
      p[k] = to_float(corners[k] - out.centre_m);
    }
    same = same && ++again <= count;
    if (!same) return;
    if (!has_area(p[0], p[1], p[2])) {
      ++out.left_out;
      return;
    }
    out.mesh.triangles.push_back({vertices.index_of(p[0]), vertices.index_of(p[1]), vertices.index_of(p[2])});
    out.mesh.material.push_back(material);
  });
  if (!same || again != count) return bad("changed while it was read; load it again");
  if (out.mesh.triangles.empty()) return bad("has only triangles without area; check its units and \"scale\"");
  return out;
}

Result<CentredMesh> clean_mesh(const std::vector<Vec3d>& corners, const std::vector<std::uint16_t>& material, std::size_t most) {
  return clean_triangles(
      [&](const TriangleSink& take) {
        for (std::size_t t = 0; t < corners.size() / 3; ++t)
          take(std::span<const Vec3d, 3>(&corners[3 * t], 3), t < material.size() ? material[t] : std::uint16_t{0});
      },
      most);
}

}  // namespace sonar
