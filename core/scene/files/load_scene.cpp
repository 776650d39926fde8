#include "core/scene/files/load_scene.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/scene/files/built_in_scenes.hpp"
#include "core/scene/files/materials.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "core/text/nearest.hpp"
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

namespace {

using text::Map;
using text::Node;
using text::Range;

const Range a_place = Range::between(-1e7, 1e7);

Pose pose_from(Map keys) {
  Pose pose;
  const auto xyz = keys.optional("xyz_m").numbers_or<3>({0, 0, 0}, a_place);
  const auto rpy = keys.optional("rpy_deg").numbers_or<3>({0, 0, 0}, Range::between(-360, 360));
  pose.position_m = {xyz[0], xyz[1], xyz[2]};
  pose.orientation = quat_from_rpy({rad_from_deg(rpy[0]), rad_from_deg(rpy[1]), rad_from_deg(rpy[2])});
  return pose;
}

// Reads the list in one pass. Stores the names in use, and which of them are bodies.
class ObjectsReader {
 public:
  explicit ObjectsReader(ShapeReader& shapes) : shapes_(shapes), scene_(shapes.scene) {}

  void read(const Node& node) {
    Map keys = node.map();
    const Node type_node = keys.required("type");
    const Node name_node = keys.optional("name");
    const Node attached = keys.optional("attached_to");
    const bool moving = keys.optional("moving").boolean_or(false);
    label_ = keys.optional("label").text_or({}, 64);
    if (!type_node.present()) return;
    std::vector<std::string_view> types = ShapeReader::types();
    types.push_back("point");
    const std::string_view type = types[type_node.choice_index(types)];
    if (type_node.text() != type) return;  // an error has been recorded already
    const std::string name = name_node.text_or(std::string(type) + " " + std::to_string(++unnamed_), 64);
    if (!names_.insert(name).second) name_node.fail("name is used twice; object names must be unique");
    if (moving && attached.present()) attached.fail("give moving: true or attached_to, not both");
    int body = attached.present() ? body_named(attached) : -1;
    if (type == "point") return read_point(keys, name, body, moving);

    const Shape shape = shapes_.read(type, keys);
    const bool visible = keys.optional("visible").boolean_or(true);
    const Node instances = keys.optional("instances");
    const Node pose_node = keys.optional("pose");
    if (!instances.present()) {
      const Pose pose = read_pose(pose_node);
      if (moving) body = add_body(node, name, pose);
      return place(node, shape, name, moving ? Pose{} : pose, body, visible);
    }
    if (pose_node.present()) pose_node.fail("give pose or instances, not both");
    if (moving) instances.fail("a moving object has one pose only; write one object per instance");
    std::size_t n = 0;
    for (const Node& instance : instances.items(1, max_objects)) {
      place(instance, shape, name + "[" + std::to_string(n++) + "]", pose_from(instance.map()), body, visible);
    }
  }

 private:
  int body_named(const Node& node) {
    const std::string wanted = node.text(64);
    for (std::size_t b = 0; b < scene_.body_names.size(); ++b) {
      if (scene_.body_names[b] == wanted) return static_cast<int>(b);
    }
    const std::vector<std::string_view> known(scene_.body_names.begin(), scene_.body_names.end());
    node.fail("no moving object \"" + wanted + "\" above this one" + text::suggestion(wanted, known, "moving objects"));
    return -1;
  }

  int add_body(const Node& node, const std::string& name, const Pose& pose) {
    if (scene_.body_names.size() >= max_bodies) node.fail("more than " + std::to_string(max_bodies) + " moving objects");
    scene_.body_names.push_back(name);
    scene_.bodies_in_world.push_back(pose);
    return static_cast<int>(scene_.body_names.size()) - 1;
  }

  // `pose` is relative to the body if the object has one, else to the world.
  void place(const Node& node, const Shape& shape, std::string name, const Pose& pose, int body, bool visible) {
    if (!shape.mesh) return;
    if (scene_.objects.size() >= max_objects) return node.fail("more than " + std::to_string(max_objects) + " objects");
    triangles_ += shape.mesh->triangles.size();
    if (triangles_ > max_mesh_triangles)
      return node.fail("the scene has more than 20 million triangles here; use coarser meshes");
    const Pose in_world = body < 0 ? pose : compose(scene_.bodies_in_world[static_cast<std::size_t>(body)], pose);
    scene_.objects.push_back(Object{.name = std::move(name),
                                    .mesh = shape.mesh,
                                    .in_world = compose(in_world, Pose{shape.centre_m, {}}),
                                    .body = body,
                                    .visible = visible,
                                    .primitive = shape.primitive,
                                    .label = label_});
  }

