#include "clients/scene_tools/write_scene.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "core/base/letters.hpp"
#include "core/scene/files/mesh_steps.hpp"

namespace sonar::scene_tools {
namespace {

/// Writes at most six decimals, without trailing zeros.
std::string number(double v) {
  const double rounded = std::round(v * 1e6) / 1e6;
  std::array<char, 64> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), rounded == 0 ? 0.0 : rounded, std::chars_format::fixed).ptr;
  return {text.data(), end};
}
std::string precise(double v) {
  std::array<char, 64> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), v).ptr};
}
std::string triple(Vec3d v) { return std::string("[") + number(v.x) + ", " + number(v.y) + ", " + number(v.z) + "]"; }

/// Returns a YAML scalar that parses to this text: without quotes where that is safe, else in double quotes.
std::string yaml_text(std::string_view text) {
  const auto is_letter = [](char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; };
  const auto is_plain = [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '/' || c == '.';
  };
  static const std::set<std::string> words{"true", "false", "yes", "no", "on", "off", "null", "y", "n", "inf", "nan"};
  if (!text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), is_plain) &&
      !words.contains(small_letters(text)))
    return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

class SceneWriter {
 public:
  SceneWriter(const ImportedWorld& world, const WriteOptions& options) : world_(world), options_(options) {
    for (const PlacedShape& shape : world.shapes) ++shapes_of_model_[shape.model], ++shapes_of_link_[{shape.model, shape.link}];
    for (std::size_t m = 0; m < world.models.size(); ++m) {
      if (is_moving(world.models[m].path)) carriers_[m] = {};
      links_of_model_.push_back(0);
    }
    for (const auto& [key, count] : shapes_of_link_) ++links_of_model_[key.first];
    // Poses are sent to the names of moving models, so these names are reserved before those of other objects.
    for (auto& [m, carrier] : carriers_) carrier.name = unique(world.models[m].path);
  }

  std::string write(const std::vector<std::string>& left_out) {
    head(left_out);
    out_ += std::string("name: ") + yaml_text(plain(world_.name.empty() ? "imported" : world_.name)) + "\n";
    out_ += std::string("objects:") + std::string(world_.shapes.empty() && carriers_.empty() ? " []" : "") + "\n";
    for (std::size_t m = 0; m < world_.models.size(); ++m) write_model(m);
    return std::move(out_);
  }

 private:
  struct Carrier {
    std::string name;
  };
  using Key = std::pair<std::size_t, std::string>;

  bool is_moving(const std::string& path) const {
    return std::find(options_.moving.begin(), options_.moving.end(), path) != options_.moving.end();
  }

  void comment(const std::string& text) { out_ += std::string("# ") + text + "\n"; }

  void head(const std::vector<std::string>& left_out) {
    comment(std::string("From ") + world_.format +
            (options_.command.empty() ? "" : std::string(": ") + plain(options_.command, 400)));
    comment("z = 0 is the water's surface. Where the source names no known material, the material is a guess:");
    comment("docs/scenes.md, \"Materials\".");
    std::string loose;
    for (std::size_t m = 0; m < world_.models.size(); ++m)
      if (!world_.models[m].is_static && !is_part_of_moving(m) && shapes_of_model_[m] > 0 && loose.size() < 300)
        loose += (loose.empty() ? "" : ", ") + plain(world_.models[m].path);
    if (!loose.empty())
      comment(std::string("Not static in the source, but fixed in this scene (--moving MODEL makes one move): ") + loose);
    if (left_out.empty()) return;
    comment("Left out:");
    constexpr std::size_t most = 60;
    for (std::size_t i = 0; i < std::min(most, left_out.size()); ++i) comment(std::string("  ") + plain(left_out[i], 400));
    if (left_out.size() > most) comment(std::string("  and ") + std::to_string(left_out.size() - most) + " more");
  }

