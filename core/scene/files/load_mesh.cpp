// The only file that includes Assimp. Local files at load time only, never bytes from a network.
#include "core/scene/files/load_mesh.hpp"

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <assimp/DefaultIOSystem.h>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>

#include "core/base/load_step.hpp"
#include "core/base/memory_left.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/binary_stl.hpp"
#include "core/scene/shapes/polygon.hpp"

namespace sonar {
namespace {

constexpr std::uintmax_t max_file_bytes = std::uintmax_t{2} << 30;
constexpr std::uintmax_t memory_of_a_byte = 8;       // of a file while the importer holds it; measured: 4 of PLY, 6 of OBJ
constexpr std::uint64_t memory_of_a_triangle = 150;  // bytes, while they are cleaned, if no two of them share a corner
constexpr int deepest_node = 200;

std::string extension_of(const std::filesystem::path& file) {
  std::string e = file.extension().string();
  for (char& c : e) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return e;
}

Vec3d z_up_from_y_up(Vec3d p) { return {p.x, -p.z, p.y}; }

std::string first_line(std::string s) {
  std::replace(s.begin(), s.end(), '\r', '\n');
  return s.substr(0, std::min<std::size_t>(s.find('\n'), 200));
}

// What a mesh file names in turn, materials or buffers, is opened by the importer: regular files only, as everywhere.
class RegularFiles final : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override { return open_regular(file).has_value(); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return open_regular(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }
};

// Assimp 5.2 never comes back from a PLY header that does not end.
bool has_ply_header(const std::filesystem::path& file) {
  const auto in = open_regular(file);
  std::string head(64 << 10, '\0');
  head.resize(in ? std::fread(head.data(), 1, head.size(), in->get()) : 0);
  const std::size_t end = head.find("end_header");
  return head.starts_with("ply") && end != std::string::npos && head.find('\n', end) != std::string::npos;
}

/// At most, of every mesh of the file.
std::vector<std::uint64_t> triangles_of_meshes(const aiScene& scene) {
  std::vector<std::uint64_t> triangles(scene.mNumMeshes);
  for (unsigned m = 0; m < scene.mNumMeshes; ++m)
    for (unsigned f = 0; f < scene.mMeshes[m]->mNumFaces; ++f)
      triangles[m] += std::max(scene.mMeshes[m]->mFaces[f].mNumIndices, 2u) - 2;
  return triangles;
}
/// Of a node and those below it: many nodes may show the same mesh.
std::uint64_t triangles_of_nodes(const aiNode& node, const std::vector<std::uint64_t>& of_meshes, int depth = 0) {
  if (depth > deepest_node) return 0;
  std::uint64_t triangles = 0;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) triangles += of_meshes[node.mMeshes[m]];
  for (unsigned c = 0; c < node.mNumChildren; ++c) triangles += triangles_of_nodes(*node.mChildren[c], of_meshes, depth + 1);
  return triangles;
}

// Node transforms in double: far offsets in a node must not cost the vertices their millimetres.
void each_triangle(const aiScene& scene, const aiNode& node, const aiMatrix4x4t<double>& parent, int depth,
                   const TriangleSink& take) {
  if (depth > deepest_node) return;
  const aiMatrix4x4t<double> here = parent * aiMatrix4x4t<double>(node.mTransformation);
  std::vector<Vec3d> polygon;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    const auto material = static_cast<std::uint16_t>(std::min(mesh.mMaterialIndex, 65535u));
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices < 3) continue;  // points and lines
      polygon.clear();
      for (unsigned k = 0; k < face.mNumIndices; ++k) {
        if (face.mIndices[k] >= mesh.mNumVertices) return;
        const aiVector3D& p = mesh.mVertices[face.mIndices[k]];
        const aiVector3t<double> v = here * aiVector3t<double>(p.x, p.y, p.z);
        polygon.push_back({v.x, v.y, v.z});
      }
      if (polygon.size() == 3) {
        take(std::span<const Vec3d, 3>(polygon), material);
        continue;
      }
      for (const auto& triangle : triangulate(polygon))
        take(std::array{polygon[triangle[0]], polygon[triangle[1]], polygon[triangle[2]]}, material);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) each_triangle(scene, *node.mChildren[c], here, depth + 1, take);
}

