// Points that an echo sounder finds in a ping: in each direction the strongest echo, placed between rows and between beams.
#pragma once

#include <vector>

#include "core/sonar/ping.hpp"

namespace sonar {

struct Detection {
  double azimuth_rad = 0;  // positive to port, like those of beams
  double range_m = 0;      // metres as the device computes them
};

/// At most one point for each of `directions` equal parts of the sector, from port to starboard. Samples are logarithmic; echoes
/// are at least `above_db` above the median of their beam. In each row, peaks across beams (-3 dB width `beam_width_rad`) give
/// directions; each part has its strongest peak. Parts without a peak, between parts with one, have the centroid of the echo in
/// their own beams, if each of them has an echo. So a small target is one point, and a floor is one point in each part.
std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db, double beam_width_rad);

}  // namespace sonar