  /// Returns the index of the innermost moving model that is m or contains m; the number of models if there is none.
  std::size_t carrier_of(std::size_t m) const {
    std::size_t best = world_.models.size(), length = 0;
    for (const auto& [c, unused] : carriers_) {
      const std::string& path = world_.models[c].path;
      const std::string& mine = world_.models[m].path;
      const bool inside = m == c || (mine.starts_with(path + "/") && m > c);
      if (inside && path.size() >= length) best = c, length = path.size();
    }
    return best;
  }
  bool is_part_of_moving(std::size_t m) const { return carrier_of(m) < world_.models.size(); }

  void write_model(std::size_t m) {
    const bool moves = carriers_.contains(m);
    if (shapes_of_model_[m] == 0 && !moves) return;
    out_ += std::string("  # ") + plain(world_.models[m].path, 200) + " (" + plain(world_.models[m].at.short_text(), 200) + ")\n";
    bool carried = false;
    for (const PlacedShape& shape : world_.shapes) {
      if (shape.model != m) continue;
      const bool is_itself = moves && !carried && at_rest_in(shape, world_.models[m].in_world);
      if (moves && !carried && !is_itself) write_carrier(m);
      carried = true;
      write_shape(shape, is_itself);
    }
    if (moves && !carried) write_carrier(m);
  }

  static bool at_rest_in(const PlacedShape& shape, const Pose& model) {
    const Pose in_model = compose(inverse(model), shape.in_world);
    return length(in_model.position_m) < 1e-9 && std::abs(std::abs(in_model.orientation.w) - 1) < 1e-12;
  }

  /// Writes an invisible object without an echo, because poses address a body by the name of an object.
  void write_carrier(std::size_t m) {
    out_ += std::string("  - {name: ") + yaml_text(carriers_[m].name) +
            ", type: sphere, radius_m: 0.01, segments: 8, material: plastic, visible: false, "
            "moving: true" +
            pose_text(moved(world_.models[m].in_world)) + "}  # invisible; the shapes of the model are attached to it\n";
  }

  Pose moved(Pose pose) const {
    pose.position_m = pose.position_m + options_.offset_m;
    return pose;
  }

  static std::string pose_text(const Pose& pose) {
    const Vec3d rpy = rpy_deg_from(pose.orientation);
    const std::string angles = triple(rpy);
    return ", pose: {xyz_m: " + triple(pose.position_m) + (angles == "[0, 0, 0]" ? "" : std::string(", rpy_deg: ") + angles) +
           "}";
  }

  std::string unique(const std::string& wanted) {
    std::string name = plain(wanted);
    if (name.empty()) name = "object";
    int& last = last_number_[name];
    while (!names_.insert(name).second) {
      std::string tail = std::to_string(std::max(++last, 2));
      last = std::max(last, 2);
      tail.insert(tail.begin(), ' ');
      name = plain(wanted, 64 - tail.size()) + tail;
    }
    return name;
  }

  std::string name_of(const PlacedShape& shape) {
    std::string name = world_.models[shape.model].path;
    const auto add = [&](const std::string& part) { name += (name.empty() ? "" : "/") + part; };
    if (links_of_model_[shape.model] > 1) add(shape.link);
    if (shapes_of_link_[{shape.model, shape.link}] > 1) add(shape.label.empty() ? "part" : shape.label);
    if (name.size() > 64) name = std::string("...") + plain(std::string_view(name).substr(name.size() - 61), 61);
    return unique(name);
  }

  void write_shape(const PlacedShape& shape, bool is_itself) {
    const std::size_t carrier = carrier_of(shape.model);
    const bool attached = carrier < world_.models.size();
    out_ += std::string("  - {name: ") + yaml_text(is_itself ? carriers_[shape.model].name : name_of(shape)) + shape_text(shape);
    if (is_itself)
      out_ += std::string(", moving: true") + pose_text(moved(shape.in_world));
    else if (attached)
      out_ += std::string(", attached_to: ") + yaml_text(carriers_[carrier].name) +
              pose_text(compose(inverse(world_.models[carrier].in_world), shape.in_world));
    else
      out_ += pose_text(moved(shape.in_world));
    out_ += "}\n";
  }

