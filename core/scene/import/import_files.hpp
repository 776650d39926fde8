// The files that the importer may open: the mesh, and files that the mesh names, in its folder or the scene's. Only regular
// files are opened.
#pragma once

#include <assimp/DefaultIOSystem.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/files/load_mesh.hpp"

namespace sonar {

class ImportFiles final : public Assimp::DefaultIOSystem {
 public:
  /// `fault` is set if a file is rejected for a reason that the user must know. `opened` is called with the number of
  /// bytes of all files opened so far.
  ImportFiles(const MeshFile& request, std::optional<Error>& fault, std::function<void(std::uintmax_t)> opened);

  /// The path of the mesh, with links and dots in its folder resolved.
  const std::string& mesh() const { return mesh_; }

  /// Number of triangles that an OBJ file lists; nullopt for other formats.
  std::optional<std::uint64_t> obj_triangles() const { return obj_triangles_; }

  /// Number of curved surfaces (surf) of an OBJ file, which the importer does not read.
  std::uint64_t free_form_surfaces() const { return free_form_; }

  /// The bytes of the mesh or of a file that it names. `file` is a path relative to the mesh. nullopt if the file cannot be read
  /// or is not one of these.
  std::optional<std::string> bytes_of(const std::string& file);

  bool Exists(const char* file) const override;
  Assimp::IOStream* Open(const char* file, const char* mode) override;

 private:
  bool is_ours(const std::filesystem::path& file) const;
  std::string plain_name(const std::string& file) const;

  const MeshFile& request_;
  std::vector<std::filesystem::path> folders_;
  std::string mesh_;
  std::optional<Error>& fault_;
  std::function<void(std::uintmax_t)> opened_;
  std::uintmax_t bytes_ = 0;
  std::uint64_t free_form_ = 0;
  bool is_obj_ = false, without_objects_ = false;
  std::optional<std::uint64_t> obj_triangles_;
  std::vector<std::uint64_t> bad_faces_;  // faces of an OBJ file that name vertices which it does not have
};

}  // namespace sonar
