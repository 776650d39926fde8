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
/// samples on a logarithmic scale. A sample counts only where no echo of another direction, heard by a beam of this width (-3
/// dB), explains it: an echo is listed in the direction that it comes from alone, and a floor in all. Most to port first.
std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db, double beam_width_rad);

}  // namespace sonar