  static std::string patch(double longest_m) {
    return longest_m > 100 ? std::string(", patch_m: ") + number(std::ceil(longest_m / 100)) : "";
  }

  static std::string shape_text(const PlacedShape& placed) {
    const Shape& s = placed.shape;
    const std::string material = std::string(", material: ") + yaml_text(placed.material);
    const std::string radius = std::string(", radius_m: ") + number(s.radius_m),
                      length = std::string(", length_m: ") + number(s.length_m);
    switch (s.kind) {
      case Shape::Kind::box:
        return ", type: box" + material + ", size_m: " + triple(s.size_m) + patch(std::max({s.size_m.x, s.size_m.y, s.size_m.z}));
      case Shape::Kind::sphere:
        return ", type: sphere" + material + radius;
      case Shape::Kind::ellipsoid:
        return ", type: rock, bumpiness: 0" + material + ", size_m: " + triple(s.size_m);
      case Shape::Kind::cylinder:
        return ", type: cylinder" + material + radius + length;
      case Shape::Kind::capsule:
        return ", type: capsule" + material + radius + length;
      case Shape::Kind::cone:
        return ", type: cone" + material + radius + length;
      case Shape::Kind::plane:
        return ", type: plane" + material + ", size_m: [" + number(s.size_m.x) + ", " + number(s.size_m.y) + "]" +
               patch(std::max(s.size_m.x, s.size_m.y));
      case Shape::Kind::mesh: {
        const double scale = s.scale.x;  // z is up as in Gazebo and RViz
        return ", type: mesh, file: " + yaml_text(s.uri) + material +
               (scale == 1 ? "" : std::string(", scale: ") + precise(scale)) +
               (is_y_up_by_default(mesh_extension(s.uri)) ? ", up: z" : "");
      }
      case Shape::Kind::heightmap:
        return ", type: heightmap, file: " + yaml_text(s.uri) + material + ", size_m: [" + number(s.size_m.x) + ", " +
               number(s.size_m.y) + "], height_m: [0, " + number(s.size_m.z) + "]";
    }
    return {};
  }

  const ImportedWorld& world_;
  const WriteOptions& options_;
  std::string out_;
  std::set<std::string> names_;
  std::map<std::string, int> last_number_;  // highest number appended so far to a name in use
  std::map<std::size_t, std::size_t> shapes_of_model_;
  std::map<Key, std::size_t> shapes_of_link_;
  std::vector<std::size_t> links_of_model_;
  std::map<std::size_t, Carrier> carriers_;
};

}  // namespace

Vec3d rpy_deg_from(const Quatd& q) {
  RollPitchYaw a = rpy_from_quat(q);
  if (std::abs(2 * (q.w * q.y - q.z * q.x)) > 1 - 1e-12) {  // roll and yaw turn about the same axis: roll is 0
    const Vec3d port = rotate(q, Vec3d{0, 1, 0});
    a.roll_rad = 0;
    a.yaw_rad = std::atan2(-port.x, port.y);
  }
  return {deg_from_rad(a.roll_rad), deg_from_rad(a.pitch_rad), deg_from_rad(a.yaw_rad)};
}

std::vector<std::string> unknown_models(const ImportedWorld& world, const std::vector<std::string>& moving) {
  std::vector<std::string> unknown;
  for (const std::string& path : moving)
    if (std::none_of(world.models.begin(), world.models.end(), [&](const ImportedModel& m) { return m.path == path; }))
      unknown.push_back(path);
  return unknown;
}

std::string scene_text(const ImportedWorld& world, const std::vector<std::string>& left_out, const WriteOptions& options) {
  return SceneWriter(world, options).write(left_out);
}

}  // namespace sonar::scene_tools
