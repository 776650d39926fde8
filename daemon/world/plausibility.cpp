#include "daemon/world/plausibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "core/motion/trajectory_file.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

using text::format;

constexpr double turned_over = -0.5;  // the z axis points down, by more than 30 deg below the horizon
constexpr double tilted = 0.5;        // it is further than 60 deg from upright
constexpr double whole_turn_rad = 2 * pi;
constexpr double ground_flatness = 0.05;  // height over width: what is flatter is ground, which may be long
constexpr double long_ranges = 5;         // lengths of the longest range that an object may have

// Each cure is one kind of note: a kind is told once.
constexpr const char* surface_cure =
    "was NED taken for ENU, or the reverse? ENU_FLU counts z upwards, NED_FRD downwards: 3 m deep is z = -3 in the one and z = 3 "
    "in the other; say the frame that was sent";
constexpr const char* exchanged_cure = "with x and y exchanged it would be in the scene: ENU_FLU has east first, NED_FRD north";
constexpr const char* far_cure =
    "positions are metres from the world's 0, 0, 0: see the unit and the origin that they are sent in";
constexpr const char* turned_cure =
    "see the order of the quaternion (JSON and EuRoC: w first; TUM and ROS: w last), the unit of angles (JSON: radians), and the "
    "body's axes (FLU: z up; FRD: z down)";
constexpr const char* order_cure =
    "write w where the format has it: last in a TUM line (t x y z qx qy qz qw), first in one of EuRoC";
constexpr const char* angle_cure = "angles are radians there: were degrees sent? Multiply them by 0.0174533";
constexpr const char* mount_cure =
    "rpy_deg is [roll, pitch, yaw]: a roll near 180, or a pitch beyond 90, turns it over and swaps port and starboard; to look "
    "aft, set yaw 180";
constexpr const char* lift_cure = "move the scene down: sonarctl scene import --offset 0,0,-10, or the poses of its objects";

/// How far up the body's z axis points, -1 to 1.
double upright(Quatd q) { return 1 - 2 * (q.x * q.x + q.y * q.y); }

struct Doubt {
  std::string text;
  const char* cure;
};

std::optional<Doubt> doubt_of_place(const std::string& vehicle, Vec3d sonar_m, const Surroundings& around) {
  const Extent& scene = around.scene;
  const std::string subject = "the sonar of " + vehicle;
  const bool lies_above = !scene.empty() && scene.low_m.z >= 0;  // then the scene is what is wrong
  if (sonar_m.z > 0 && !lies_above)
    return Doubt{subject + format(" is %.1f m above the water's surface (z = 0)", sonar_m.z), surface_cure};
  if (scene.empty()) return std::nullopt;
  const bool within = scene.distance_m({sonar_m.x, sonar_m.y, scene.low_m.z}) == 0;
  if (within && sonar_m.z < scene.low_m.z)
    return Doubt{
        subject + format(" is %.1f m below the lowest point of the scene (z = %.1f)", scene.low_m.z - sonar_m.z, scene.low_m.z),
        surface_cure};
  const double away_m = scene.distance_m(sonar_m);
  if (away_m <= around.longest_range_m) return std::nullopt;
  const bool exchanged = scene.distance_m({sonar_m.y, sonar_m.x, sonar_m.z}) <= around.longest_range_m;
  return Doubt{subject + format(" is %.0f m from everything in the scene, and hears no further than %.0f m", away_m,
                                around.longest_range_m),
               exchanged ? exchanged_cure : far_cure};
}

std::optional<Doubt> doubt_of_place(const Carrier& carrier, const Pose& vehicle_in_world, const Surroundings& around) {
  for (const Pose& mount : carrier.mounts)
    if (auto doubt = doubt_of_place(carrier.vehicle, compose(vehicle_in_world, mount).position_m, around)) return doubt;
  return std::nullopt;
}

std::optional<Doubt> doubt_of_attitude(const std::string& body, Quatd q) {
  const double up = upright(q);
  if (up > turned_over) return std::nullopt;
  return Doubt{body + format(" is upside down, %.0f deg from upright", deg_from_rad(std::acos(std::clamp(up, -1.0, 1.0)))),
               turned_cure};
}

/// As if the file had w at the other end of the four numbers, and in the frame that they were written in.
bool is_upright_in_another_order(Quatd q) {
  const auto reordered = [](Quatd r) { return std::array{upright({r.x, r.y, r.z, r.w}), upright({r.z, r.w, r.x, r.y})}; };
  const auto as_enu = reordered(q), as_ned = reordered(enu_flu_from_ned_frd(q));
  return std::max({as_enu[0], as_enu[1], as_ned[0], as_ned[1]}) > tilted;
}

