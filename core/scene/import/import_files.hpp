// The files that the importer may open: the mesh, and what it names in its own folder or the scene's. Regular files only.
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
  /// `fault` is set when a file is not opened for a reason that its author must know; `opened` gets how many bytes are open.
  ImportFiles(const MeshFile& request, std::optional<Error>& fault, std::function<void(std::uintmax_t)> opened);

  /// The mesh, where its folder has no links or dots left.
  const std::string& mesh() const { return mesh_; }

  /// Number of triangles that an OBJ file lists; nullopt for other formats.
  std::optional<std::uint64_t> obj_triangles() const { return obj_triangles_; }

  bool Exists(const char* file) const override;
  Assimp::IOStream* Open(const char* file, const char* mode) override;

 private:
  bool is_ours(const std::filesystem::path& file) const;

  const MeshFile& request_;
  std::vector<std::filesystem::path> folders_;
  std::string mesh_;
  std::optional<Error>& fault_;
  std::function<void(std::uintmax_t)> opened_;
  std::uintmax_t bytes_ = 0;
  bool is_obj_ = false, without_objects_ = false;
  std::optional<std::uint64_t> obj_triangles_;
  std::vector<std::uint64_t> bad_faces_;  // of an OBJ file: faces that name vertices which it does not have
};

}  // namespace sonar
