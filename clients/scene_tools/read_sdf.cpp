// Gazebo worlds and models: walks the tree of models, places shapes and lists elements that a scene cannot hold.
#include <algorithm>
#include <array>
#include <span>

#include "clients/scene_tools/read_parts.hpp"
#include "clients/scene_tools/sdf_models.hpp"

namespace sonar::scene_tools {
namespace {

bool is_one_of(std::string_view name, std::span<const std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Elements that are not listed as left out: they do not affect a sonar image, or are read elsewhere.
constexpr std::array<std::string_view, 12> quiet_in_world{
    "physics", "scene", "gravity", "magnetic_field", "atmosphere", "wind", "audio", "gui", "name", "joint", "frame", "include"};
constexpr std::array<std::string_view, 9> quiet_in_model{
    "pose", "static", "self_collide", "allow_auto_disable", "enable_wind", "frame", "include", "model", "link"};
constexpr std::array<std::string_view, 9> quiet_in_link{"pose",      "inertial",       "gravity", "enable_wind", "self_collide",
                                                        "kinematic", "velocity_decay", "visual",  "collision"};

class SdfReader {
 public:
  SdfReader(const ReadOptions& options, Findings& findings) : options_(options), findings_(findings) {}

  void read(SdfModel& model, const Pose& in_world) {
    if (findings_.failed()) return;
    list_what_is_left_out(model);
    if (!model.is_world) {
      const std::size_t index = world_.models.size();
      world_.models.push_back({model.path, in_world, model.is_static, model.element.place(), model.source});
      for (const Element& link : model.element.children("link")) read_link(model, link, in_world, index);
    }
    for (const auto& nested : model.nested)
      read(*nested, compose(in_world, model_in_parent(*nested, nested->placing.element.place(), findings_)));
  }

  ImportedWorld world() { return std::move(world_); }

 private:
  void list_what_is_left_out(const SdfModel& model) {
    for (const Element& element : model.element.children()) {
      const std::string_view kind = element.name();
      if (model.is_world) {
        if (is_one_of(kind, quiet_in_world) || kind == "model" || kind == "world") continue;
        if (kind == "light") {
          findings_.leave_out_of_no_echo("light");
          continue;
        }
        if (kind == "spherical_coordinates") {
          findings_.leave_out(element.place(), "spherical_coordinates: in the configuration, world.origin: {lat: " +
                                                   plain(element.child("latitude_deg").text(), 30) +
                                                   ", lon: " + plain(element.child("longitude_deg").text(), 30) + "}");
          continue;
        }
      } else if (kind == "joint") {
        if (element.attribute("type") != "fixed")
          findings_.leave_out(element.place(),
                              called(element) + " (" + plain(element.attribute("type")) + "): stays as it is drawn");
        continue;
      } else if (is_one_of(kind, quiet_in_model)) {
        continue;
      }
      findings_.leave_out(element.place(), called(element));
    }
  }

  void read_link(SdfModel& model, const Element& link, const Pose& model_in_world, std::size_t index) {
    const char* wanted = options_.collisions ? "collision" : "visual";
    const char* other = options_.collisions ? "visual" : "collision";
    for (const Element& element : link.children())
      if (element.name() == "light")
        findings_.leave_out_of_no_echo("light");
      else if (!is_one_of(element.name(), quiet_in_link))
        findings_.leave_out(element.place(), called(element));
    const std::vector<Element> parts = link.children(wanted);
    if (parts.empty() && link.child(other))
      findings_.leave_out(link.place(), called(link) + ": has " + other + " shapes only; --" + other + " imports them");
    if (parts.empty()) return;
    const std::string name(link.attribute("name"));
    const Pose link_in_model = frame_in_model(model, name, link.place(), findings_);
    for (const Element& part : parts) {
      if (findings_.failed()) return;
      const SdfPose given = read_sdf_pose(part.child("pose"), findings_);
      const Pose base =
          given.relative_to.empty() ? link_in_model : frame_in_model(model, given.relative_to, part.place(), findings_);
      Pose offset;
      const auto shape = read_geometry(part.child("geometry"), findings_, offset, Defaults::of_sdf);
      if (!shape) continue;
      const Pose in_world = compose(compose(model_in_world, compose(base, given.pose)), offset);
      const Element material = part.child("material");
      add_shape(world_,
                {.shape = *shape,
                 .in_world = in_world,
                 .model = index,
                 .link = plain(name),
                 .label = plain(part.attribute("name")),
                 .material = plain(material.child("script").child("name").text()),
                 .at = part.place()},
                findings_);
    }
  }

  const ReadOptions& options_;
  Findings& findings_;
  ImportedWorld world_;
};

}  // namespace

Result<ImportedWorld> read_sdf(std::shared_ptr<const XmlFile> file, const Library& library, const ReadOptions& options,
                               Findings& findings) {
  const Element root = file->root();
  const std::vector<Element> worlds = root.children("world");
  for (std::size_t i = 1; i < worlds.size(); ++i)
    findings.leave_out(worlds[i].place(), called(worlds[i]) + ": only the first is read");
  const Element top = worlds.empty() ? root : worlds.front();
  SdfTree tree(library, options, findings);
  const auto root_model = tree.build(top);
  SdfReader reader(options, findings);
  reader.read(*root_model, {});
  if (findings.failed()) return tl::make_unexpected(*findings.error());
  ImportedWorld world = reader.world();
  world.files = tree.included_files();
  world.name = plain(top.attribute("name"));
  if (world.name.empty() && !world.models.empty()) world.name = plain(world.models.front().path);
  world.format = std::string("Gazebo SDF ") + plain(root.attribute("version"), 8);
  return world;
}

}  // namespace sonar::scene_tools