/// CSV files name their columns and KITTI's have matrices: only here can w stand at the wrong end. `about` begins with the
/// format.
bool has_nameless_quaternions(const motion::Plan& plan) {
  const auto is = [&](motion::Format format) {
    return plan.about.starts_with((plan.file + ": ").append(name_of(format)).append(","));
  };
  return is(motion::Format::tum) || is(motion::Format::euroc);
}

/// Tilted where nothing that carries a sonar is, and upright with the numbers in another order.
bool is_out_of_order(const std::vector<Pose>& poses) {
  std::size_t lying = 0, explained = 0;
  for (const Pose& p : poses) {
    const bool lies = upright(p.orientation) < tilted;
    lying += lies ? 1 : 0;
    explained += lies && is_upright_in_another_order(p.orientation) ? 1 : 0;
  }
  return 10 * lying >= poses.size() && 100 * explained >= 99 * lying;
}

/// The first doubt there is along the way, and of how many poses.
std::optional<Doubt> doubt_of_all(const motion::Plan& plan, const std::function<std::optional<Doubt>(const Pose&)>& doubt_of) {
  std::optional<Doubt> first;
  std::size_t count = 0;
  const std::vector<Pose>& poses = plan.trajectory->points().poses;
  for (const Pose& p : poses)
    if (auto doubt = doubt_of(p)) {
      ++count;
      if (!first) first = std::move(doubt);
    }
  if (first) first->text += format(", in %zu of %zu poses of ", count, poses.size()) + plan.file;
  return first;
}

void add(std::vector<Note>& notes, const std::string& vehicle, const std::optional<Doubt>& doubt) {
  if (doubt) notes.push_back({vehicle, doubt->text, doubt->cure});
}
void add(std::vector<Note>& notes, std::vector<Note> more) { std::move(more.begin(), more.end(), std::back_inserter(notes)); }

Extent in_world(const Extent& own, const Pose& place) {
  Extent out;
  if (own.empty()) return out;
  for (const double x : {own.low_m.x, own.high_m.x})
    for (const double y : {own.low_m.y, own.high_m.y})
      for (const double z : {own.low_m.z, own.high_m.z}) out.add(transform(place, {x, y, z}));
  return out;
}

}  // namespace

std::string text_of(const Note& note) { return note.text + (note.cure.empty() ? "" : "; " + note.cure); }

Surroundings surroundings_of(const Config& config, const Scene& scene) {
  Surroundings around;
  std::map<const Mesh*, Extent> known;  // instances share their mesh
  for (const Object& o : scene.objects) {
    if (!o.visible) continue;
    const auto [own, is_new] = known.try_emplace(o.mesh.get());
    if (is_new) own->second = extent_of(*o.mesh);
    around.scene.add(in_world(own->second, o.in_world));
  }
  for (const PointTarget& p : scene.point_targets) around.scene.add(scene.in_world(p, scene.bodies_in_world));
  for (const SonarConfig& s : config.sonars)
    for (const FrequencyMode& mode : s.profile.model->modes)
      around.longest_range_m = std::max(around.longest_range_m, static_cast<double>(mode.max_range_m));
  return around;
}

std::vector<Carrier> carriers_of(const Config& config) {
  std::vector<Carrier> carriers;
  for (std::size_t v = 0; v < config.vehicles.size(); ++v) {
    Carrier& carrier = carriers.emplace_back(Carrier{config.vehicles[v].name, {}});
    for (const SonarConfig& s : config.sonars)
      if (s.vehicle == v) carrier.mounts.push_back(s.mount);
  }
  return carriers;
}

std::vector<Note> notes_on_mounts(const Config& config) {
  std::vector<Note> notes;
  for (const SonarConfig& s : config.sonars)
    if (upright(s.mount.orientation) < turned_over)
      notes.push_back({"", "sonar " + s.name + " is mounted upside down on " + config.vehicles.at(s.vehicle).name, mount_cure});
  return notes;
}

std::vector<Note> notes_on_scene(const Scene& scene, const Surroundings& around) {
  std::vector<Note> notes;
  if (!around.scene.empty() && around.scene.low_m.z >= 0)
    notes.push_back({"", "nothing of the scene lies below the water's surface, z = 0", lift_cure});
  const double allowed_m = std::max(huge_mesh_m, long_ranges * around.longest_range_m);
  std::set<const Mesh*> seen;
  for (const Object& o : scene.objects) {
    if (!o.visible || o.primitive.kind == Primitive::Kind::plane || !seen.insert(o.mesh.get()).second) continue;
    const Extent own = extent_of(*o.mesh);
    const Vec3d size = own.size_m();
    const bool is_ground = size.z < ground_flatness * std::min(size.x, size.y);
    if (own.longest_m() <= allowed_m || is_ground) continue;
    notes.push_back(
        {"", o.name + format(" is %.0f m long, and no sonar hears further than %.0f m", own.longest_m(), around.longest_range_m),
         std::string(huge_mesh_cure)});
  }
  return notes;
}

