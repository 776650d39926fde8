// Mixes neighbouring beams: the blur of an array that is focused for broadside only, and a fitted fraction of the next beams
// (docs/acoustics.md, section 6). The file uses only C++17 and the standard library.
#pragma once

#include <cstdint>

#include "core/base/host_device.hpp"

namespace sonar {

/// The tables of BeamMix. A null table means that its part is off. Signals are complex [beams][stride / 2], interleaved. In
/// expected power, re is a power, and taps and shares are squared.
struct BeamMixView {
  const float* turn_m;                          // [beams]: phase error at the aperture's ends times range [rad m]
  const float* taps;                            // complex [sets][2 widest + 1], for beams j - widest to j + widest
  const std::int32_t* reach;                    // [sets]: number of taps on either side that are not 0
  const float *own, *share;                     // [beams]: weight of the beam, and of each neighbour
  std::int32_t beams, sets, widest, step;       // widest: largest reach; step: distance of the mixed neighbours, in beams
  float sets_per_rad, first_range_m, sample_m;  // first_range_m: range of sample 0; sample_m: spacing of samples
};

/// The set of taps for this beam and sample; 0 = no change.
SONAR_HD inline std::int32_t focus_set(const BeamMixView& v, std::int32_t beam, std::int32_t sample) {
  const float range_m = v.first_range_m + v.sample_m * static_cast<float>(sample);
  const float set = v.turn_m[beam] * v.sets_per_rad / (range_m > v.sample_m ? range_m : v.sample_m) + 0.5f;
  return set < static_cast<float>(v.sets - 1) ? static_cast<std::int32_t>(set) : v.sets - 1;
}

struct MixedSample {
  float re, im;
};
/// The sample at `from + 2 column` of beam `j`, blurred by the wrong focus; `set` is from focus_set().
SONAR_HD inline MixedSample refocused(const BeamMixView& v, const float* from, std::int64_t stride, std::int32_t j,
                                      std::int32_t column, std::int32_t set) {
  const std::int32_t reach = v.reach[set];
  const float* tap = v.taps + 2 * (static_cast<std::int64_t>(set) * (2 * v.widest + 1) + v.widest);
  MixedSample sum{0, 0};
  for (std::int32_t d = -reach; d <= reach; ++d) {
    if (j + d < 0 || j + d >= v.beams) continue;
    const float* s = from + (j + d) * stride + 2 * static_cast<std::int64_t>(column);
    const float re = tap[2 * d], im = tap[2 * d + 1];
    sum.re += re * s[0] - im * s[1];
    sum.im += re * s[1] + im * s[0];
  }
  return sum;
}

/// The weighted sum of the sample and of both neighbouring beams. The outermost beams have only one neighbour.
SONAR_HD inline MixedSample blended(const BeamMixView& v, const float* from, std::int64_t stride, std::int32_t j,
                                    std::int32_t column) {
  const float* s = from + j * stride + 2 * static_cast<std::int64_t>(column);
  MixedSample sum{v.own[j] * s[0], v.own[j] * s[1]};
  for (std::int32_t side = -v.step; side <= v.step; side += 2 * v.step) {
    if (j + side < 0 || j + side >= v.beams) continue;
    sum.re += v.share[j] * s[side * stride];
    sum.im += v.share[j] * s[side * stride + 1];
  }
  return sum;
}

}  // namespace sonar
