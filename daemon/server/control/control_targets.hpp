// The parts of the daemon on which requests of control act.
#pragma once

#include "daemon/server/api/events.hpp"
#include "daemon/server/api/operations.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/poses/pose_intake.hpp"

namespace sonar {

struct ControlTargets {
  Operations& operations;
  Events& events;
  PoseIntake& poses;
  SharedRate pose_rate;  // limit for poses without an answer (request id 0)
};

}  // namespace sonar
