// What monitoring reads: figures for /metrics, and what is wrong for /healthz and the log.
#pragma once

#include <chrono>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/engine/simulator.hpp"
#include "daemon/server/faults/fault_log.hpp"
#include "daemon/server/scene_changes.hpp"
#include "daemon/server/sonars/fleet.hpp"

namespace sonar {

class Monitoring {
 public:
  Monitoring(const LimitConfig& limits, const Simulator& simulator, const SceneChanges& changes, const World& world,
             const Admission& admission, const Fleet& fleet, const FaultLog& faults)
      : limits_(limits),
        simulator_(simulator),
        changes_(changes),
        world_(world),
        admission_(admission),
        fleet_(fleet),
        faults_(faults) {}

  /// As Operations has them.
  std::string metrics() const;
  std::string problem() const;
  /// A change of the scene takes longer than limits.load_s: a sentence; empty when none does.
  std::string slow_load() const;

 private:
  const LimitConfig& limits_;
  const Simulator& simulator_;
  const SceneChanges& changes_;
  const World& world_;
  const Admission& admission_;
  const Fleet& fleet_;
  const FaultLog& faults_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace sonar
