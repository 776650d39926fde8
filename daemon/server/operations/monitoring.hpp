// Makes the answer to GetStatus, the figures for /metrics, and the problems for /healthz and the log.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/control/control_server.hpp"
#include "daemon/server/engine/scene_changes.hpp"
#include "daemon/server/engine/simulator.hpp"
#include "daemon/server/faults/fault_log.hpp"
#include "daemon/server/poses/mavlink_server.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/clock.hpp"
#include "daemon/server/view/view_feed.hpp"

namespace sonar {

/// The parts of the daemon on which Monitoring reports. They must outlive the Monitoring.
struct Monitored {
  const Config& config;
  const Clock& clock;
  const World& world;
  const SceneChanges& changes;
  const Fleet& fleet;
  const Simulator& simulator;
  const Admission& admission;
  const Recordings& recordings;
  const Plausibility& plausibility;
  const MavlinkServer& mavlink;
  const ControlServer& control;
  const FaultLog& faults;
  const ViewFeed& view;
};

class Monitoring {
 public:
  explicit Monitoring(const Monitored& parts) : of_(parts) {}

  std::shared_ptr<const v1::DaemonStatus> status() const;
  /// The functions of Operations with these names describe the results.
  std::string metrics() const;
  std::string problem() const;
  /// Returns a sentence if a change of the scene takes longer than limits.load_s; else empty.
  std::string slow_load() const;
  /// Returns a note if the computer's clock was set since sonard started.
  std::vector<Note> notes_on_clock() const;

 private:
  double wall_ahead_s() const { return of_.clock.stepped() ? 0 : -seconds(of_.clock.ahead_of_wall()); }
  double uptime_s() const { return seconds(std::chrono::steady_clock::now() - started_); }

  Monitored of_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace sonar
