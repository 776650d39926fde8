#include "daemon/emulator/world/edit_scene.hpp"

#include <algorithm>
#include <cctype>

#include "core/scene/extent.hpp"
#include "core/text/nearest.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_objects = 20000, most_bodies = 256;  // the limits of scene files
constexpr std::size_t longest_name = 64;

tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::usage, std::move(text)); }
std::string in_quotes(std::string_view name) { return std::string("\"").append(name.substr(0, longest_name)).append("\""); }

std::shared_ptr<Scene> copy_of(const Scene& scene) {
  auto copy = std::make_shared<Scene>(scene);
  copy->ray_origin = ray_origin_of(scene);
  return copy;
}

bool is_point(const Scene& scene, std::string_view name) {
  return std::any_of(scene.point_targets.begin(), scene.point_targets.end(),
                     [&](const PointTarget& p) { return p.name == name; });
}
bool is_printable(std::string_view name) {
  return std::all_of(name.begin(), name.end(), [](char c) { return std::isprint(static_cast<unsigned char>(c)) != 0; });
}

/// Returns the reason why an object cannot have this name; empty if it can.
std::string complaint_about(const Scene& scene, const std::string& name) {
  if (name.empty() || name.size() > longest_name || !is_printable(name))
    return "an object needs a name of 1 to 64 printable characters";
  if (object_named(scene, name) != nullptr || is_point(scene, name) || body_named(scene, name) >= 0)
    return "the scene has an object " + in_quotes(name) + " already; choose another name";
  return {};
}

/// Copies a mesh and gives every triangle this material.
std::shared_ptr<const Mesh> mesh_of(const Mesh& mesh, std::size_t material) {
  auto copy = std::make_shared<Mesh>(mesh);
  std::fill(copy->material.begin(), copy->material.end(), static_cast<std::uint16_t>(material));
  return copy;
}

bool is_removed(const Object& object) { return object.name.empty() && !object.visible; }

/// Returns the index for a new object: the index of a removed object, else a new index at the end.
std::size_t free_place(Scene& scene) {
  const auto left = std::find_if(scene.objects.begin(), scene.objects.end(), is_removed);
  if (left != scene.objects.end()) return static_cast<std::size_t>(left - scene.objects.begin());
  scene.objects.emplace_back();
  return scene.objects.size() - 1;
}

/// Removes a body to which no object is attached any more. The index of each body after it decreases by one.
void remove_body_if_empty(Scene& scene, int body) {
  const auto rides = [body](const auto& thing) { return thing.body == body; };
  if (std::any_of(scene.objects.begin(), scene.objects.end(), rides) ||
      std::any_of(scene.point_targets.begin(), scene.point_targets.end(), rides))
    return;
  scene.body_names.erase(scene.body_names.begin() + body);
  scene.bodies_in_world.erase(scene.bodies_in_world.begin() + body);
  const auto decrease = [body](auto& things) {
    for (auto& thing : things)
      if (thing.body > body) --thing.body;
  };
  decrease(scene.objects);
  decrease(scene.point_targets);
}

/// Compares meshes by content, because a reload reads the files again into new meshes.
bool is_same(const Object& a, const Object& b) {
  Object other = b;
  if (*a.mesh == *b.mesh) other.mesh = a.mesh;
  return a == other;
}

}  // namespace

int body_named(const Scene& scene, std::string_view name) {
  const auto it = std::find(scene.body_names.begin(), scene.body_names.end(), name);
  return it == scene.body_names.end() ? -1 : static_cast<int>(it - scene.body_names.begin());
}

const Object* object_named(const Scene& scene, std::string_view name) {
  const auto it = std::find_if(scene.objects.begin(), scene.objects.end(), [&](const Object& o) { return o.name == name; });
  return name.empty() || it == scene.objects.end() ? nullptr : &*it;
}

Error no_such_object(const Scene& scene, std::string_view name) {
  if (is_point(scene, name)) return {ErrorKind::usage, in_quotes(name) + " is a point target: only the scene file can change it"};
  std::vector<std::string_view> names;
  for (const Object& o : scene.objects)
    if (!o.name.empty()) names.push_back(o.name);
  return {ErrorKind::usage,
          "the scene has no object " + in_quotes(name) + text::suggestion(name.substr(0, longest_name), names, "objects")};
}

