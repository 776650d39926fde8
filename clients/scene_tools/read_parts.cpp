#include "clients/scene_tools/read_parts.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace sonar::scene_tools {
namespace {

constexpr double least_m = 1e-4, most_m = 1e5;  // limits for a length in a scene

/// Reads one element of geometry. A value is a child element in SDF (<size>..</size>), and an attribute in URDF (size="..").
class GeometryReader {
 public:
  GeometryReader(const Element& element, Findings& findings, Defaults defaults)
      : element_(element), findings_(findings), defaults_(defaults) {}

  bool has(const char* key) const { return !text_of(key).empty(); }
  std::string_view text_of(const char* key) const {
    const std::string_view attribute = element_.attribute(key);
    return attribute.empty() ? element_.child(key).text() : attribute;
  }
  std::vector<double> numbers(const char* key, std::size_t count) {
    const Element child = element_.child(key);
    return read_numbers(text_of(key), count, (child ? child : element_).place(), std::string(element_.name()) + " " + key,
                        findings_);
  }
  double length(const char* key, const char* otherwise) { return checked(numbers_or(key, 1, otherwise)[0], key); }
  Vec3d lengths(const char* key) {
    const auto v = numbers_or(key, 3, "1 1 1");
    return {checked(v[0], key), checked(v[1], key), checked(v[2], key)};
  }
  /// Without the key, the default of the SDF specification is used, as in Gazebo; URDF has none.
  std::vector<double> numbers_or(const char* key, std::size_t count, const char* otherwise) {
    if (defaults_ == Defaults::none || element_.child(key) || has(key)) return numbers(key, count);
    findings_.leave_out(element_.place(), std::string(key) + " of " + std::string(element_.name()) +
                                              ": missing; SDF's default is used, " + otherwise + " m");
    return read_numbers(otherwise, count, element_.place(), key, findings_);
  }
  double checked(double v, const char* key) {
    if (v > 0 && v <= most_m) return std::max(v, least_m);
    if (why_not_.empty()) why_not_ = std::string(key) + " must be greater than 0 and at most 100 km";
    return 1;
  }
  void refuse(std::string why) { why_not_ = std::move(why); }
  /// Returns the shape. If a value was invalid, returns nothing and lists the element as left out.
  std::optional<Shape> finish(const Shape& shape) {
    if (findings_.failed()) return std::nullopt;
    if (why_not_.empty()) return shape;
    findings_.leave_out(element_.place(), std::string(element_.name()) + ": " + why_not_);
    return std::nullopt;
  }

 private:
  Element element_;
  Findings& findings_;
  Defaults defaults_;
  std::string why_not_;
};

/// Returns the shortest rotation from z to `direction`.
Quatd turned_to(Vec3d direction) {
  const Vec3d n = (1 / length(direction)) * direction;
  if (n.z < -1 + 1e-12) return {0, 1, 0, 0};
  return normalized(Quatd{1 + n.z, -n.y, n.x, 0});
}

Shape read_plane(GeometryReader& in, Pose& offset) {
  Shape shape{.kind = Shape::Kind::plane};
  if (in.has("normal")) {
    const auto n = in.numbers("normal", 3);
    const Vec3d normal{n[0], n[1], n[2]};
    if (length(normal) > 1e-9)
      offset.orientation = turned_to(normal);
    else
      in.refuse("its normal has no length");
  }
  shape.size_m = {100, 100, 0};  // the default, because collision planes of SDF are infinite
  if (in.has("size")) {
    const auto size = in.numbers("size", 2);
    shape.size_m = {in.checked(size[0], "size"), in.checked(size[1], "size"), 0};
  }
  return shape;
}

Shape read_mesh(const Element& element, GeometryReader& in) {
  Shape shape{.kind = Shape::Kind::mesh};
  shape.uri = in.text_of(element.attribute("filename").empty() ? "uri" : "filename");
  if (in.has("scale")) {
    const auto s = in.numbers("scale", 3);
    shape.scale = {s[0], s[1], s[2]};
  }
  if (const Element submesh = element.child("submesh")) {
    shape.part = plain(submesh.child("name").text(), 500);
    const std::string_view centred = submesh.child("center").text();
    shape.is_centred = centred == "true" || centred == "1";
    if (shape.part.empty()) in.refuse("its submesh has no name");
  }
  const double least = std::min({std::abs(shape.scale.x), std::abs(shape.scale.y), std::abs(shape.scale.z)});
  if (shape.uri.empty()) in.refuse("names no file");
  if (!(least > 0)) in.refuse("its scale is 0");
  return shape;
}

Shape read_heightmap(GeometryReader& in, Pose& offset) {
  Shape shape{.kind = Shape::Kind::heightmap, .size_m = {1, 1, 1}};
  shape.uri = in.text_of("uri");
  if (in.has("size"))
    shape.size_m = in.lengths("size");
  else
    in.refuse("has no size");
  if (in.has("pos")) {
    const auto p = in.numbers("pos", 3);
    offset.position_m = {p[0], p[1], p[2]};
  }
  if (shape.uri.empty()) in.refuse("names no file");
  return shape;
}

}  // namespace

