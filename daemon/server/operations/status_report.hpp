// What GetStatus answers: the sonars, bodies and objects as they are now.
#pragma once

#include <chrono>
#include <functional>

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/scene_changes.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

class StatusReport {
 public:
  /// `add_server` adds what is not of the emulation: the engine, listeners, recordings and notes.
  using AddServer = std::function<void(control::DaemonStatus&)>;
  StatusReport(const Config& config, const Clock& clock, const World& world, const SceneChanges& changes, const Fleet& fleet,
               AddServer add_server)
      : config_(config), clock_(clock), world_(world), changes_(changes), fleet_(fleet), add_server_(std::move(add_server)) {}

  control::DaemonStatus status() const;

 private:
  const Config& config_;
  const Clock& clock_;
  const World& world_;
  const SceneChanges& changes_;
  const Fleet& fleet_;
  AddServer add_server_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace sonar
