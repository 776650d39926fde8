// Cases of `sonard_bench`: a model, its settings, and how the sonar moves over which scene.
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
  std::string description;    // for the table
  protocol::Profile profile;  // vendor is null where no protocol frames this model yet
  PingSettings settings;
  bool near_bottom = false;  // short ranges want the bed closer
  Mode mode = Mode::canonical;
  int fixed_fan = 0;  // rays a column, each a scatterer; 0 = surface cells
};

/// All of them, in the order of their names.
std::vector<BenchCase> bench_cases();
std::optional<BenchCase> find_case(std::string_view name);

/// Scenes the cases run over, and where a sonar flies in them.
struct BenchScene {
  std::string name;  // scenes/NAME.yaml
  double bed_z_m = 0;
  Vec3d start_m;
};
std::span<const BenchScene> bench_scenes();

/// A pose at a time of the run. The vehicle moves at most 1 m/s and turns at most 20 deg/s, as the goals assume.
Pose bench_pose(const BenchCase& c, const BenchScene& scene, double time_s);
/// A pose with the height and tilt of the case at another position and heading.
Pose bench_pose_at(const BenchCase& c, const BenchScene& scene, double x_m, double y_m, double yaw_rad);

}  // namespace sonar::bench
