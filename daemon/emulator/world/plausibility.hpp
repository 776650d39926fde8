// Finds probable mistakes: poses above the water, degrees instead of radians, quaternions in the wrong order, sonars upside down,
// meshes in millimetres. `sonard check` prints the notes, the daemon logs them (at the start and at the first implausible pose),
// and its status has them for `sonarctl doctor`.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/base/plausible_angles.hpp"
#include "core/scene/extent.hpp"
#include "daemon/config/config.hpp"
#include "protocol/control/pose_sample.hpp"

namespace sonar {

/// A probable mistake, or a missing step.
struct Note {
  std::string vehicle;  // the vehicle concerned; empty = the scene or a sonar
  std::string text;     // a sentence
  std::string cure;     // the change to make
};

/// Returns a text such as "the sonar of rov is 3.0 m above the water's surface (z = 0); ENU_FLU counts z upwards ...".
std::string text_of(const Note& note);

/// Size of a mesh along its own axes.
struct MeshShape {
  Extent own;
  bool is_ground = false;  // true: flat, or every triangle faces up; such a mesh may be long
};
using MeshShapes = std::map<std::shared_ptr<const Mesh>, MeshShape>;

/// Facts with which poses are compared. The sea surface is not included.
struct Surroundings {
  Extent scene;                // extent of all visible objects
  std::vector<Extent> ground;  // extent of each static plane, seabed and height map
  double longest_range_m = 0;  // longest range of any sonar
  MeshShapes meshes;           // shapes of the meshes of visible objects
};
/// Collects the facts. `known`: shapes of the previous scene, whose meshes are not examined again.
Surroundings surroundings_of(const Config& config, const Scene& scene, const MeshShapes& known = {});

/// A vehicle's name, and the mounts of its sonars (FLU).
struct Carrier {
  std::string vehicle;
  std::vector<Pose> mounts;
};
std::vector<Carrier> carriers_of(const Config& config);

std::vector<Note> notes_on_mounts(const Config& config);
/// Returns notes on a scene. `around`: the surroundings of this scene.
std::vector<Note> notes_on_scene(const Scene& scene, const Surroundings& around);
/// Returns notes on scenes far from the origin of a world with latitude and longitude.
std::vector<Note> notes_on_origin(const Surroundings& around);
/// Returns at most one note on the position and one on the attitude.
std::vector<Note> notes_on_pose(const Carrier& carrier, const Pose& vehicle_in_world, const Surroundings& around);
/// Returns notes on angles. `largest`: the largest implausible angle of the vehicle's newest pose.
std::vector<Note> notes_on_angles(const std::string& vehicle, const ImplausibleAngle& largest);
/// Returns notes on the attitudes of about 10,000 poses at most, evenly spread: degrees for radians, quaternions in another
/// order, upside down.
std::vector<Note> notes_on_attitudes(const Carrier& carrier, const motion::Plan& plan);
/// Returns these notes, and those on positions. A carrier without mounts is a moving object, whose position is not checked.
std::vector<Note> notes_on_trajectory(const Carrier& carrier, const motion::Plan& plan, const Surroundings& around);

/// Returns all notes that need no pose.
std::vector<Note> notes_on(const Config& config, const Scene& scene, const Surroundings& around);

/// The notes of a running daemon: on configuration and scene, and on the newest pose of each vehicle.
class Plausibility {
 public:
  /// Call it at the start and after a change of configuration or scene. Returns new notes only. Checks trajectories again only if
  /// they or positions in the scene have changed.
  std::vector<Note> use(const Config& config, const Scene& scene);
  /// Checks an accepted pose of a vehicle; returns only notes that are new for this vehicle.
  /// `now`: the time of a pose without a stamp.
  std::vector<Note> use(const control::PoseSample& sample, Time now);
  /// Returns the present notes. Notes on poses replace those on a vehicle's start or trajectory.
  std::vector<Note> all() const;

 private:
  struct LastPose {
    Pose vehicle_in_world;
    ImplausibleAngle largest_angle = {};
    std::vector<Note> notes = {};
    TurnCount turns = {};
  };
  std::vector<Note> unreported(const std::vector<Note>& notes);
  void judge(const Carrier& carrier, LastPose& last) const;

  Surroundings around_;
  std::vector<Carrier> carriers_;
  std::vector<std::shared_ptr<const motion::Trajectory>>
      played_;                                // the trajectories to which the notes of_plans_ belong; a reload reads new ones
  std::vector<Note> of_plans_, of_setup_;     // of_setup_ contains of_plans_
  std::map<std::string, LastPose> of_poses_;  // key: vehicle
  std::set<std::string> reported_;
};

}  // namespace sonar
