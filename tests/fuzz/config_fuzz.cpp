// Fuzzes the configuration parser: any text of at most 4096 bytes must yield either a configuration that the daemon can use, or
// an error that starts with the file's name.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/config/load_config.hpp"

namespace {

void require(bool statement) {
  if (!statement) std::abort();
}

bool is_usable(const sonar::Pose& pose) { return is_finite(pose.position_m) && is_finite(pose.orientation); }

void check(const sonar::Config& config) {
  require(!config.vehicles.empty() && !config.sonars.empty());
  for (const sonar::VehicleConfig& vehicle : config.vehicles) require(is_usable(vehicle.initial_pose));
  for (const sonar::SonarConfig& sonar : config.sonars) {
    require(sonar.vehicle < config.vehicles.size() && sonar.profile.vendor != nullptr && sonar.profile.model != nullptr);
    require(is_usable(sonar.mount) && sonar.max_clients >= 1 && sonar.max_clients <= 16);
    require(sonar.outbox.depth >= 1 && sonar.outbox.depth <= 3 && sonar.device_id != 0);
  }
  require(config.engine.threads >= 0 && config.engine.switches.fixed_fan >= 0);
  require(config.poses.extrapolate_max_s >= 0 && config.poses.stale_after_s > 0 && config.poses.max_jump_m > 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 4096) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto config = sonar::parse_config(text, "c.yaml", "no-such-folder");
  if (config) {
    check(*config);
  } else {
    require(config.error().text.starts_with("c.yaml:"));
  }
  return 0;
}
