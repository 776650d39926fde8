// A ping's samples made ready for imaging: thresholds applied, bins pooled, at least two beams of two bins. If none of this is
// needed, the samples are read in place.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/bvtsdk/core/polar_lookup.hpp"
#include "clients/bvtsdk/core/polar_ping.hpp"

namespace sonar::bvt {

/// The factor for ranges: override / the ping's sound speed, or 1 without an override (0).
double range_scale(const PolarPing& ping, int sound_speed_override_mps);
/// The smallest sample that a noise threshold, a fraction of full scale, does not set to 0.
std::uint16_t lowest_significant(float noise_threshold);

class SampleGrid {
 public:
  /// The ping must have samples and outlive this object. `pool`: number of bins that become one; its sample is the strongest of
  /// them. May throw bad_alloc.
  SampleGrid(const PolarPing& ping, float noise_threshold, float clipping_threshold, int pool);
  SampleGrid(const SampleGrid&) = delete;
  SampleGrid& operator=(const SampleGrid&) = delete;

  const PolarGrid& view() const { return view_; }
  /// Samples of the view. A single beam or bin appears twice; with a single bin the view is half as long.
  double pooled() const { return pooled_; }

 private:
  PolarGrid view_;
  double pooled_ = 1;
  std::vector<std::uint16_t> made_;
};

}  // namespace sonar::bvt
