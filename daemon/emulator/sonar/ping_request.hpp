// The part of a ping request that a configuration and the world determine: poses, motion, water, switches. Used by the emulated
// sonar, by `sonard render` and by the benchmark.
#pragma once

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

/// Poses, motion, moving objects, water, seed and switches of a ping fired at `at` by a sonar mounted on that vehicle. Model,
/// number, settings and sonar_id are the caller's.
PingRequest ping_request(const Config& config, const World& world, std::size_t vehicle, const Pose& mount, Time at);

/// The state that the sonar's messages report after power-up at `now`. Its settings are not set.
protocol::DeviceState device_state(const SonarConfig& sonar, const Config& config, Time now);

}  // namespace sonar
