// Finds the mesh and heightmap files that an imported world names, and tests whether the scene's loader can read them. A scene
// file has whole meshes with one positive scale, so parts of files and meshes with other scales are converted to new files.
// import_scene uses this class.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

class FileResolver {
 public:
  FileResolver(const Library& library, std::filesystem::path scene, bool skip_missing, bool try_files, Findings& findings);
  /// Sets path, scale and size of a shape that comes from a file. Returns false if the file is missing, or if it cannot be used
  /// and is listed as omitted.
  bool resolve(PlacedShape& placed);
  /// Reports an error if files are missing and must not be skipped; it names each file once.
  void report_missing();
  /// Writes the meshes that had to be converted into a folder beside the scene.
  Result<void> write_converted();
  std::size_t converted() const { return converted_.size(); }

 private:
  bool resolve_mesh(PlacedShape& placed, const std::filesystem::path& file);
  bool resolve_heightmap(PlacedShape& placed, const std::filesystem::path& file);
  std::string why_not(const std::filesystem::path& file);
  bool convert(PlacedShape& placed, const std::filesystem::path& file);
  std::string path_to_write(const std::filesystem::path& file) const;

  const Library& library_;
  std::filesystem::path scene_;
  bool skip_missing_, try_files_;
  Findings& findings_;
  struct Missing {
    Place at;
    std::string what, fetch;  // fetch: a command; may be empty
  };
  std::vector<Missing> missing_;
  std::map<std::filesystem::path, std::string> tried_;      // why a mesh cannot be used; empty if it can
  std::map<std::string, std::string> known_conversions_;    // by file, part and scale: the path of the new mesh
  std::map<std::filesystem::path, std::string> converted_;  // file to write, its text
};

}  // namespace sonar::scene_tools
