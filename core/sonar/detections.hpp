// Points that an echo sounder detects in a ping: the strongest echo of each direction, interpolated between rows and between
// beams.
#pragma once

#include <vector>

#include "core/sonar/ping.hpp"

namespace sonar {

struct Detection {
  double azimuth_rad = 0;  // positive to port, as the azimuths of beams are
  double range_m = 0;      // range that the device computes
};

/// Finds at most one point in each of `directions` equal parts of the sector, from port to starboard. Samples must be
/// logarithmic. An echo is at least `above_db` above the median of its beam. In each row, peaks across beams (-3 dB width
/// `beam_width_rad`) are candidates, and each part gets its strongest peak. Parts without a peak that lie between two parts with
/// peaks get the centroids of the echo in their own beams, if each of them has such an echo. So a small target gives one point,
/// and a floor gives one point in each part.
std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db, double beam_width_rad);

}  // namespace sonar
