#include "daemon/commands/dataset/constraints.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/scene/extent.hpp"
#include "core/text/nearest.hpp"

namespace sonar::dataset {
namespace {

/// The name without the index of an instance: "rock[3]" gives "rock".
std::string shared_name(const std::string& name) { return name.substr(0, name.find('[')); }

/// Visible objects of that name, with their poses.
std::vector<std::pair<const Object*, Pose>> placed(const std::string& name, const PingRequest& request, const Scene& scene) {
  std::vector<std::pair<const Object*, Pose>> found;
  for (const Object& o : scene.objects)
    if (o.visible && is_named(o, name)) found.emplace_back(&o, scene.in_world(o, request.bodies_in_world));
  return found;
}

Vec3d middle_of(const Object& object, const Pose& in_world) { return transform(in_world, extent_of(*object.mesh).centre_m()); }

/// True if a point lies within range, the horizontal aperture and the vertical beam width of the sonar.
bool is_in_fan(Vec3d in_world, const PingRequest& r) {
  const Vec3d p = transform(inverse(r.sonar_in_world), in_world);
  const FrequencyMode& mode = r.model->modes[static_cast<std::size_t>(r.settings.mode)];
  const double range = length(p), half_aperture = static_cast<double>(mode.horizontal_aperture_rad) / 2;
  return range >= r.settings.range_start_m && range <= r.settings.range_m && p.x > 0 &&
         std::abs(std::atan2(p.y, p.x)) <= half_aperture &&
         std::abs(std::atan2(p.z, std::hypot(p.x, p.y))) <= static_cast<double>(mode.pattern.elevation_width_rad) / 2;
}

/// The largest height of an object's surface over a place, in the axes of the object.
std::optional<double> height_at(const Mesh& mesh, double x, double y) {
  std::optional<double> highest;
  for (const auto& corners : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices[corners[0]]), b = to_double(mesh.vertices[corners[1]]),
                c = to_double(mesh.vertices[corners[2]]);
    const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (area == 0) continue;
    // Barycentric coordinates of the place in the triangle as seen from above.
    const double v = ((x - a.x) * (c.y - a.y) - (c.x - a.x) * (y - a.y)) / area;
    const double w = ((b.x - a.x) * (y - a.y) - (x - a.x) * (b.y - a.y)) / area;
    if (v < 0 || w < 0 || v + w > 1) continue;
    const double z = a.z + v * (b.z - a.z) + w * (c.z - a.z);
    if (!highest || z > *highest) highest = z;
  }
  return highest;
}

bool is_above(Vec3d place, const Object& bed, const Pose& bed_in_world) {
  const Vec3d p = transform(inverse(bed_in_world), place);
  const auto z = height_at(*bed.mesh, p.x, p.y);
  return z && p.z > *z;
}

/// The box along the world axes around the turned box of the object.
Extent box_of(const Object& object, const Pose& in_world) {
  const Extent own = extent_of(*object.mesh);
  Extent box;
  for (int corner = 0; corner < 8; ++corner)
    box.add(
        transform(in_world, Vec3d{(corner & 1) != 0 ? own.low_m.x : own.high_m.x, (corner & 2) != 0 ? own.low_m.y : own.high_m.y,
                                  (corner & 4) != 0 ? own.low_m.z : own.high_m.z}));
  return box;
}

/// The boxes are along the axes of the world. A rotated object has a larger box, so the test may refuse two objects that do not
/// touch.
bool overlap(const Extent& a, const Extent& b) {
  return a.low_m.x < b.high_m.x && b.low_m.x < a.high_m.x && a.low_m.y < b.high_m.y && b.low_m.y < a.high_m.y &&
         a.low_m.z < b.high_m.z && b.low_m.z < a.high_m.z;
}

bool are_in_view(const Constraints& c, const PingRequest& request, const Scene& scene) {
  return std::all_of(c.in_view.begin(), c.in_view.end(), [&](const std::string& name) {
    const auto objects = placed(name, request, scene);
    // A name without visible objects is not a failure, because a draw may hide objects.
    return objects.empty() || std::any_of(objects.begin(), objects.end(),
                                          [&](const auto& o) { return is_in_fan(middle_of(*o.first, o.second), request); });
  });
}

bool are_above_bed(const Constraints& c, const PingRequest& request, const Scene& scene) {
  const auto beds = placed(c.bed, request, scene);
  if (c.above_bed.empty() || beds.empty()) return true;
  const auto& [bed, at] = beds.front();
  return std::all_of(c.above_bed.begin(), c.above_bed.end(), [&, bed = bed, at = at](const std::string& name) {
    if (name == "sonar") return is_above(request.sonar_in_world.position_m, *bed, at);
    const auto objects = placed(name, request, scene);
    return std::all_of(objects.begin(), objects.end(),
                       [&](const auto& o) { return is_above(middle_of(*o.first, o.second), *bed, at); });
  });
}

bool are_apart(const Constraints& c, const PingRequest& request, const Scene& scene) {
  std::vector<Extent> boxes;
  for (const Object& o : scene.objects)
    if (o.visible && std::any_of(c.no_overlap.begin(), c.no_overlap.end(), [&](const auto& name) { return is_named(o, name); }))
      boxes.push_back(box_of(o, scene.in_world(o, request.bodies_in_world)));
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = i + 1; j < boxes.size(); ++j)
      if (overlap(boxes[i], boxes[j])) return false;
  return true;
}

}  // namespace

bool is_named(const Object& object, const std::string& name) {
  return object.name == name || object.label == name || shared_name(object.name) == name;
}

std::set<std::string> names_of(const Scene& scene) {
  std::set<std::string> names;
  for (const Object& o : scene.objects) {
    names.insert({o.name, shared_name(o.name)});
    if (!o.label.empty()) names.insert(o.label);
  }
  return names;
}

std::string why_unknown(const Constraints& c, const std::vector<std::string>& targets, const Scene& scene) {
  const auto known = names_of(scene);
  const std::vector<std::string_view> candidates(known.begin(), known.end());
  const auto ask = [&](const char* key, const std::vector<std::string>& names) -> std::string {
    for (const std::string& name : names)
      if (!known.contains(name) && !(name == "sonar" && std::string_view(key) == "constraints.above_bed"))
        return std::string(key) + ": the scene has no object or label \"" + name + "\"" +
               text::suggestion(name, candidates, "objects and labels");
    return {};
  };
  for (const auto& [key, names] : {std::pair{"constraints.in_view", c.in_view},
                                   {"constraints.above_bed", c.above_bed},
                                   {"constraints.no_overlap", c.no_overlap},
                                   {"dataset.targets", targets}})
    if (std::string why = ask(key, names); !why.empty()) return why;
  return c.bed.empty() ? std::string() : ask("constraints.bed", {c.bed});
}

std::string Unmet::sentence() const {
  std::string text;
  for (const auto& [name, times] : {std::pair{"in_view", in_view}, {"above_bed", above_bed}, {"no_overlap", no_overlap}})
    if (times > 0) text += (text.empty() ? "" : ", ") + std::string(name) + " failed " + std::to_string(times) + " times";
  return text;
}

bool meets(const Constraints& constraints, const PingRequest& request, const Scene& scene, Unmet& unmet) {
  // The first constraint that is not met is counted; the others are not tested.
  if (!are_in_view(constraints, request, scene)) return ++unmet.in_view, false;
  if (!are_above_bed(constraints, request, scene)) return ++unmet.above_bed, false;
  if (!are_apart(constraints, request, scene)) return ++unmet.no_overlap, false;
  return true;
}

}  // namespace sonar::dataset
