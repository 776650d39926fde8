#include "daemon/emulator/world/plausibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "core/motion/trajectory_file.hpp"
#include "core/pipeline/water_line.hpp"
#include "core/text/format.hpp"
#include "daemon/emulator/world/body_axes.hpp"

namespace sonar {
namespace {

using text::format;

constexpr double turned_over = -0.5;           // the z axis points more than 30 deg below the horizon
constexpr std::size_t most_looked_at = 10000;  // limit for the poses of a trajectory and the triangles of a mesh
constexpr double ground_flatness = 0.05;       // height over width; flatter objects are ground, of any length
constexpr double least_ground_m = 2;           // width; a narrower flat plate is not ground
constexpr double far_from_origin_m = 1000;     // a scene may be this far away, because vehicles may drive to it
constexpr double long_ranges = 5;              // an object may be this many times as long as the longest range

// Each remedy identifies a kind of note, which is reported once per vehicle.
constexpr const char* surface_cure =
    "was NED taken for ENU, or the reverse? ENU_FLU counts z upwards, NED_FRD downwards: 3 m deep is z = -3 in the one and z = 3 "
    "in the other; state the frame that was sent";
constexpr const char* depth_cure =
    "the scene is less deep than that: check the origin that depths are counted from, and the unit (metres)";
constexpr const char* exchanged_cure = "it is in the scene with x and y exchanged: ENU_FLU has east first, NED_FRD north";
constexpr const char* far_cure = "positions are metres from the world's 0, 0, 0: check their unit and origin";
constexpr const char* turned_cure =
    "check the quaternion's order (JSON and EuRoC: w first; TUM and ROS: w last), the unit of angles (JSON: radians), and the "
    "body's axes (FLU: z up; FRD: z down; a camera's: z ahead)";
constexpr const char* order_cure =
    "write w where the format has it: last in a TUM line (t x y z qx qy qz qw), first in one of EuRoC";
constexpr const char* angle_cure = "angles must be in radians: were degrees sent? Multiply them by 0.0174533";
constexpr const char* degrees_cure = "were degrees written? Call the columns roll_deg, pitch_deg and yaw_deg";
constexpr const char* radians_cure = "call the columns roll_rad, pitch_rad and yaw_rad, or multiply the angles by 57.2958";
constexpr const char* mount_cure =
    "rpy_deg is [roll, pitch, yaw]: a roll near 180, or a pitch beyond 90, turns it over and swaps port and starboard; to look "
    "aft, set yaw 180";
constexpr const char* origin_cure =
    "vehicles with latitudes and longitudes are placed relative to world.origin, and so is a height map in degrees or UTM "
    "without `origin` and `centred`: does world.origin belong to this scene?";
constexpr const char* lift_cure = "lower the scene (sonarctl scene import --offset 0,0,-10) or the poses of its objects";

struct Doubt {
  std::string text;
  const char* cure;
};

/// Returns the lowest point of all ground above or below a position; nullopt without ground.
std::optional<double> lowest_ground_m(Vec3d place_m, const Surroundings& around) {
  std::optional<double> lowest;
  for (const Extent& ground : around.ground)
    if (ground.distance_m({place_m.x, place_m.y, ground.low_m.z}) == 0)
      lowest = std::min(lowest.value_or(ground.low_m.z), ground.low_m.z);
  return lowest;
}

enum class Location { fine, above_water, below_ground, far_away };
Location judge_location(Vec3d sonar_m, const Surroundings& around) {
  const Extent& scene = around.scene;
  const bool lies_above = !scene.empty() && scene.low_m.z >= 0;  // then the scene is wrong, not the pose
  if (sonar_m.z > least_depth_m && !lies_above) return Location::above_water;
  if (const auto ground_m = lowest_ground_m(sonar_m, around); ground_m && sonar_m.z < *ground_m) return Location::below_ground;
  return !scene.empty() && scene.distance_m(sonar_m) > around.longest_range_m ? Location::far_away : Location::fine;
}

/// Returns the first implausible position of a carrier's sonars.
std::optional<Vec3d> doubtful_place(const Carrier& carrier, const Pose& vehicle_in_world, const Surroundings& around) {
  for (const Pose& mount : carrier.mounts)
    if (const Vec3d at_m = compose(vehicle_in_world, mount).position_m; judge_location(at_m, around) != Location::fine)
      return at_m;
  return std::nullopt;
}

std::optional<Doubt> doubt_of_place(const Carrier& carrier, const Pose& vehicle_in_world, const Surroundings& around) {
  const auto sonar_m = doubtful_place(carrier, vehicle_in_world, around);
  if (!sonar_m) return std::nullopt;
  const std::string subject = "the sonar of " + carrier.vehicle;
  const Location location = judge_location(*sonar_m, around);
  if (location == Location::above_water)
    return Doubt{subject + format(" is %.1f m above the water's surface (z = 0)", sonar_m->z), surface_cure};
  if (location == Location::below_ground) {
    const double ground_m = lowest_ground_m(*sonar_m, around).value_or(0);
    return Doubt{subject + format(" is %.1f m below the lowest point of the ground (z = %.1f)", ground_m - sonar_m->z, ground_m),
                 depth_cure};
  }
  const bool exchanged = around.scene.distance_m({sonar_m->y, sonar_m->x, sonar_m->z}) <= around.longest_range_m;
  return Doubt{subject + format(" is %.0f m from everything in the scene, but its range is at most %.0f m",
                                around.scene.distance_m(*sonar_m), around.longest_range_m),
               exchanged ? exchanged_cure : far_cure};
}

bool is_upside_down(const Pose& p) { return upright(p.orientation) <= turned_over; }

std::optional<Doubt> doubt_of_attitude(const std::string& body, Quatd q) {
  if (upright(q) > turned_over) return std::nullopt;
  const double from_upright_rad = std::acos(std::clamp(upright(q), -1.0, 1.0));
  return Doubt{body + format(" is upside down, %.0f deg from upright", deg_from_rad(from_upright_rad)), turned_cure};
}

/// True if the body is upright in the frame of the file when w is read from the other end of the four numbers.
bool is_upright_in_another_order(Quatd q) {
  const auto reordered = [](Quatd r) { return std::array{upright({r.x, r.y, r.z, r.w}), upright({r.z, r.w, r.x, r.y})}; };
  const auto as_enu = reordered(q), as_ned = reordered(enu_flu_from_ned_frd(q));
  return std::max({as_enu[0], as_enu[1], as_ned[0], as_ned[1]}) > tilted;
}

/// True if w can be at the wrong end, which is not possible in CSV (columns have names) and KITTI (poses are matrices). `about`
/// begins with the format.
bool has_nameless_quaternions(const motion::Plan& plan) {
  return plan.about.starts_with(plan.file + ": tum,") || plan.about.starts_with(plan.file + ": euroc,");
}

/// True if the poses are implausibly tilted, but upright with the numbers in another order.
bool is_out_of_order(const std::vector<Pose>& poses) {
  std::size_t lying = 0, explained = 0;
  for (const Pose& p : poses) {
    const bool lies = upright(p.orientation) < tilted;
    lying += lies ? 1 : 0;
    explained += lies && is_upright_in_another_order(p.orientation) ? 1 : 0;
  }
  return 10 * lying >= poses.size() && 100 * explained >= 99 * lying;
}

/// Returns all poses, or every second, third and so on, so that there are at most most_looked_at.
std::vector<Pose> some_poses_of(const motion::Plan& plan) {
  const std::vector<Pose>& all = plan.trajectory->points().poses;
  const std::size_t step = 1 + (all.size() - 1) / most_looked_at;
  std::vector<Pose> some;
  for (std::size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
  return some;
}

/// Returns a note on the first doubtful pose, with the number of doubtful poses.
std::optional<Doubt> doubt_of_all(const std::vector<Pose>& poses, const motion::Plan& plan,
                                  const std::function<bool(const Pose&)>& is_doubtful,
                                  const std::function<std::optional<Doubt>(const Pose&)>& doubt_of) {
  const auto first = std::find_if(poses.begin(), poses.end(), is_doubtful);
  if (first == poses.end()) return std::nullopt;
  std::optional<Doubt> doubt = doubt_of(*first);
  const auto count = static_cast<std::size_t>(std::count_if(first, poses.end(), is_doubtful));
  const char* which = poses.size() < plan.trajectory->size() ? "checked poses" : "poses";
  if (doubt) doubt->text += format(", in %zu of %zu %s of ", count, poses.size(), which) + plan.file;
  return doubt;
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

/// True if all checked triangles face up, so that from above no part of the object hides another.
bool is_height_field(const Mesh& mesh) {
  const std::size_t step = 1 + mesh.triangles.size() / most_looked_at;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Vec3 p = mesh.vertices[a];
    if (cross(mesh.vertices[b] - p, mesh.vertices[c] - p).z <= 0) return false;
  }
  return !mesh.triangles.empty();
}

MeshShape shape_of(const Mesh& mesh) {
  MeshShape shape{extent_of(mesh)};
  const Vec3d size = shape.own.size_m();
  shape.is_ground = size.z < ground_flatness * std::min(size.x, size.y) || is_height_field(mesh);
  return shape;
}

/// True if an object is the sheet that the loader makes for the scene's sea_surface.
bool is_sea_surface(const Scene& scene, const Object& o) {
  return scene.sea_surface.present && o.primitive.kind == Primitive::Kind::plane && o.name == "sea surface";
}

/// True if poses get the same notes in both surroundings.
bool is_same(const Surroundings& a, const Surroundings& b) {
  return a.scene == b.scene && a.longest_range_m == b.longest_range_m && a.ground == b.ground;
}

std::vector<std::shared_ptr<const motion::Trajectory>> trajectories_of(const Config& config) {
  std::vector<std::shared_ptr<const motion::Trajectory>> all;
  for (const VehicleConfig& v : config.vehicles) all.push_back(v.plan.trajectory);
  for (const ObjectConfig& o : config.objects) all.push_back(o.plan.trajectory);
  return all;
}

std::vector<Note> notes_on_plans(const Config& config, const Surroundings& around) {
  const std::vector<Carrier> carriers = carriers_of(config);
  std::vector<Note> notes;
  for (std::size_t v = 0; v < carriers.size(); ++v)
    if (const motion::Plan& plan = config.vehicles[v].plan) add(notes, notes_on_trajectory(carriers[v], plan, around));
  for (const ObjectConfig& o : config.objects)
    if (o.plan)
      for (Note& n : notes_on_trajectory({o.name, {}}, o.plan, around)) notes.push_back({"", n.text, n.cure});
  return notes;
}

/// Returns notes on mounts, scene and origin, and on the initial poses of vehicles without trajectories. A vehicle that waits for
/// its first pose has no pose to check.
std::vector<Note> notes_on_start(const Config& config, const Scene& scene, const Surroundings& around) {
  const std::vector<Carrier> carriers = carriers_of(config);
  std::vector<Note> notes = notes_on_mounts(config);
  add(notes, notes_on_scene(scene, around));
  if (config.origin) add(notes, notes_on_origin(around));
  for (std::size_t v = 0; v < carriers.size(); ++v) {
    const VehicleConfig& vehicle = config.vehicles[v];
    if (!vehicle.plan && (vehicle.has_initial_pose || vehicle.orbits))
      add(notes, notes_on_pose(carriers[v], vehicle.initial_pose, around));
  }
  return notes;
}

}  // namespace

std::string text_of(const Note& note) { return note.text + (note.cure.empty() ? "" : "; " + note.cure); }

Surroundings surroundings_of(const Config& config, const Scene& scene, const MeshShapes& known) {
  Surroundings around;
  for (const Object& o : scene.objects) {
    if (!o.visible || is_sea_surface(scene, o)) continue;
    const auto [at, is_new] = around.meshes.try_emplace(o.mesh);  // instances share their mesh
    if (const auto before = known.find(o.mesh); is_new) at->second = before == known.end() ? shape_of(*o.mesh) : before->second;
    const Extent there = in_world(at->second.own, o.in_world);
    around.scene.add(there);
    const bool lies_flat = std::abs(upright(o.in_world.orientation)) > tilted;
    const bool is_wide = std::min(there.size_m().x, there.size_m().y) >= least_ground_m;
    if (at->second.is_ground && lies_flat && is_wide && o.body < 0) around.ground.push_back(there);
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
  if (scene.sea_surface.present && !around.scene.empty() && around.scene.low_m.z >= 0)
    notes.push_back({"", "nothing of the scene lies below the water's surface, z = 0", lift_cure});
  const double allowed_m = std::max(huge_mesh_m, long_ranges * around.longest_range_m);
  std::set<const Mesh*> seen;
  for (const Object& o : scene.objects) {
    // The size of a primitive is in the scene file, in metres. Only mesh files have other units.
    if (!o.visible || o.primitive.kind != Primitive::Kind::none || !seen.insert(o.mesh.get()).second) continue;
    const MeshShape& shape = around.meshes.at(o.mesh);
    const double length_m = shape.own.longest_m();
    if (length_m <= allowed_m || shape.is_ground) continue;
    notes.push_back({"",
                     o.name + format(" is %.0f m long, but no sonar has a range above %.0f m", length_m, around.longest_range_m),
                     std::string(huge_mesh_cure)});
  }
  return notes;
}

std::vector<Note> notes_on_origin(const Surroundings& around) {
  if (around.scene.empty()) return {};
  const double away_m = around.scene.distance_m({0, 0, around.scene.low_m.z});
  if (away_m < far_from_origin_m) return {};
  return {{"", format("the scene is %.1f km from world.origin", away_m / 1000), origin_cure}};
}

std::vector<Note> notes_on_pose(const Carrier& carrier, const Pose& vehicle_in_world, const Surroundings& around) {
  std::vector<Note> notes;
  add(notes, carrier.vehicle, doubt_of_place(carrier, vehicle_in_world, around));
  add(notes, carrier.vehicle, doubt_of_attitude(carrier.vehicle, vehicle_in_world.orientation));
  return notes;
}

std::vector<Note> notes_on_angles(const std::string& vehicle, const ImplausibleAngle& largest) {
  if (!(largest.rad > 0)) return {};
  return {{vehicle, "the attitude of " + vehicle + format(" has an angle of %.4g rad", largest.rad), angle_cure}};
}

std::vector<Note> notes_on_attitudes(const Carrier& carrier, const motion::Plan& plan) {
  const std::vector<Pose> poses = some_poses_of(plan);
  std::vector<Note> notes;
  if (plan.largest_angle.rad > 0) {
    add(notes, carrier.vehicle, Doubt{plan.file + format(" has an angle of %.4g rad", plan.largest_angle.rad), degrees_cure});
    // Further notes would be consequences of a roll or pitch in degrees. A heading in degrees turns nothing over.
    if (plan.largest_angle.is_tilt) return notes;
  } else if (const auto why = radians_read_as_degrees(poses))
    add(notes, carrier.vehicle, Doubt{"the headings of " + plan.file + " " + *why, radians_cure});
  if (const OtherAxes* axes = axes_of(poses)) {
    if (!are_upright(carrier.mounts, *axes))
      add(notes, carrier.vehicle, Doubt{"the poses of " + plan.file + " " + axes->text, axes->cure});
  } else if (has_nameless_quaternions(plan) && is_out_of_order(poses))
    add(notes, carrier.vehicle,
        Doubt{"the quaternions of " + plan.file + " turn " + carrier.vehicle + " over, but would not if w were at the other end",
              order_cure});
  else
    add(notes, carrier.vehicle, doubt_of_all(poses, plan, is_upside_down, [&](const Pose& p) {
          return doubt_of_attitude(carrier.vehicle, p.orientation);
        }));
  return notes;
}

std::vector<Note> notes_on_trajectory(const Carrier& carrier, const motion::Plan& plan, const Surroundings& around) {
  const auto is_misplaced = [&](const Pose& p) { return doubtful_place(carrier, p, around).has_value(); };
  std::vector<Note> notes = notes_on_attitudes(carrier, plan);
  add(notes, carrier.vehicle,
      doubt_of_all(some_poses_of(plan), plan, is_misplaced, [&](const Pose& p) { return doubt_of_place(carrier, p, around); }));
  return notes;
}

std::vector<Note> notes_on(const Config& config, const Scene& scene, const Surroundings& around) {
  std::vector<Note> notes = notes_on_start(config, scene, around);
  add(notes, notes_on_plans(config, around));
  return notes;
}

std::vector<Note> Plausibility::unreported(const std::vector<Note>& notes) {
  std::vector<Note> fresh;
  for (const Note& n : notes)
    // A vehicle gets one note per cure, even if numbers differ; the scene gets one note per text.
    if (reported_.insert(n.vehicle.empty() ? n.text : n.vehicle + "|" + n.cure).second) fresh.push_back(n);
  return fresh;
}

std::vector<Note> Plausibility::use(const Config& config, const Scene& scene) {
  Surroundings around = surroundings_of(config, scene, around_.meshes);
  auto played = trajectories_of(config);
  // Checking trajectories takes longest, so it is repeated only if the trajectories or their surroundings differ.
  if (played != played_ || !is_same(around, around_)) of_plans_ = notes_on_plans(config, around);
  around_ = std::move(around);
  played_ = std::move(played);
  carriers_ = carriers_of(config);
  of_setup_ = notes_on_start(config, scene, around_);
  add(of_setup_, of_plans_);
  std::map<std::string, LastPose> before;
  // The last pose of each vehicle is checked again in the new surroundings; removed vehicles are dropped.
  before.swap(of_poses_);
  for (const Carrier& c : carriers_)
    if (const auto last = before.find(c.vehicle); last != before.end()) judge(c, of_poses_[c.vehicle] = last->second);
  return unreported(all());
}

void Plausibility::judge(const Carrier& carrier, LastPose& last) const {
  last.notes = notes_on_pose(carrier, last.vehicle_in_world, around_);
  if (last.largest_angle.is_tilt)  // angles in degrees cause this note
    std::erase_if(last.notes, [](const Note& n) { return n.cure == turned_cure; });
  add(last.notes, notes_on_angles(carrier.vehicle, last.largest_angle));
}

std::vector<Note> Plausibility::use(const control::PoseSample& sample, Time now) {
  const auto carrier = std::find_if(carriers_.begin(), carriers_.end(), [&](const Carrier& c) {
    return c.vehicle == sample.name || sample.name.empty();  // an empty name means the only vehicle
  });
  if (carrier == carriers_.end()) return {};
  LastPose& last = of_poses_[carrier->vehicle];
  if (sample.stamp.domain != control::ClockDomain::arrival) now = Time(std::chrono::nanoseconds(sample.stamp.ns));
  last.turns.add(sample.sent_angles.yaw_rad, now);
  last.vehicle_in_world = sample.pose;
  last.largest_angle = angle_beyond_radians(sample.sent_angles, last.turns.has_counted());
  judge(*carrier, last);
  return unreported(last.notes);
}

std::vector<Note> Plausibility::all() const {
  std::vector<Note> notes;
  // A pose that has arrived replaces the notes on the initial pose of that vehicle.
  std::copy_if(of_setup_.begin(), of_setup_.end(), std::back_inserter(notes),
               [this](const Note& n) { return !of_poses_.contains(n.vehicle); });
  for (const auto& [vehicle, last] : of_poses_) notes.insert(notes.end(), last.notes.begin(), last.notes.end());
  return notes;
}

}  // namespace sonar
