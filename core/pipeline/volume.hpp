// Reverberation of the water: particles scatter a little everywhere up to the first solid surface. The reverberation is added
// to the column signals between synthesis and beamforming (docs/acoustics.md, section 3).
#pragma once

#include <vector>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Buffers of Volume::add that are kept from ping to ping; one per worker.
struct VolumeScratch {
  std::vector<double> blocked;     // part of the fan that ends at each sample
  std::vector<float> rms, grains;  // by sample; grains are complex
};

/// Solid angle of a column per radian about the array.
double volume_column_width(const PingPlan& plan, int column);

/// The volume reverberation of one ping. It is absent in clear water and if it is switched off.
class Volume {
 public:
  Volume(const WaterColumn& water, const PingPlan& plan, const PingScalars& scalars);

  /// A slice of the fan: its middle bin, 1 / cos(psi) there, and the integral of the two-way power pattern over it [rad].
  struct Slice {
    int bin;
    double range_per_x, weight;
  };

  bool is_audible() const { return !open_power_.empty(); }
  /// Adds the reverberation to columns [first, last), before the transmitter's pattern is applied. `seen`: the depth map of
  /// these columns; null = no surface ends the fan. The reverberation differs for every (seed, sonar, ping). In expected power
  /// its mean is added, and `noise` is not used.
  void add(const DepthMap* seen, const PingNoise& noise, int first, int last, VolumeScratch& scratch,
           ColumnSignals& signals) const;

  // The data of add(), for engines that compute the same values on a device.
  const std::vector<Slice>& slices() const { return slices_; }
  double open_fan() const { return open_fan_; }
  const std::vector<double>& open_power_upa2() const { return open_power_; }

 private:
  void find_blocked(const DepthMap& seen, int column, std::vector<double>& blocked) const;

  const PingPlan& plan_;
  const PingScalars& scalars_;
  std::vector<Slice> slices_;
  double open_fan_ = 0;             // sum of the weights
  std::vector<double> open_power_;  // for each sample: power per weight, without the column's width [uPa^2]
};

}  // namespace sonar
