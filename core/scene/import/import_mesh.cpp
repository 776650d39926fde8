#include "core/scene/import/import_mesh.hpp"

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>

#include "core/base/regular_file.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/scene/import/check_mesh.hpp"
#include "core/scene/import/gltf_floats.hpp"
#include "core/scene/import/import_files.hpp"
#include "core/scene/import/node_graph.hpp"
#include "core/scene/shapes/polygon.hpp"

namespace sonar {
namespace {

std::string first_line(std::string s) {
  std::replace(s.begin(), s.end(), '\r', '\n');
  return s.substr(0, std::min<std::size_t>(s.find('\n'), 200));
}

/// The largest possible number of triangles of each mesh of the file.
std::vector<std::uint64_t> triangles_of_meshes(const aiScene& scene) {
  std::vector<std::uint64_t> triangles(scene.mNumMeshes);
  for (unsigned m = 0; m < scene.mNumMeshes; ++m)
    for (unsigned f = 0; f < scene.mMeshes[m]->mNumFaces; ++f)
      triangles[m] += std::max(scene.mMeshes[m]->mFaces[f].mNumIndices, 2u) - 2;
  return triangles;
}
/// Number of triangles of a node and the nodes below it; many nodes may show the same mesh.
std::uint64_t triangles_of_nodes(const aiNode& node, const std::vector<std::uint64_t>& of_meshes, unsigned depth = 0) {
  if (depth > NodeGraph::deepest) return 0;
  std::uint64_t triangles = 0;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) triangles += of_meshes[node.mMeshes[m]];
  for (unsigned c = 0; c < node.mNumChildren; ++c) triangles += triangles_of_nodes(*node.mChildren[c], of_meshes, depth + 1);
  return triangles;
}

/// Keeps only the meshes that have this name or belong to nodes with this name; the only part of a file is kept under any name.
/// If no part is kept, returns the names of the parts, for an error; else an empty text.
std::string keep_part(aiScene& scene, const std::string& wanted) {
  std::vector<aiNode*> holders;  // nodes that show meshes
  const auto walk = [&](const auto& self, aiNode& node, unsigned depth) -> void {
    if (node.mNumMeshes > 0) holders.push_back(&node);
    for (unsigned c = 0; depth < NodeGraph::deepest && c < node.mNumChildren; ++c) self(self, *node.mChildren[c], depth + 1);
  };
  walk(walk, *scene.mRootNode, 0);
  const auto is_wanted = [&](const aiNode& node, unsigned mesh) {
    return node.mName.C_Str() == wanted || scene.mMeshes[mesh]->mName.C_Str() == wanted;
  };
  const auto has_wanted = [&](const aiNode* node) {
    return std::any_of(node->mMeshes, node->mMeshes + node->mNumMeshes, [&](unsigned m) { return is_wanted(*node, m); });
  };
  if (std::any_of(holders.begin(), holders.end(), has_wanted)) {
    for (aiNode* node : holders) {
      const auto* end =
          std::stable_partition(node->mMeshes, node->mMeshes + node->mNumMeshes, [&](unsigned m) { return is_wanted(*node, m); });
      node->mNumMeshes = static_cast<unsigned>(end - node->mMeshes);
    }
    return {};
  }
  if (holders.size() == 1) return {};
  std::string names = "none";
  for (std::size_t i = 0; i < std::min<std::size_t>(holders.size(), 20); ++i)
    names = (i == 0 ? "" : names + ", ") + std::string(holders[i]->mName.C_Str()).substr(0, 64);
  return names;
}

// Transforms of nodes are in double, so that vertices far from the origin are exact to millimetres.
// A face with missing vertices is left out.
void each_triangle(const aiScene& scene, const std::vector<std::vector<Vec3d>>& skins, const aiNode& node,
                   const aiMatrix4x4t<double>& parent, unsigned depth, const TriangleSink& take) {
  if (depth > NodeGraph::deepest) return;
  const aiMatrix4x4t<double> here = parent * aiMatrix4x4t<double>(node.mTransformation);
  std::vector<Vec3d> polygon;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    const std::vector<Vec3d>& skin = skins[node.mMeshes[m]];
    const auto material = static_cast<std::uint16_t>(std::min(mesh.mMaterialIndex, 65535u));
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices < 3) continue;  // points and lines
      polygon.clear();
      const bool whole =
          std::all_of(face.mIndices, face.mIndices + face.mNumIndices, [&](unsigned index) { return index < mesh.mNumVertices; });
      for (unsigned k = 0; whole && k < face.mNumIndices; ++k) {
        if (!skin.empty() && is_finite(skin[face.mIndices[k]])) {
          polygon.push_back(skin[face.mIndices[k]]);
          continue;
        }
        const aiVector3D& p = mesh.mVertices[face.mIndices[k]];
        const aiVector3t<double> v = here * aiVector3t<double>(p.x, p.y, p.z);
        polygon.push_back({v.x, v.y, v.z});
      }
      if (!whole) continue;
      if (polygon.size() == 3) {
        take(std::span<const Vec3d, 3>(polygon), material);
        continue;
      }
      for (const auto& triangle : triangulate(polygon))
        take(std::array{polygon[triangle[0]], polygon[triangle[1]], polygon[triangle[2]]}, material);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) each_triangle(scene, skins, *node.mChildren[c], here, depth + 1, take);
}

