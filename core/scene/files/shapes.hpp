// Makes the mesh of an object from its keys: primitives, generated ground, height files and mesh files. Only the scene loader
// uses it.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "core/scene/files/built_in_scenes.hpp"
#include "core/scene/files/materials.hpp"
#include "core/scene/files/shape_cache.hpp"
#include "core/scene/scene.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {

struct ShapeReader {
  Scene& scene;
  MaterialTable& materials;
  std::filesystem::path folder;                   // paths in the scene are relative to it
  std::span<const BuiltInFile> in_memory = {};    // mesh files of a built-in scene, which are not read from disk
  ShapeCache* cache = nullptr;                    // shapes of earlier scenes
  std::optional<Geodetic> world_origin = {};      // for grids in degrees or UTM
  std::map<std::string, LoadedMesh> meshes = {};  // mesh files already read, by path, scale and up
  std::set<std::string> noted = {};               // meshes whose lost triangles are already in the scene's notes
  std::map<std::string, Shape> files = {};        // meshes with materials; objects with equal keys share one

  /// The allowed values of `type`. The value "point" is not one of them.
  static const std::vector<std::string_view>& types();
  /// Reads the keys of this type, including `material`.
  Shape read(std::string_view type, text::Map& keys);

 private:
  /// Returns a shape of an earlier scene, or makes a new one.
  Shape known_or(const std::string& key, const auto& make) const { return cache != nullptr ? cache->shape(key, make) : make(); }
  Shape read_primitive(std::string_view type, text::Map& keys);
  Shape read_ground(std::string_view type, text::Map& keys);
  Shape read_mesh_file(text::Map& keys);
  std::vector<std::uint16_t> assign_materials(const std::vector<std::string>& names, const std::vector<bool>& used,
                                              text::Map& keys);
};

}  // namespace sonar
