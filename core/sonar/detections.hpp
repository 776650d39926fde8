// Points that an echo sounder finds in a ping: in each direction the strongest echo, placed between rows and between beams.
#pragma once

#include <vector>

#include "core/sonar/ping.hpp"

namespace sonar {

struct Detection {
  double azimuth_rad = 0;  // as of beams: positive to port
  double range_m = 0;      // in the device's metres
};

/// At most one for each of `directions` even parts of the sector, of samples on a logarithmic scale, `above_db` over the median
/// of their beam. In each row the peaks across beams of that width (-3 dB) show where echoes come from; the strongest peak of
/// each direction counts. A direction without a peak, between two that have one, has the centroid of what its own beams receive,
/// if every direction of the gap has an echo. A small target is one point, a floor one in each direction. Most to port first.
std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db, double beam_width_rad);

}  // namespace sonar
