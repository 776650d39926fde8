// Poses on simple paths for `sonarctl pose`: world ENU, body FLU.
#pragma once

#include "core/base/geometry.hpp"

namespace sonar::clients {

struct Moment {
  Pose body_in_world;
  Vec3d velocity_mps;  // world axes
};

struct Circle {
  Vec3d centre_m;
  double radius_m = 5, period_s = 60, pitch_rad = 0;  // pitch: bow up positive; negative period = clockwise
  bool look_inwards = true;                           // false: looks along the path
};
/// Moves anticlockwise seen from above, starting east of the centre.
Moment on_circle(const Circle& circle, double time_s);

struct Line {
  Vec3d from_m, to_m;
  double speed_mps = 0.5, pitch_rad = 0;
  double duration_s() const { return length(to_m - from_m) / speed_mps; }
};
/// Moves along the line, heading ahead, and stops at its end.
Moment on_line(const Line& line, double time_s);

}  // namespace sonar::clients
