#include "core/scene/load_scene.hpp"

#include "core/scene/materials.hpp"
#include "core/scene/read_objects.hpp"
#include "core/scene/shapes.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {
namespace {

// A file of more materials: {name: {...}}, as scenes/materials.yaml.
void read_material_library(const text::Node& node, const std::filesystem::path& folder, MaterialTable& materials) {
  if (!node.present()) return;
  const std::string name = node.text(1024);
  if (name.empty()) return;
  auto library = text::parse_yaml_file(folder / name, {.error_kind = ErrorKind::bad_data});
  if (!library) return node.fail(library.error().text);
  materials.read(library->root());
  if (const auto error = library->finish()) node.fail(error->text);
}

Result<std::shared_ptr<const Scene>> read_scene(const text::Document& document, const std::filesystem::path& folder,
                                                const std::string& fallback_name) {
  auto scene = std::make_shared<Scene>();
  MaterialTable materials(*scene);
  ShapeReader shapes{.scene = *scene, .materials = materials, .folder = folder};
  text::Map root = document.root();
  scene->name = root.optional("name").text_or(fallback_name, 64);
  read_material_library(root.optional("material_library"), folder, materials);
  materials.read(root.optional("materials").map());
  read_objects(root.required("objects"), shapes);
  read_sea_surface(root.optional("sea_surface"), shapes);
  if (auto error = document.finish()) return tl::make_unexpected(std::move(*error));
  return scene;
}

}  // namespace

Result<std::shared_ptr<const Scene>> load_scene(const std::filesystem::path& file) {
  auto document = text::parse_yaml_file(file, {.error_kind = ErrorKind::bad_data});
  if (!document) return tl::make_unexpected(document.error());
  return read_scene(*document, file.parent_path(), file.stem().string());
}

Result<std::shared_ptr<const Scene>> parse_scene(std::string_view text, const std::string& name,
                                                 const std::filesystem::path& folder) {
  auto document = text::parse_yaml(text, name, {.error_kind = ErrorKind::bad_data});
  if (!document) return tl::make_unexpected(document.error());
  return read_scene(*document, folder, name);
}

}  // namespace sonar
