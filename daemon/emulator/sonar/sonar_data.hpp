// The data that the parts of an emulated sonar share: its configuration, the state of the device, its counters.
#pragma once

#include <chrono>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "daemon/emulator/connections/outbox.hpp"
#include "daemon/emulator/faults/journal.hpp"
#include "daemon/emulator/sonar/ping_request.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

struct SonarData {
  /// The objects must outlive the sonar. The configuration has the values that all sonars share: water, seed, switches, rules
  /// for stale poses.
  struct Surroundings {
    const Config& config;
    const World& world;
    FaultJournal* journal = nullptr;  // journal of faults; may be null
  };
  SonarData(Surroundings surroundings, SonarConfig configuration, std::uint32_t number, Time now,
            std::chrono::nanoseconds skipped)
      : around(surroundings),
        config(std::move(configuration)),
        vendor(*config.profile.vendor),
        index(number),
        state(device_state(config, around.config, now)) {
    state.skipped = skipped;
    update_depth(now);
  }

  Surroundings around;
  SonarConfig config;
  const protocol::Vendor& vendor;
  std::uint32_t index;  // part of the key of random numbers
  protocol::DeviceState state;
  DeviceFigures figures;

  /// Converts to the time of dialogues, which does not include the jumps of stepped time.
  Time unskipped(Time now) const { return now - state.skipped; }
  /// Converts back to the daemon's time, assuming no further jump.
  Time clock_time(Time unskipped) const {
    return unskipped > Time::max() - state.skipped ? Time::max() : unskipped + state.skipped;
  }
  Pose pose_at(Time at) const { return compose(around.world.vehicle_at(config.vehicle, at), config.mount); }
  void update_depth(Time now) { state.depth_m = depth_from_z(pose_at(now).position_m.z); }

  void report(Report::Topic topic, LogLevel level, std::string phrase, std::vector<LogField> fields, Actions& actions) const {
    sonar::report(config.name, topic, level, std::move(phrase), std::move(fields), actions);
  }
  /// Reports an exception, which is a bug of sonard.
  void report_fault(const std::exception& e, Actions& actions) const {
    report(Report::Topic::fault, LogLevel::error, std::string("internal fault: ") + e.what(), {}, actions);
  }
};

}  // namespace sonar
