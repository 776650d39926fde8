// Robots in URDF: links attached by joints, every joint at zero; the root link is at the world's origin.
#include <map>
#include <set>

#include "clients/scene_tools/read_parts.hpp"

namespace sonar::scene_tools {
namespace {

Pose read_origin(const Element& element, Findings& findings) {
  Pose pose;
  const Element origin = element.child("origin");
  const auto three = [&](const char* key) {
    const std::string_view text = origin.attribute(key);
    return text.empty() ? std::vector<double>(3, 0.0)
                        : read_numbers(text, 3, origin.place(), std::string("origin ") + key, findings);
  };
  const auto xyz = three("xyz"), rpy = three("rpy");
  pose.position_m = {xyz[0], xyz[1], xyz[2]};
  pose.orientation = quat_from_rpy({rpy[0], rpy[1], rpy[2]});
  return pose;
}

class UrdfReader {
 public:
  UrdfReader(const XmlFile& file, const ReadOptions& options, Findings& findings)
      : root_(file.root()), options_(options), findings_(findings) {}

  ImportedWorld read() {
    world_.name = plain(root_.attribute("name"));
    world_.format = "URDF";
    world_.models.push_back({world_.name.empty() ? "robot" : world_.name, {}, false, root_.place()});
    refuse_xacro(root_);
    for (const Element& element : root_.children()) sort(element);
    hang_links();
    for (const Element& link : root_.children("link")) read_link(link);
    return std::move(world_);
  }

 private:
  struct Joint {
    Element element;
    std::string parent, child;
  };

  void refuse_xacro(const Element& element) {
    if (element.name().starts_with("xacro:"))
      return findings_.fail(element.place(), "this is xacro, not yet URDF; expand it first: xacro FILE.xacro > FILE.urdf");
    for (const Element& child : element.children()) refuse_xacro(child);
  }

  void sort(const Element& element) {
    const std::string_view kind = element.name();
    if (kind == "link") {
      if (!links_.insert(std::string(element.attribute("name"))).second)
        findings_.fail(element.place(), called(element) + ": the name is used twice");
    } else if (kind == "joint") {
      read_joint(element);
    } else if (kind != "material") {
      findings_.leave_out(element.place(), called(element));
    }
  }

  void read_joint(const Element& element) {
    const Joint joint{element, std::string(element.child("parent").attribute("link")),
                      std::string(element.child("child").attribute("link"))};
    if (element.child("parent").attribute("link").empty() || joint.child.empty()) {
      if (element.child("parent") || element.child("child"))
        findings_.fail(element.place(), called(element) + ": needs <parent link=\"..\"/> and <child link=\"..\"/>");
      return;  // joints inside transmissions have no parent and no child
    }
    const std::string_view type = element.attribute("type");
    if (type != "fixed") findings_.leave_out(element.place(), called(element) + " (" + plain(type) + "): stays at zero");
    if (!joint_of_.try_emplace(joint.child, joints_.size()).second)
      return findings_.fail(element.place(), std::string("link \"") + plain(joint.child) + "\" is the child of two joints");
    children_[joint.parent].push_back(joints_.size());
    joints_.push_back(joint);
  }

  /// Places the links, from the root links outwards.
  void hang_links() {
    for (const Joint& joint : joints_)
      for (const std::string& end : {joint.parent, joint.child})
        if (!links_.contains(end))
          return findings_.fail(joint.element.place(), called(joint.element) + ": no link \"" + plain(end) + "\"");
    std::vector<std::string> ready;
    for (const std::string& link : links_)
      if (!joint_of_.contains(link)) in_world_[link] = Pose{}, ready.push_back(link);
    while (!ready.empty()) {
      const std::string link = ready.back();
      ready.pop_back();
      for (const std::size_t j : children_[link]) {
        const Joint& joint = joints_[j];
        in_world_[joint.child] = compose(in_world_[link], read_origin(joint.element, findings_));
        ready.push_back(joint.child);
      }
    }
    for (const Joint& joint : joints_)
      if (!in_world_.contains(joint.child))
        return findings_.fail(joint.element.place(), called(joint.element) + ": the joints form a circle");
  }

  void read_link(const Element& link) {
    const char* wanted = options_.collisions ? "collision" : "visual";
    const char* other = options_.collisions ? "visual" : "collision";
    const std::vector<Element> parts = link.children(wanted);
    if (parts.empty() && link.child(other))
      findings_.leave_out(link.place(), called(link) + ": has " + other + " shapes only; --" + other + " imports them");
    const std::string name(link.attribute("name"));
    for (const Element& part : parts) {
      if (findings_.failed()) return;
      Pose offset;
      const auto shape = read_geometry(part.child("geometry"), findings_, offset, Defaults::none);
      if (!shape) continue;
      add_shape(world_,
                {.shape = *shape,
                 .in_world = compose(compose(in_world_[name], read_origin(part, findings_)), offset),
                 .link = plain(name),
                 .label = plain(part.attribute("name")),
                 .material = plain(part.child("material").attribute("name")),
                 .at = part.place()},
                findings_);
    }
  }

  Element root_;
  const ReadOptions& options_;
  Findings& findings_;
  ImportedWorld world_;
  std::set<std::string> links_;
  std::vector<Joint> joints_;
  std::map<std::string, std::size_t> joint_of_;               // index of a joint by its child link
  std::map<std::string, std::vector<std::size_t>> children_;  // indices of joints by their parent link
  std::map<std::string, Pose> in_world_;
};

}  // namespace

Result<ImportedWorld> read_urdf(const XmlFile& file, const ReadOptions& options, Findings& findings) {
  ImportedWorld world = UrdfReader(file, options, findings).read();
  if (findings.failed()) return tl::make_unexpected(*findings.error());
  return world;
}

}  // namespace sonar::scene_tools
