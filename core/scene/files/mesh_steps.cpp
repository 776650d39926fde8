#include "core/scene/files/mesh_steps.hpp"

#include <algorithm>
#include <array>

#include "core/base/letters.hpp"
#include "core/base/load_step.hpp"
#include "core/base/memory_left.hpp"

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

}  // namespace sonar
