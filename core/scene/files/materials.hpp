// Finds materials by name while a scene is read: first in the scene, then in the library. Only the loader uses it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {

extern const char* const material_library_yaml;  // scenes/materials.yaml

class MaterialTable {
 public:
  /// Starts with the materials of the library.
  explicit MaterialTable(Scene& scene);
  /// Reads `materials: {name: {...}}`, which replace materials of the same name in the library.
  void read(text::Map materials);
  /// Returns the index into Scene::materials; nullopt for an unknown name. The first use of a material adds it there.
  std::optional<std::uint16_t> find(std::string_view name);
  /// Like find(), but reports an unknown name as an error at the node.
  std::uint16_t named(const text::Node& node);
  std::uint16_t add(Material material);

 private:
  MaterialTable(Scene& scene, std::vector<Material> definitions) : scene_(scene), definitions_(std::move(definitions)) {}
  static const std::vector<Material>& library();
  Material* definition(std::string_view name);
  void read_one(const std::string& name, text::Map keys);
  std::vector<std::string_view> names() const;

  Scene& scene_;
  std::vector<Material> definitions_;
};

}  // namespace sonar