std::vector<Note> notes_on_pose(const Carrier& carrier, const Pose& vehicle_in_world, const Surroundings& around) {
  std::vector<Note> notes;
  add(notes, carrier.vehicle, doubt_of_place(carrier, vehicle_in_world, around));
  add(notes, carrier.vehicle, doubt_of_attitude(carrier.vehicle, vehicle_in_world.orientation));
  return notes;
}

std::vector<Note> notes_on_angles(const std::string& vehicle, double largest_angle_rad) {
  if (!(largest_angle_rad > whole_turn_rad)) return {};
  return {{vehicle, "the attitude of " + vehicle + format(" has an angle of %.4g rad", largest_angle_rad), angle_cure}};
}

std::vector<Note> notes_on_trajectory(const Carrier& carrier, const motion::Plan& plan, const Surroundings& around) {
  std::vector<Note> notes;
  add(notes, carrier.vehicle, doubt_of_all(plan, [&](const Pose& p) { return doubt_of_place(carrier, p, around); }));
  if (has_nameless_quaternions(plan) && is_out_of_order(plan.trajectory->points().poses))
    add(notes, carrier.vehicle,
        Doubt{"the quaternions of " + plan.file + " turn " + carrier.vehicle + " over, and would not with w at the other end",
              order_cure});
  else
    add(notes, carrier.vehicle,
        doubt_of_all(plan, [&](const Pose& p) { return doubt_of_attitude(carrier.vehicle, p.orientation); }));
  return notes;
}

std::vector<Note> notes_on(const Config& config, const Scene& scene, const Surroundings& around) {
  const std::vector<Carrier> carriers = carriers_of(config);
  std::vector<Note> notes = notes_on_mounts(config);
  add(notes, notes_on_scene(scene, around));
  for (std::size_t v = 0; v < carriers.size(); ++v) {
    const VehicleConfig& vehicle = config.vehicles[v];
    add(notes, vehicle.plan ? notes_on_trajectory(carriers[v], vehicle.plan, around)
                            : notes_on_pose(carriers[v], vehicle.initial_pose, around));
  }
  for (const ObjectConfig& o : config.objects)
    if (o.plan)
      for (Note& n : notes_on_trajectory({o.name, {}}, o.plan, around)) notes.push_back({"", n.text, n.cure});
  return notes;
}

// ---- of a running daemon

std::vector<Note> Plausibility::untold(const std::vector<Note>& notes) {
  std::vector<Note> fresh;
  for (const Note& n : notes)
    if (told_.insert(n.vehicle.empty() ? n.text : n.vehicle + "|" + n.cure).second) fresh.push_back(n);
  return fresh;
}

std::vector<Note> Plausibility::use(const Config& config, const Scene& scene) {
  around_ = surroundings_of(config, scene);
  carriers_ = carriers_of(config);
  of_setup_ = notes_on(config, scene, around_);
  std::erase_if(of_poses_, [this](const auto& of_pose) {
    return std::none_of(carriers_.begin(), carriers_.end(), [&](const Carrier& c) { return c.vehicle == of_pose.first; });
  });
  return untold(of_setup_);
}

std::vector<Note> Plausibility::use(const control::PoseSample& sample) {
  const auto carrier = std::find_if(carriers_.begin(), carriers_.end(), [&](const Carrier& c) {
    return c.vehicle == sample.name || sample.name.empty();  // it is the only one then
  });
  if (carrier == carriers_.end()) return {};
  std::vector<Note>& notes = of_poses_[carrier->vehicle];
  notes = notes_on_pose(*carrier, sample.pose, around_);
  if (auto degrees = notes_on_angles(carrier->vehicle, sample.largest_angle_rad); !degrees.empty()) {
    std::erase_if(notes, [](const Note& n) { return n.cure == turned_cure; });  // it follows from that
    add(notes, std::move(degrees));
  }
  return notes.empty() ? notes : untold(notes);
}

std::vector<Note> Plausibility::all() const {
  std::vector<Note> notes;
  std::copy_if(of_setup_.begin(), of_setup_.end(), std::back_inserter(notes),
               [this](const Note& n) { return !of_poses_.contains(n.vehicle); });
  for (const auto& [vehicle, of_pose] : of_poses_) notes.insert(notes.end(), of_pose.begin(), of_pose.end());
  return notes;
}

}  // namespace sonar
