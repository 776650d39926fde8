// Carries out requests that move bodies or advance time: poses, steps of lockstep time, playback of trajectories.
#pragma once

#include <functional>

#include "daemon/server/api/operations.hpp"
#include "daemon/server/poses/pose_intake.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/stepped_time.hpp"

namespace sonar {

class TimeOperations {
 public:
  /// `on_change` is called when time may advance.
  TimeOperations(SteppedTime& time, PoseIntake& poses, const Fleet& fleet, std::function<void()> on_change)
      : time_(time), poses_(poses), fleet_(fleet), on_change_(std::move(on_change)) {}

  void take(const control::PoseSample& sample, const Sender& sender, Operations::Done done);
  void step(const control::Step& asked, Operations::Done done, HasLeft has_left);
  OperationResult steer(const control::SetTrajectory& asked, const Sender& sender);

 private:
  std::uint64_t pings_made() const;

  SteppedTime& time_;
  PoseIntake& poses_;
  const Fleet& fleet_;
  std::function<void()> on_change_;
  std::uint64_t pings_reported_ = 0;  // pings counted in answers to steps so far
};

}  // namespace sonar
