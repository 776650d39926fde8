// Fills the part of a ping request that the configuration and the world determine: poses, motion, water, switches.
#pragma once

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

/// Fills in poses, motion, moving objects, water, seed and switches for a ping that a sonar on this vehicle fires at `at`. The
/// caller sets model, number, settings and sonar_id.
PingRequest ping_request(const Config& config, const World& world, std::size_t vehicle, const Pose& mount, Time at);

/// Returns the state that messages report after power-up at `now`, without settings.
protocol::DeviceState device_state(const SonarConfig& sonar, const Config& config, Time now);

}  // namespace sonar
