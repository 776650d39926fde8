#include "core/scene/files/load_scene.hpp"

#include <algorithm>

#include "core/scene/files/built_in_scenes.hpp"
#include "core/scene/files/materials.hpp"
#include "core/scene/files/read_objects.hpp"
#include "core/scene/files/shapes.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar {
namespace {

// Reads a file of additional materials: {name: {...}}, as in scenes/materials.yaml.
void read_material_library(const text::Node& node, const std::filesystem::path& folder, MaterialTable& materials) {
  if (!node.present()) return;
  const std::string name = node.text(1024);
  if (name.empty()) return;
  auto library = text::parse_yaml_file(folder / name, {.error_kind = ErrorKind::bad_data});
  if (!library) return node.fail(library.error().text);
  materials.read(library->root());
  if (const auto error = library->finish()) node.fail(error->text);
}

std::shared_ptr<const Scene> read_map(text::Map root, const std::filesystem::path& folder, const std::string& fallback_name,
                                      std::span<const BuiltInFile> meshes_in_memory = {}, ShapeCache* known = nullptr,
                                      const std::optional<Geodetic>& world_origin = {}) {
  auto scene = std::make_shared<Scene>();
  MaterialTable materials(*scene);
  ShapeReader shapes{.scene = *scene,
                     .materials = materials,
                     .folder = folder,
                     .in_memory = meshes_in_memory,
                     .cache = known,
                     .world_origin = world_origin};
  scene->name = root.optional("name").text_or(fallback_name, 64);
  read_material_library(root.optional("material_library"), folder, materials);
  materials.read(root.optional("materials").map());
  read_objects(root.required("objects"), shapes);
  read_sea_surface(root.optional("sea_surface"), shapes);
  read_other_sonars(root.optional("other_sonars"), *scene);
  read_water_column(root.optional("water_column"), *scene);
  return scene;
}

Result<std::shared_ptr<const Scene>> read_document(const text::Document& document, const std::filesystem::path& folder,
                                                   const std::string& fallback_name,
                                                   std::span<const BuiltInFile> meshes_in_memory = {},
                                                   const std::optional<Geodetic>& world_origin = {}) {
  auto scene = read_map(document.root(), folder, fallback_name, meshes_in_memory, nullptr, world_origin);
  if (auto error = document.finish()) return tl::make_unexpected(std::move(*error));
  return scene;
}

}  // namespace

std::shared_ptr<const Scene> read_scene(text::Map map, const std::filesystem::path& folder, const std::string& name,
                                        ShapeCache* known) {
  return read_map(map, folder, name, {}, known);
}

Result<std::shared_ptr<const Scene>> load_scene(const std::filesystem::path& file, const std::optional<Geodetic>& world_origin) {
  auto document = text::parse_yaml_file(file, {.error_kind = ErrorKind::bad_data});
  if (!document) return tl::make_unexpected(document.error());
  return read_document(*document, file.parent_path(), file.stem().string(), {}, world_origin);
}

Result<std::shared_ptr<const Scene>> parse_scene(std::string_view text, const std::string& name,
                                                 const std::filesystem::path& folder) {
  auto document = text::parse_yaml(text, name, {.error_kind = ErrorKind::bad_data});
  if (!document) return tl::make_unexpected(document.error());
  return read_document(*document, folder, name);
}

Result<std::shared_ptr<const Scene>> load_built_in_scene(std::string_view name) {
  const std::span<const BuiltInFile> files = built_in_files();
  const auto file = std::find_if(files.begin(), files.end(), [&](const BuiltInFile& f) { return f.name == name; });
  if (file == files.end() || !is_built_in_scene(name))
    return failure(ErrorKind::missing_file, "there is no built-in scene \"" + std::string(name) + "\"; give a scene file");
  auto document = text::parse_yaml(file->contents, "built-in " + std::string(name), {.error_kind = ErrorKind::bug});
  if (!document) return tl::make_unexpected(document.error());
  return read_document(*document, {}, std::string(name.substr(0, name.find('.'))), files);
}

}  // namespace sonar
