// What GetStatus answers: the daemon, its sonars, bodies and objects as they are now.
#pragma once

#include <chrono>
#include <memory>

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/control/control_server.hpp"
#include "daemon/server/engine/simulator.hpp"
#include "daemon/server/poses/mavlink_server.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/scene_changes.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

class StatusReport {
 public:
  StatusReport(const Config& config, const Clock& clock, const World& world, const SceneChanges& changes, const Fleet& fleet,
               const Simulator& simulator, const Recordings& recordings, const Plausibility& plausibility,
               const MavlinkServer& mavlink, const ControlServer& control)
      : config_(config),
        clock_(clock),
        world_(world),
        changes_(changes),
        fleet_(fleet),
        simulator_(simulator),
        recordings_(recordings),
        plausibility_(plausibility),
        mavlink_(mavlink),
        control_(control) {}

  std::shared_ptr<const v1::DaemonStatus> status() const;

 private:
  const Config& config_;
  const Clock& clock_;
  const World& world_;
  const SceneChanges& changes_;
  const Fleet& fleet_;
  const Simulator& simulator_;
  const Recordings& recordings_;
  const Plausibility& plausibility_;
  const MavlinkServer& mavlink_;
  const ControlServer& control_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace sonar
