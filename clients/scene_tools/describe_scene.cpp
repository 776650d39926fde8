#include "clients/scene_tools/import_scene.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/scene/files/built_in_scenes.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar::scene_tools {
namespace {

namespace fs = std::filesystem;

/// Facts of the file that a loaded scene does not keep.
struct Outline {
  struct Kind {
    std::string type, file;
  };
  std::vector<Kind> objects;           // in the order of Scene::objects
  std::vector<std::string> materials;  // defined by the scene
  std::set<std::string> started_from;  // materials that a `like` names
};

Outline outline_of(const text::Document& document) {
  Outline outline;
  text::Map root = document.root();
  for (const auto& [name, node] : root.optional("materials").map().entries()) {
    outline.materials.push_back(name);
    text::Map keys = node.map();
    outline.started_from.insert(keys.optional("like").text_or("", 256));
  }
  for (const text::Node& node : root.required("objects").items()) {
    text::Map keys = node.map();
    const std::string type = keys.required("type").text();
    if (type == "point") continue;
    const std::size_t copies = std::max<std::size_t>(keys.optional("instances").items().size(), 1);
    outline.objects.insert(outline.objects.end(), copies, {type, keys.optional("file").text_or("")});
  }
  if (root.has("sea_surface")) outline.objects.push_back({"sea surface", ""});
  return outline;
}

/// Configurations and scenes are both YAML, and often in one folder.
bool is_configuration(const fs::path& file) {
  const auto document = text::parse_yaml_file(file);
  return document && document->root().has("world") && document->root().has("sonars");
}

struct Loaded {
  std::shared_ptr<const Scene> scene;
  Outline outline;
};
Result<Loaded> load(const fs::path& file) {
  std::error_code error;
  const std::string name = file.string();
  const bool built_in = !fs::exists(file, error) && is_built_in_scene(name);
  auto scene = built_in ? load_built_in_scene(name) : load_scene(file);
  if (!scene && is_configuration(file))
    return failure(ErrorKind::bad_data,
                   name + ": this is a configuration of sonard, not a scene; to check both: sonard check " + name);
  if (!scene) return tl::make_unexpected(scene.error());
  std::string_view contents;
  for (const BuiltInFile& f : built_in_files())
    if (f.name == name) contents = f.contents;
  const auto document = built_in ? text::parse_yaml(contents, name) : text::parse_yaml_file(file);
  if (!document) return tl::make_unexpected(document.error());
  return Loaded{*scene, outline_of(*document)};
}

double strength_db(const Material& m) {
  if (m.law == ScatteringLaw::lambert) return static_cast<double>(m.lambert_db);
  const auto power = [](float db) { return std::pow(10, static_cast<double>(db) / 10); };
  return 10 * std::log10(power(m.gsab.a_db) + power(m.gsab.c_db) + power(m.gsab.e_db));
}

DescribedObject describe(const Scene& scene, const Object& object, const Outline::Kind& kind) {
  DescribedObject out{.name = object.name, .kind = kind.type, .file = kind.file};
  out.triangles = object.mesh->triangles.size();
  out.visible = object.visible;
  if (object.body >= 0) out.moves_with = scene.body_names[static_cast<std::size_t>(object.body)];
  out.own = extent_of(*object.mesh);
  for (const Vec3& v : object.mesh->vertices) out.in_world.add(transform(object.in_world, to_double(v)));
  const std::set<std::uint16_t> used(object.mesh->material.begin(), object.mesh->material.end());
  for (const std::uint16_t m : used) out.materials.push_back(scene.materials[m].name);
  return out;
}

std::vector<DescribedMaterial> describe_materials(const Scene& scene) {
  std::vector<DescribedMaterial> out;
  for (const Material& m : scene.materials)
    out.push_back({m.name, m.law == ScatteringLaw::gsab ? "gsab" : "lambert", strength_db(m), static_cast<double>(m.roughness_m),
                   static_cast<double>(m.reflection), 0, 0});
  for (const Object& object : scene.objects) {
    std::set<std::uint16_t> used;
    for (const std::uint16_t m : object.mesh->material) used.insert(m), ++out[m].triangles;
    for (const std::uint16_t m : used) ++out[m].objects;
  }
  return out;
}

}  // namespace

Result<SceneDescription> describe_scene(const fs::path& file) {
  const Result<Loaded> loaded = load(file);
  if (!loaded) return tl::make_unexpected(loaded.error());
  const Scene& scene = *loaded->scene;
  SceneDescription out;
  out.name = scene.name;
  std::set<const Mesh*> meshes;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Outline::Kind kind = i < loaded->outline.objects.size() ? loaded->outline.objects[i] : Outline::Kind{};
    out.objects.push_back(describe(scene, scene.objects[i], kind));
    out.in_world.add(out.objects.back().in_world);
    const Mesh& mesh = *scene.objects[i].mesh;
    if (meshes.insert(&mesh).second)
      out.mesh_bytes +=
          mesh.vertices.size() * sizeof(Vec3) + mesh.triangles.size() * (sizeof(mesh.triangles[0]) + sizeof(std::uint16_t));
  }
  for (const PointTarget& point : scene.point_targets) {
    DescribedObject line{.name = point.name, .kind = "point"};
    line.in_world.add(scene.in_world(point, scene.bodies_in_world));
    if (point.body >= 0) line.moves_with = scene.body_names[static_cast<std::size_t>(point.body)];
    out.in_world.add(line.in_world);
    out.objects.push_back(std::move(line));
  }
  out.materials = describe_materials(scene);
  for (const std::string& name : loaded->outline.materials) {
    const auto is_it = [&](const DescribedMaterial& m) { return m.name == name && m.objects > 0; };
    const bool used = std::any_of(out.materials.begin(), out.materials.end(), is_it);
    if (!used && !loaded->outline.started_from.contains(name)) out.unused_materials.push_back(name);
  }
  out.moving = scene.body_names;
  out.points = scene.point_targets.size();
  out.other_sonars = scene.other_sonars.size();
  out.triangles = scene.triangle_count();
  out.sea_surface = scene.sea_surface.present;
  out.volume_db = static_cast<double>(scene.water_column.volume_db);
  out.notes = scene.notes;
  return out;
}

}  // namespace sonar::scene_tools
