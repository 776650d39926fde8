// Finds probable mistakes: poses above the water, degrees instead of radians, quaternions in the wrong order,
// sonars upside down, meshes in millimetres. Pure functions from facts to notes; `sonard check`, the log at the start, the log
// when a pose shows it and the daemon's status (for `sonarctl doctor`) use them.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/scene/extent.hpp"
#include "daemon/config/config.hpp"
#include "protocol/control/pose_sample.hpp"

namespace sonar {

/// A probable mistake, or a missing step.
struct Note {
  std::string vehicle;  // the note's subject; empty = the scene or a sonar
  std::string text;     // a sentence
  std::string cure;     // what to change
};

/// "the sonar of rov is 3.0 m above the water's surface (z = 0); ENU_FLU counts z upwards ..."
std::string text_of(const Note& note);

/// Size of a mesh along its own axes.
struct MeshShape {
  Extent own;
  bool is_ground = false;  // flat, or every triangle faces up: it may be long
};
using MeshShapes = std::map<std::shared_ptr<const Mesh>, MeshShape>;

/// Facts against which poses are judged. The sea surface is not one of them.
struct Surroundings {
  Extent scene;                // where the scene puts what can be seen
  std::vector<Extent> ground;  // extent of each plane, seabed and height map that stands still
  double longest_range_m = 0;  // longest range of any sonar
  MeshShapes meshes;           // that can be seen
};
/// `known`: shapes of the previous scene, whose meshes are not examined again.
Surroundings surroundings_of(const Config& config, const Scene& scene, const MeshShapes& known = {});

/// A vehicle, by name, and where its sonars sit on it (FLU).
struct Carrier {
  std::string vehicle;
  std::vector<Pose> mounts;
};
std::vector<Carrier> carriers_of(const Config& config);

std::vector<Note> notes_on_mounts(const Config& config);
/// `around`: of this scene.
std::vector<Note> notes_on_scene(const Scene& scene, const Surroundings& around);
/// Whether the scene is near the origin of a world that has a latitude and longitude.
std::vector<Note> notes_on_origin(const Surroundings& around);
/// Returns at most one note on the position and one on the attitude.
std::vector<Note> notes_on_pose(const Carrier& carrier, const Pose& vehicle_in_world, const Surroundings& around);
/// `largest_angle_rad`: as in PoseSample.
std::vector<Note> notes_on_angles(const std::string& vehicle, double largest_angle_rad);
/// Notes on at most some 10,000 poses, evenly spread. A carrier without mounts is a moving object: its place is not judged.
std::vector<Note> notes_on_trajectory(const Carrier& carrier, const motion::Plan& plan, const Surroundings& around);

/// Returns all notes that need no pose.
std::vector<Note> notes_on(const Config& config, const Scene& scene, const Surroundings& around);

/// The notes of a running daemon: of its configuration and scene, and of the newest pose of each vehicle.
class Plausibility {
 public:
  /// Call it at the start, and after configuration or scene has changed. Returns notes that were not returned before. Judges
  /// trajectories and poses again if positions in the scene have changed.
  std::vector<Note> use(const Config& config, const Scene& scene);
  /// Judges an accepted pose of a vehicle; returns the notes that were not returned before for this vehicle.
  std::vector<Note> use(const control::PoseSample& sample);
  /// Notes that hold now. Those on poses replace those on a vehicle's start or trajectory.
  std::vector<Note> all() const;

 private:
  struct LastPose {
    Pose vehicle_in_world;
    double largest_angle_rad = 0;
    std::vector<Note> notes;
  };
  std::vector<Note> untold(const std::vector<Note>& notes);
  void judge(const Carrier& carrier, LastPose& last) const;

  Surroundings around_;
  std::vector<Carrier> carriers_;
  std::vector<std::shared_ptr<const motion::Trajectory>>
      played_;                                // the trajectories that of_plans_ is about; a reload reads new ones
  std::vector<Note> of_plans_, of_setup_;     // of_setup_ contains of_plans_
  std::map<std::string, LastPose> of_poses_;  // by vehicle
  std::set<std::string> told_;
};

}  // namespace sonar