/// Reads the text of a mesh, or its first `most` bytes.
Result<std::string> text_of(const MeshFile& request, std::size_t most) {
  if (!request.in_memory.empty()) return std::string(request.in_memory.substr(0, most));
  return read_regular(request.file, most);
}

/// Returns why the importer cannot read the file: a better reason than the importer's if one is found, else `reason`.
std::string better_reason(const MeshFile& request, const std::string& extension, std::string reason) {
  if (extension == ".stl") return reason + "; is it cut short? Export it again";
  if (extension != ".glb" && extension != ".gltf") return reason;
  if (reason.find("Draco") != reason.npos)  // Assimp can be built without it
    return reason + " (KHR_draco_mesh_compression); unpack it: gltf-transform copy IN OUT.glb";
  const auto text = text_of(request, max_mesh_bytes);
  if (!text) return reason;
  if (extension == ".gltf" && text->starts_with("glTF")) return "is a GLB file; name it .glb";
  if (extension == ".glb")
    if (const MeshFault fault = glb_fault(*text)) return *fault;
  if (reason == "GLTF: No scene") return "has no scene; export it with one";
  return reason.starts_with("No suitable reader") ? unknown_gltf(*text) : reason;
}

/// Number of triangles that an STL, PLY or OBJ file lists; for other files the number that was imported.
std::uint64_t triangles_listed(const MeshFile& request, const std::string& extension, const ImportFiles& files,
                               const aiScene& scene, std::uint64_t imported) {
  if (files.obj_triangles()) return *files.obj_triangles();
  const auto text = extension == ".stl" || extension == ".ply"
                        ? text_of(request, extension == ".ply" ? ply_head_bytes : max_mesh_bytes)
                        : Result<std::string>();
  if (!text || text->empty()) return imported;
  if (extension == ".stl") return std::max(imported, facets_of_stl(*text));
  std::uint64_t faces = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) faces += scene.mMeshes[m]->mNumFaces;
  const std::uint64_t listed = ply_head_of(*text).faces();
  return imported + (listed > faces ? listed - faces : 0);  // a missing face has at least one triangle
}

/// True if the URI of a buffer names the mesh itself. Links to the mesh are not recognised, but ImportFiles counts their size,
/// as that of other files.
bool is_itself(const MeshFile& request, const std::string& uri) {
  const std::string own = request.file.filename().string();
  const auto names_it = [&](const std::string& name) {
    if (std::string_view(name).substr(name.rfind('/') + 1) != own) return false;  // without a slash, npos + 1 is 0
    std::error_code error;
    const std::filesystem::path parent = request.file.parent_path();
    const std::filesystem::path folder = std::filesystem::canonical(parent.empty() ? "." : parent, error);
    return (folder / name).lexically_normal() == folder / own;
  };
  return names_it(uri) || names_it(without_percents(uri));
}

