// Points that an echo sounder finds in a ping: in each direction the strongest echo, placed between rows and between beams.
#pragma once

#include <vector>

#include "core/sonar/ping.hpp"

namespace sonar {

struct Detection {
  double azimuth_rad = 0;  // as of beams: positive to port
  double range_m = 0;      // in the device's metres
};

/// One for each of `directions` even parts of the sector whose strongest sample lies `above_db` over the median of its beam; of
/// samples on a logarithmic scale. The azimuth is the peak across beams in the row of that sample, so that one echo heard by
/// several beams is placed where it comes from; an echo that two directions share is listed once. Most to port first.
std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db);

}  // namespace sonar