std::string called(const Element& element) {
  const std::string_view name = element.attribute("name");
  return plain(element.name()) + (name.empty() ? std::string() : std::string(" \"") + plain(name) + "\"");
}

std::optional<Shape> read_geometry(const Element& geometry, Findings& findings, Pose& offset, Defaults defaults) {
  for (const Element& element : geometry.children()) {
    GeometryReader in(element, findings, defaults);
    const std::string_view kind = element.name();
    const auto round = [&](Shape::Kind of, const char* otherwise) {
      return Shape{.kind = of, .radius_m = in.length("radius", otherwise)};
    };
    const auto long_one = [&](Shape::Kind of, const char* otherwise) {
      Shape shape = round(of, otherwise);
      shape.length_m = in.length("length", "1");
      return shape;
    };
    if (kind == "box") return in.finish({.kind = Shape::Kind::box, .size_m = in.lengths("size")});
    if (kind == "sphere") return in.finish(round(Shape::Kind::sphere, "1"));
    if (kind == "ellipsoid") {
      const Vec3d d = 2.0 * in.lengths("radii");
      return in.finish({.kind = Shape::Kind::ellipsoid,
                        .size_m = {in.checked(d.x, "radii"), in.checked(d.y, "radii"), in.checked(d.z, "radii")}});
    }
    if (kind == "cylinder") return in.finish(long_one(Shape::Kind::cylinder, "1"));
    if (kind == "capsule") return in.finish(long_one(Shape::Kind::capsule, "0.5"));
    if (kind == "cone") return in.finish(long_one(Shape::Kind::cone, "1"));
    if (kind == "plane") return in.finish(read_plane(in, offset));
    if (kind == "mesh") return in.finish(read_mesh(element, in));
    if (kind == "heightmap") return in.finish(read_heightmap(in, offset));
    if (kind != "empty")
      findings.leave_out(element.place(), std::string("geometry ") + plain(kind) + ": scenes have no such shape");
    return std::nullopt;
  }
  return std::nullopt;
}

void add_shape(ImportedWorld& world, PlacedShape shape, Findings& findings) {
  const Vec3d p = shape.in_world.position_m;
  if (world.shapes.size() >= max_shapes)
    return findings.fail(shape.at, std::string("more than ") + std::to_string(max_shapes) + " shapes, the limit of a scene");
  if (!is_finite(p) || !is_finite(shape.in_world.orientation) || length(p) > 1e7)
    return findings.fail(shape.at, "lies farther than 10 000 km from the origin of the world");
  world.shapes.push_back(std::move(shape));
}

Result<ImportedWorld> read_world(std::string_view text, const std::filesystem::path& path, const Library& library,
                                 const ReadOptions& options, Findings& findings) {
  auto file = parse_xml(text, path, path.filename().string());
  if (!file) return tl::make_unexpected(file.error());
  const Element root = (*file)->root();
  Result<ImportedWorld> world;
  if (root.name() == "sdf") {
    world = read_sdf(*file, library, options, findings);
  } else if (root.name() == "robot") {
    world = read_urdf(**file, options, findings);
  } else {
    std::string what = "the root element of the file is neither <sdf> nor <robot> (URDF), but ";
    what += plain(root.name());
    if (root.name() == "gazebo") what += "; convert this old world with: gz sdf -p";
    findings.fail(root.place(), what);
  }
  if (findings.failed()) return tl::make_unexpected(*findings.error());
  world->files.push_back(*file);
  return world;
}

// Robots in URDF: links attached by joints, every joint at zero; the root link is at the world's origin.

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
    if (ready.size() > 1)
      return findings_.fail(root_.place(),
                            "links \"" + plain(ready[0]) + "\" and \"" + plain(ready[1]) +
                                "\" are the children of no joint, but a robot has one root; attach one with a joint");
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
