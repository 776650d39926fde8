// Where every pose goes in, whatever road it came by: its wall time is mapped to ours, the world judges it, the log hears of it.
// PoseServer's datagrams and lines end here, and the poses that clients of the control servers send.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/operations.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

class PoseIntake {
 public:
  PoseIntake(World& world, const Clock& clock, Log& log, std::function<void()> on_pose, Events* events = nullptr,
             Plausibility* plausibility = nullptr)
      : world_(world), clock_(clock), log_(log), on_pose_(std::move(on_pose)), events_(events), plausibility_(plausibility) {}

  /// The refusal's sentence, or empty.
  std::string take(control::PoseSample sample, const Sender& sender);
  /// Of what should have been a pose.
  void refuse(const std::string& why, const Sender& sender);

 private:
  void map_wall(control::Stamp& stamp);
  void say_refusal(const std::string& why, const Sender& sender);

  World& world_;
  const Clock& clock_;
  Log& log_;
  std::function<void()> on_pose_;
  Events* events_;
  Plausibility* plausibility_;
  LogLimiter refusals_, notices_;
  std::chrono::nanoseconds wall_shift_{0};  // our time = WALL stamp + shift
};

}  // namespace sonar
