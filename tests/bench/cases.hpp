// The cases of `sonard_bench`: a model, its settings, a scene, and the sonar's motion over it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/vendor.hpp"

namespace sonar::bench {

struct BenchCase {
  std::string name;           // "P3d"
  std::string description;    // text for the table
  protocol::Profile profile;  // vendor is null if no protocol has this model
  PingSettings settings;
  bool near_bottom = false;  // for short ranges: the sonar moves closer to the bed
  Mode mode = Mode::canonical;
  int fixed_fan = 0;  // rays per column, each a scatterer; 0 = surface cells
};

/// Returns all cases, in the order of their names.
std::vector<BenchCase> bench_cases();
std::optional<BenchCase> find_case(std::string_view name);

/// The scenes of the cases, and the path of the sonar in each.
struct BenchScene {
  std::string name;  // scenes/NAME.yaml
  double bed_z_m = 0;
  Vec3d start_m;
};
std::span<const BenchScene> bench_scenes();

/// Returns the pose at a time of the run. The vehicle moves at most 1 m/s and turns at most 20 deg/s, as the goals assume.
Pose bench_pose(const BenchCase& c, const BenchScene& scene, double time_s);
/// Returns a pose with the height and tilt of the case at another position and heading.
Pose bench_pose_at(const BenchCase& c, const BenchScene& scene, double x_m, double y_m, double yaw_rad);

}  // namespace sonar::bench
