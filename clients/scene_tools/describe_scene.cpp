#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "clients/scene_tools/import_scene.hpp"
#include "core/scene/files/built_in_scenes.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/text/format.hpp"
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

// Probable mistakes in a valid scene, which a loader cannot detect and which show only as an empty image.

namespace {

constexpr double far_m = 1000, tiny_m = 0.005, wide_m = 5;
constexpr double tiny_ground_m = 1, steepest_ground = 10;  // width of the ground; its height over its width
constexpr double flat_ground = 0.1, huge_ground_m = 5000;  // flat meshes, such as ground: height over width; longest length
constexpr double at_surface_m = 0.001;                     // heights up to this count as 0
constexpr std::size_t many_triangles = 2'000'000;

std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t most = 8;
  std::string out = text::joined(std::span(names).first(std::min(most, names.size())));
  if (names.size() > most) out += std::string(" and ") + std::to_string(names.size() - most) + " more";
  return out;
}

template <class Wanted>
std::vector<std::string> names_where(const SceneDescription& scene, const Wanted& wanted) {
  std::vector<std::string> names;
  for (const DescribedObject& o : scene.objects)
    if (wanted(o)) names.push_back(o.name);
  return names;
}

/// Returns whether an object is a bottom: ground by its kind, an object wide in both directions, or a tank that contains all
/// others.
bool is_ground(const DescribedObject& o, const SceneDescription& scene) {
  const Vec3d all = scene.in_world.size_m();
  const Vec3d size = o.in_world.size_m();
  return o.visible && o.kind != "sea surface" &&
         (o.kind == "seabed" || o.kind == "heightmap" || o.kind == "plane" || (size.x >= wide_m && size.y >= wide_m) ||
          (scene.objects.size() > 1 && size.x >= 0.99 * all.x && size.y >= 0.99 * all.y));
}

void remark_on_sizes(const SceneDescription& scene, Remarks& out) {
  const auto warn = [&](const DescribedObject& o, std::string_view guess) {
    out.warnings.push_back((o.name + ": " + o.file + " is " + length_text(o.own.longest_m()) + " long; ").append(guess));
  };
  for (const DescribedObject& o : scene.objects) {
    const Vec3d size = o.own.size_m();
    const double width_m = std::max(size.x, size.y);
    if (o.kind == "heightmap" && (width_m < tiny_ground_m || size.z > steepest_ground * width_m))
      out.warnings.push_back(o.name + ": " + o.file + " is " + size_text(size) +
                             " m; are its coordinates degrees (geographic: true), or kilometres?");
    if (o.kind != "mesh") continue;
    const bool is_flat = std::min(size.x, size.y) >= wide_m && size.z < flat_ground * std::min(size.x, size.y);
    if (o.own.longest_m() > (is_flat ? huge_ground_m : huge_mesh_m)) warn(o, huge_mesh_cure);
    if (o.own.longest_m() < tiny_m) warn(o, "lengths are metres after scale: is scale too small?");
  }
}

/// True if a vehicle at the origin, at any depth of the sea, is too far to detect the object.
bool is_far(const DescribedObject& o) {
  constexpr double deepest_sea_m = 11'000;
  const double depth_m = std::clamp(-o.in_world.high_m.z, 0.0, deepest_sea_m);
  return !o.in_world.empty() && o.in_world.distance_m({0, 0, -depth_m}) > far_m;
}

void remark_on_places(const SceneDescription& scene, Remarks& out) {
  const auto far = names_where(scene, is_far);
  const auto far_grid = std::find_if(scene.objects.begin(), scene.objects.end(),
                                     [](const DescribedObject& o) { return o.kind == "heightmap" && is_far(o); });
  if (!far.empty())
    out.warnings.push_back(std::string("more than 1 km from the origin, beyond the range of every product: ") + list_of(far) +
                           (far_grid == scene.objects.end()
                                ? ""
                                : "; centred: true brings the middle of " + far_grid->file +
                                      " to its pose, and origin: {lat, lon} places it if its coordinates are degrees or "
                                      "UTM (utm: 33N, its zone)"));
  const auto is_above = [&](const DescribedObject& o) {
    if (o.kind == "sea surface" || o.in_world.empty()) return false;
    const bool stands_on_it = !is_ground(o, scene) && o.in_world.high_m.z > at_surface_m;
    return o.in_world.low_m.z > (stands_on_it ? -at_surface_m : at_surface_m);
  };
  const auto above = names_where(scene, is_above);
  const auto grid = std::find_if(scene.objects.begin(), scene.objects.end(),
                                 [&](const DescribedObject& o) { return o.kind == "heightmap" && is_above(o); });
  if (!above.empty())
    out.warnings.push_back("wholly above z = 0, the water's surface: " + list_of(above) +
                           (grid == scene.objects.end() ? "" : "; if " + grid->file + " has depths, set z_scale: -1"));
  const auto dry = names_where(scene, [&](const DescribedObject& o) {
    return !o.in_world.empty() && is_ground(o, scene) && !is_above(o) && o.in_world.low_m.z >= -at_surface_m;
  });
  if (!dry.empty())
    out.warnings.push_back("ground at z = 0, the water's surface, with no water above it: " + list_of(dry) +
                           "; move it down by its pose, or by sonarctl scene import --offset");
  if (std::none_of(scene.objects.begin(), scene.objects.end(), [&](const DescribedObject& o) { return is_ground(o, scene); }))
    out.warnings.push_back(
        "no seabed: no object is ground or 5 m wide in both directions, so beams that miss the objects stay black");
}

}  // namespace

Remarks remarks_on(const SceneDescription& scene) {
  Remarks out;
  if (scene.objects.empty()) {
    out.warnings.push_back("the scene is empty: every ping will be noise");
    return out;
  }
  remark_on_sizes(scene, out);
  remark_on_places(scene, out);
  if (!scene.unused_materials.empty())
    out.warnings.push_back(std::string("materials that nothing uses: ") + list_of(scene.unused_materials));
  if (scene.triangles > many_triangles)
    out.warnings.push_back(grouped(scene.triangles) +
                           " triangles: starting takes long; are the meshes finer than the sonar can resolve?");
  const auto hidden = names_where(scene, [](const DescribedObject& o) { return !o.visible; });
  if (!hidden.empty()) out.notes.push_back(std::string("not visible: ") + list_of(hidden));
  if (!scene.moving.empty()) out.notes.push_back(std::string("moved by poses that name them: ") + list_of(scene.moving));
  out.notes.insert(out.notes.end(), scene.notes.begin(), scene.notes.end());
  return out;
}

}  // namespace sonar::scene_tools