Result<ScenePointer> with_object(const Scene& scene, const control::AddObject& wanted) {
  if (const std::string why = complaint_about(scene, wanted.name); !why.empty()) return refused(why);
  const Object* const like = object_named(scene, wanted.like);
  if (like == nullptr) return tl::make_unexpected(no_such_object(scene, wanted.like));
  if (scene.objects.size() >= most_objects && std::none_of(scene.objects.begin(), scene.objects.end(), is_removed))
    return refused("the scene has 20000 objects already");
  if (wanted.moving && scene.body_names.size() >= most_bodies) return refused("the scene has 256 moving objects already");

  auto mesh = like->mesh;
  if (!wanted.material.empty()) {
    std::vector<std::string_view> names;
    for (const Material& m : scene.materials) names.push_back(m.name);
    const auto material = std::find(names.begin(), names.end(), wanted.material);
    if (material == names.end())
      return refused("the scene has no material " + in_quotes(wanted.material) +
                     text::suggestion(wanted.material.substr(0, longest_name), names, "materials"));
    mesh = mesh_of(*mesh, static_cast<std::size_t>(material - names.begin()));
  }
  Object object{.name = wanted.name, .mesh = mesh, .in_world = wanted.in_world, .primitive = like->primitive};
  auto changed = copy_of(scene);
  if (wanted.moving) {
    object.body = static_cast<int>(changed->body_names.size());
    changed->body_names.push_back(wanted.name);
    changed->bodies_in_world.push_back(wanted.in_world);
  }
  const std::size_t place = free_place(*changed);
  changed->objects[place] = std::move(object);
  return changed;
}

Result<ScenePointer> without_object(const Scene& scene, std::string_view name) {
  const Object* const object = object_named(scene, name);
  if (object == nullptr) return tl::make_unexpected(no_such_object(scene, name));
  auto changed = copy_of(scene);
  Object& place = changed->objects[static_cast<std::size_t>(object - scene.objects.data())];
  const int body = place.body;
  place = Object{.name = {}, .mesh = std::make_shared<const Mesh>(), .in_world = {}, .visible = false};
  if (body >= 0) remove_body_if_empty(*changed, body);
  return changed;
}

Result<ScenePointer> with_object_set(const Scene& scene, const control::SetObject& wanted) {
  const Object* const object = object_named(scene, wanted.object);
  if (object == nullptr) return tl::make_unexpected(no_such_object(scene, wanted.object));
  const bool moves_by_itself = body_named(scene, wanted.object) >= 0;
  if (wanted.in_world && object->body >= 0 && !moves_by_itself)
    return refused(in_quotes(wanted.object) + " moves with " +
                   in_quotes(scene.body_names[static_cast<std::size_t>(object->body)]) + ": move that one");
  auto changed = copy_of(scene);
  Object& place = changed->objects[static_cast<std::size_t>(object - scene.objects.data())];
  place.visible = wanted.visible.value_or(place.visible);
  if (!moves_by_itself) place.in_world = wanted.in_world.value_or(place.in_world);
  return changed;
}

bool is_same(const Scene& a, const Scene& b) {
  // This line lists all members, so that it does not compile with a new member, which must then be compared too. Name and notes
  // are not compared, because they do not change the pings.
  const auto& [name, materials, objects, point_targets, body_names, bodies_in_world, sea_surface, water_column, other_sonars,
               ray_origin, notes] = a;
  return ray_origin_of(a) == ray_origin_of(b) && materials == b.materials && point_targets == b.point_targets &&
         body_names == b.body_names && bodies_in_world == b.bodies_in_world && sea_surface == b.sea_surface &&
         water_column == b.water_column && other_sonars == b.other_sonars &&
         std::equal(objects.begin(), objects.end(), b.objects.begin(), b.objects.end(),
                    [](const Object& x, const Object& y) { return is_same(x, y); });
}

}  // namespace sonar