tl::unexpected<Error> bad(const MeshFile& request, const std::string& what) {
  return failure(ErrorKind::bad_data, request.file.filename().string() + ": " + what);
}

/// `source` gives the corners in units and axes of the file, `triangles` of them at most.
Result<LoadedMesh> clean(const MeshFile& request, bool y_up_by_default, std::uint64_t triangles, std::vector<std::string> names,
                         const TriangleSource& source) {
  if (triangles > max_mesh_triangles)
    return bad(request, "has more than " + std::to_string(max_mesh_triangles) + " triangles; simplify it");
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
  if (!cleaned) return bad(request, cleaned.error().text);
  for (const std::uint16_t m : cleaned->mesh.material)
    if (m >= names.size()) return bad(request, "uses a material that it does not define");
  return LoadedMesh{std::move(*cleaned), std::move(names)};
}

Result<LoadedMesh> import_mesh(const MeshFile& request, const std::string& extension) {
  const bool on_disk = request.in_memory.empty();
  if (on_disk) {
    std::error_code error;
    const std::uintmax_t bytes = memory_of_a_byte * std::filesystem::file_size(request.file, error);
    if (auto room = check_memory_for(request.file.filename().string(), bytes); !room) return tl::make_unexpected(room.error());
    begin_load_step("reading " + request.file.filename().string(), bytes / memory_of_a_byte / 20);  // of PLY; others are longer
    if (extension == ".ply" && !has_ply_header(request.file))
      return bad(request, "cannot be read: not a PLY file with a whole header");
  }
  Assimp::Importer importer;
  importer.SetIOHandler(new RegularFiles);  // is the importer's then
  const bool dae = extension == ".dae";
  const bool y_up_by_default = extension == ".gltf" || extension == ".glb" || dae;  // Assimp turns a tagged DAE to y up
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, dae && request.up.has_value());
  const aiScene* scene =  // without its post-processing, which asserts on odd files
      on_disk ? importer.ReadFile(request.file.string(), 0)
              : importer.ReadFileFromMemory(request.in_memory.data(), request.in_memory.size(), 0, extension.c_str() + 1);
  if (!scene || !scene->mRootNode) return bad(request, "cannot be read: " + first_line(importer.GetErrorString()));
  std::vector<std::string> names;
  for (unsigned i = 0; i < scene->mNumMaterials; ++i) {
    aiString label;
    scene->mMaterials[i]->Get(AI_MATKEY_NAME, label);
    names.emplace_back(label.C_Str());
  }
  const std::uint64_t triangles = triangles_of_nodes(*scene->mRootNode, triangles_of_meshes(*scene));
  return clean(request, y_up_by_default, triangles, std::move(names),
               [&](const TriangleSink& take) { each_triangle(*scene, *scene->mRootNode, aiMatrix4x4t<double>(), 0, take); });
}

}  // namespace

Result<LoadedMesh> load_mesh(const MeshFile& request) {
  const bool on_disk = request.in_memory.empty();
  std::error_code error;
  if (on_disk && !std::filesystem::exists(request.file, error)) {
    return failure(ErrorKind::missing_file,
                   "no mesh file at " + request.file.string() + "; paths are relative to the scene file");
  }
  auto opened = on_disk ? open_regular(request.file) : OpenFile();
  if (!opened) return tl::make_unexpected(opened.error());
  if (on_disk && std::filesystem::file_size(request.file, error) > max_file_bytes)
    return bad(request, "is larger than 2 GiB; simplify it");
  const std::string extension = extension_of(request.file);
  static constexpr std::array<const char*, 6> known{".obj", ".stl", ".ply", ".gltf", ".glb", ".dae"};
  if (std::find(known.begin(), known.end(), extension) == known.end())
    return bad(request, "unknown mesh format; use OBJ, STL, PLY, glTF, GLB or DAE");
  if (on_disk && extension == ".stl")
    if (const auto triangles = triangles_of_binary_stl(opened->get())) {
      bool whole = true;
      auto mesh = clean(request, false, *triangles, {AI_DEFAULT_MATERIAL_NAME}, [&](const TriangleSink& take) {
        whole = whole && each_triangle_of_binary_stl(opened->get(), *triangles, take);
      });
      if (!whole) return bad(request, "cannot be read to its end");
      return mesh;
    }
  opened->reset();
  return import_mesh(request, extension);
}

}  // namespace sonar
