// Probable mistakes in a valid scene, which a loader cannot detect and which show only as an empty image.
#include <algorithm>
#include <span>

#include "clients/scene_tools/import_scene.hpp"
#include "core/text/format.hpp"

namespace sonar::scene_tools {
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
