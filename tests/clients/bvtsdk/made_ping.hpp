// Pings for the tests, computed with simple formulas.
#pragma once

#include <functional>

#include "clients/bvtsdk/core/polar_ping.hpp"

namespace sonar::bvt {

/// Returns a ping of 90 degrees with the samples `sample(beam, bin)`.
inline PolarPing make_ping(int beams, int bins, float start_m, float bin_m, const std::function<int(int, int)>& sample) {
  PolarPing p;
  p.head = 0;
  p.number = 17;
  p.time_s = 1.7e9 + 0.25;
  p.start_m = start_m;
  p.stop_m = start_m + bin_m * static_cast<float>(bins);
  p.fov_min_deg = -45;
  p.fov_max_deg = 45;
  p.bin_m = bin_m;
  p.beams = beams;
  p.bins = bins;
  for (int j = 0; j < beams; ++j)
    for (int k = 0; k < bins; ++k) p.samples.push_back(static_cast<std::uint16_t>(sample(j, k)));
  return p;
}

/// Returns a ping with a single echo of `level`, `wide` beams and `deep` bins in size.
inline PolarPing make_ping_with_target(double range_m, double bearing_deg, int level = 60000, int beams = 512, int bins = 400,
                                       float start_m = 1, float bin_m = 0.025f, double wide = 3, double deep = 3) {
  const PolarPing frame = make_ping(beams, bins, start_m, bin_m, [](int, int) { return 0; });
  return make_ping(beams, bins, start_m, bin_m, [&](int j, int k) {
    const double off_beams = std::abs(frame.bearing_deg(j) - bearing_deg) / (90.0 / beams);
    const double off_bins = std::abs(frame.range_m(k) - range_m) / static_cast<double>(bin_m);
    return off_beams <= wide / 2 && off_bins <= deep / 2 ? level : 0;
  });
}

}  // namespace sonar::bvt