Result<MeshFault> check_text(const MeshFile& request, const std::string& extension, ListedFaces& faces) {
  std::string held;
  std::string_view text = request.in_memory;
  std::uintmax_t bytes = text.size();
  const auto read = [&](std::size_t most) -> Result<void> {
    if (!request.in_memory.empty()) return {};
    auto contents = read_regular(request.file, most);
    if (!contents) return tl::make_unexpected(contents.error());
    text = held = *std::move(contents);
    return {};
  };
  if (extension == ".ply") {  // the counts of the header are checked before the rest is read
    if (auto head = read(ply_head_bytes); !head) return tl::make_unexpected(head.error());
    std::error_code error;
    if (request.in_memory.empty()) bytes = std::filesystem::file_size(request.file, error);
    if (auto fault = check_ply(ply_head_of(text), bytes)) return fault;
  }
  if (auto all = read(max_mesh_bytes); !all) return tl::make_unexpected(all.error());
  return extension == ".ply"   ? check_ply_records(text)
         : extension == ".obj" ? check_obj(text)
         : extension == ".stl" ? check_stl_text(text)
         : extension == ".dae" ? check_collada(text, &faces)
                               : check_gltf(text, &faces, [&](const std::string& uri) { return is_itself(request, uri); });
}

}  // namespace

Result<LoadedMesh> import_mesh(const MeshFile& request, const ImportHooks& hooks) {
  const std::string extension = mesh_extension(request.file);
  ListedFaces faces;
  const auto checked = check_text(request, extension, faces);
  if (!checked) return tl::make_unexpected(checked.error());
  if (*checked) return bad_mesh(request, **checked);

  std::optional<Error> fault;
  Assimp::Importer importer;
  auto* files = new ImportFiles(request, fault, hooks.opened);
  importer.SetIOHandler(files);  // the importer owns `files` from then on
  if (files->free_form_surfaces() > 0)
    return bad_mesh(request, "has " + std::to_string(files->free_form_surfaces()) +
                                 " curved surface(s) (surf), which are not read; export polygons");
  const bool dae = extension == ".dae";
  const bool y_up_by_default = is_y_up_by_default(extension);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, dae && request.up.has_value());
  std::string held;
  std::string_view in_memory = request.in_memory, kind = std::string_view(extension).substr(1);
  if (faces.needs_floats) {
    if (in_memory.empty()) in_memory = held = files->bytes_of(request.file.filename()).value_or("");
    auto with_floats = gltf_with_floats(in_memory, [&](const std::string& name) { return files->bytes_of(name); });
    if (fault) return tl::make_unexpected(*std::move(fault));
    if (!with_floats) return bad_mesh(request, with_floats.error().text);
    in_memory = held = *std::move(with_floats), kind = "glb";
  }
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, !request.part.empty());
  const aiScene* scene =  // without post-processing, whose asserts fail on unusual files
      in_memory.empty() ? importer.ReadFile(files->mesh(), 0)
                        : importer.ReadFileFromMemory(in_memory.data(), in_memory.size(), 0, std::string(kind).c_str());
  if (!scene || !scene->mRootNode) {
    if (fault) return tl::make_unexpected(*std::move(fault));
    return bad_mesh(request, "cannot be read: " + better_reason(request, extension, first_line(importer.GetErrorString())));
  }
  hooks.imported();
  if (!request.part.empty())
    if (const std::string parts = keep_part(*const_cast<aiScene*>(scene), request.part); !parts.empty())
      return bad_mesh(request, "has no part \"" + request.part.substr(0, 64) + "\"; its parts: " + parts);
  std::vector<std::string> names;
  for (unsigned i = 0; i < scene->mNumMaterials; ++i) {
    aiString label;
    scene->mMaterials[i]->Get(AI_MATKEY_NAME, label);
    names.emplace_back(label.C_Str());
  }
  const std::uint64_t triangles = triangles_of_nodes(*scene->mRootNode, triangles_of_meshes(*scene));
  const std::uint64_t listed = std::max(faces.shown, triangles_listed(request, extension, *files, *scene, triangles));
  const auto skins = skins_of(*scene);
  std::uint64_t taken = 0;
  auto mesh = finish_mesh(request, y_up_by_default, triangles, std::move(names), [&](const TriangleSink& take) {
    taken = 0;
    each_triangle(*scene, skins, *scene->mRootNode, aiMatrix4x4t<double>(), 0,
                  [&](std::span<const Vec3d, 3> p, std::uint16_t material) {
                    ++taken;
                    take(p, material);
                  });
  });
  if (mesh && request.part.empty() && listed > taken) mesh->lost = listed - taken;
  if (mesh) mesh->hidden = faces.hidden;
  return mesh;
}

}  // namespace sonar
