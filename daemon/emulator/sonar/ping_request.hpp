// Fills the part of a ping request that the configuration and the world determine: poses, motion, water, switches.
#pragma once

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

/// Poses, motion, moving objects, water, seed and switches of a ping fired at `at` by a sonar on this vehicle. The caller sets
/// model, number, settings and sonar_id.
PingRequest ping_request(const Config& config, const World& world, std::size_t vehicle, const Pose& mount, Time at);

/// The state that messages report after power-up at `now`, without settings.
protocol::DeviceState device_state(const SonarConfig& sonar, const Config& config, Time now);

}  // namespace sonar