  void read_point(Map& keys, const std::string& name, int body, bool moving) {
    PointTarget target;
    target.name = name;
    target.label = label_;
    target.target_strength_db = static_cast<float>(keys.required("target_strength_db").number(Range::between(-120, 60)));
    const Node pose_node = keys.optional("pose");
    const Pose pose = read_pose(pose_node);
    target.position_m = pose.position_m;
    if (moving) {
      body = add_body(pose_node, name, pose);
      target.position_m = {};
    }
    target.body = body;
    if (scene_.point_targets.size() >= max_objects) pose_node.fail("more than " + std::to_string(max_objects) + " point targets");
    scene_.point_targets.push_back(std::move(target));
  }

  ShapeReader& shapes_;
  Scene& scene_;
  std::set<std::string> names_;
  std::size_t triangles_ = 0;
  int unnamed_ = 0;
  std::string label_;  // label of the entry that is being read
};

}  // namespace

Pose read_pose(const Node& node) { return node.present() ? pose_from(node.map()) : Pose{}; }

void read_objects(const Node& list, ShapeReader& shapes) {
  ObjectsReader reader(shapes);
  for (const Node& node : list.items(0, max_objects)) reader.read(node);
}

void read_other_sonars(const Node& list, Scene& scene) {
  if (!list.present()) return;
  constexpr std::size_t most = 16;
  for (const Node& node : list.items(0, most)) {
    Map keys = node.map();
    OtherSonar other;
    other.name = keys.optional("name").text_or("other sonar " + std::to_string(scene.other_sonars.size() + 1), 64);
    const auto xyz = keys.required("xyz_m").numbers_or<3>({0, 0, 0}, a_place);
    other.position_m = {xyz[0], xyz[1], xyz[2]};
    other.level_upa = static_cast<float>(std::pow(10.0, keys.required("level_db").number(Range::between(0, 240)) / 20));
    other.rate_hz = static_cast<float>(keys.optional("rate_hz").number_or(7, Range::between(0.01, 200)));
    other.pulse_s = static_cast<float>(1e-3 * keys.optional("pulse_ms").number_or(0.1, Range::between(1e-3, 100)));
    scene.other_sonars.push_back(std::move(other));
  }
}

void read_sea_surface(const Node& node, ShapeReader& shapes) {
  if (!node.present()) return;
  Map keys = node.map();
  const auto size = keys.optional("size_m").numbers_or<2>({200, 200}, Range{.min = 0.1, .max = 1e5});
  const auto centre = keys.optional("centre_m").numbers_or<2>({0, 0}, a_place);
  const auto number = [&](const char* key, float& value, Range range) {
    value = static_cast<float>(keys.optional(key).number_or(static_cast<double>(value), range));
  };
  Scene& scene = shapes.scene;
  SeaSurface& sea = scene.sea_surface;
  sea.present = true;
  number("lambert_db", sea.lambert_db, Range::between(-80, largest_lambert_db));
  number("roughness_m", sea.roughness_m, Range::between(0, 20));
  number("bubble_layer_m", sea.bubble_layer_m, Range::between(0, 100));
  number("bubble_loss_db_per_m", sea.bubble_loss_db_per_m, Range::between(0, 1000));
  if (sea.bubble_loss_db_per_m > 0 && !(sea.bubble_layer_m > 0))
    node.fail("bubble_loss_db_per_m needs bubble_layer_m, the thickness of the layer");
  if (size[0] <= 0 || size[1] <= 0) return;
  Material air{.name = "sea_surface", .lambert_db = sea.lambert_db, .roughness_m = sea.roughness_m, .reflection = -1};
  Mesh mesh = make_plane(size[0], size[1], std::max(1.0, std::max(size[0], size[1]) / 100));
  std::fill(mesh.material.begin(), mesh.material.end(), shapes.materials.add(air));
  scene.objects.push_back(Object{.name = "sea surface",
                                 .mesh = std::make_shared<const Mesh>(std::move(mesh)),
                                 .in_world = Pose{{centre[0], centre[1], 0}, {}},
                                 .primitive = {.kind = Primitive::Kind::plane, .size_m = {size[0], size[1], 0}}});
}

void read_water_column(const Node& node, Scene& scene) {
  if (!node.present()) return;
  Map keys = node.map();
  const Node volume = keys.optional("volume_db"), clarity = keys.optional("clarity");
  if (volume.present() && clarity.present()) clarity.fail("give clarity or volume_db, not both");
  float& volume_db = scene.water_column.volume_db;
  volume_db = clarity.choice_or(volume_db, {{"clear", -80.0f}, {"turbid", -60.0f}});
  volume_db = static_cast<float>(volume.number_or(static_cast<double>(volume_db), Range::between(-200, -20)));
}

}  // namespace sonar
