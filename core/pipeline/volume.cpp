#include "core/pipeline/volume.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/units.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "core/pipeline/arithmetic/noise_place.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"

namespace sonar {
namespace {

// Least number of slices for the integral over psi in eq. 17, if the fan has enough bins; by rounding there may be almost twice
// as many. Every column processes all slices for its shadows.
constexpr int fewest_slices = 256;

}  // namespace

// The width of a column in eq. 17: du for cones. For flat beams it is dtheta = du / cos(theta), with u = sin(theta).
double volume_column_width(const PingPlan& plan, int column) {
  const double u = plan.columns.sine(column), across = 1 - u * u;
  if (!(across > 0)) return 0;
  return plan.switches.conical ? plan.columns.spacing : plan.columns.spacing / std::sqrt(across);
}

Volume::Volume(const WaterColumn& water, const PingPlan& plan, const PingScalars& scalars) : plan_(plan), scalars_(scalars) {
  if (!plan.switches.volume || !water.has_volume()) return;
  const Fan& fan = plan.fan;
  // D_v of eq. 34. Without a pattern the factor is 1 in the whole fan.
  const bool has_pattern = plan.mode.pattern.elevation_taper != Taper::unit;
  const double aperture = has_pattern ? elevation_aperture_in_wavelengths(plan.mode.pattern) : 0;
  const int bins_a_slice = std::max(1, fan.bins / fewest_slices);
  for (int from = 0; from < fan.bins; from += bins_a_slice) {
    const auto angle = [&](double bin) {
      return std::atan(static_cast<double>(tangent_of_bin(fan.axis, static_cast<float>(bin))));
    };
    // D_v^2 dpsi [rad] by the midpoint rule. For flat beams, dOmega has a further factor cos(psi).
    const double psi = angle(from + 0.5 * bins_a_slice), amplitude = has_pattern ? elevation_two_way(aperture, psi) : 1;
    const double solid = plan.switches.conical ? 1 : std::cos(psi);
    slices_.push_back(
        {from + bins_a_slice / 2, 1 / std::cos(psi), amplitude * amplitude * solid * (angle(from + bins_a_slice) - angle(from))});
    open_fan_ += slices_.back().weight;
  }
  // docs/acoustics.md, eq. 17: sigma = 10^(S_v / 10) Psi r^2 (c / 2) tau_eff. Its echo falls as r^-4.
  const double at_1_m = scalars.source_upa * scalars.source_upa * power_from_db(static_cast<double>(water.volume_db)) * 0.5 *
                        scalars.sound_speed_mps * plan.pulse_shape.energy_width_s();
  // Power [uPa^2] for Psi = 1: source^2 times sigma of eq. 17, times e^{-4 a r} / r^4 for the way out and back.
  for (int n = 0; n < plan.samples; ++n) {
    const double r = (n + scalars.sample_offset) / scalars.samples_per_m;
    open_power_.push_back(at_1_m * std::pow(r * two_way_transmission(r, scalars.absorption_np_per_m), 2));
  }
}

void Volume::find_blocked(const DepthMap& seen, int column, std::vector<double>& blocked) const {
  std::fill(blocked.begin(), blocked.end(), 0.0);
  const float* map = seen.inverse_x.data() + static_cast<std::ptrdiff_t>(column - seen.first_column) * (seen.bins + 1);
  const double u = plan_.columns.sine(column);
  const double per_x = plan_.switches.conical ? 1 / std::sqrt(std::max(1 - u * u, 1e-12)) : 1;  // r / x = per_x / cos(psi)
  // A slice of the fan ends at the surface that rays hit. From the sample of that surface on, the slice's weight is subtracted.
  for (const Slice& slice : slices_) {
    const auto inverse_x = static_cast<double>(map[slice.bin]);
    if (!(inverse_x > 0)) continue;
    // Surfaces that are nearer than the record block the slice from the first sample on.
    const double sample = scalars_.sample_of(per_x * slice.range_per_x / inverse_x);
    if (sample < static_cast<double>(blocked.size())) blocked[static_cast<std::size_t>(std::max(sample, 0.0))] += slice.weight;
  }
}

void Volume::add(const DepthMap* seen, const PingNoise& noise, int first, int last, VolumeScratch& scratch,
                 ColumnSignals& signals) const {
  const std::size_t samples = open_power_.size();
  scratch.blocked.assign(samples, 0.0);
  scratch.rms.resize(samples);
  for (int k = first; k < last; ++k) {
    if (seen) find_blocked(*seen, k, scratch.blocked);
    const double width = volume_column_width(plan_, k);
    // max(0): the remaining weights are a difference, which could become negative by rounding.
    double open = open_fan_;
    float* at = signals.column(k) + 2 * signals.lead;
    for (std::size_t n = 0; n < samples; ++n) {
      open = std::max(0.0, open - scratch.blocked[n]);
      const double power = open_power_[n] * open * width;
      if (plan_.expected_power)
        at[2 * n] += static_cast<float>(power);
      else
        scratch.rms[n] = static_cast<float>(std::sqrt(power));
    }
    if (plan_.expected_power) continue;
    scratch.grains.assign(2 * samples, 0.0f);
    // Grains have unit power and the pulse's correlation. Their column numbers differ from those of the noise
    // (noise_place.hpp).
    noise.table->add(noise.sonar, noise.ping, static_cast<int>(first_volume_column) + k, 1, static_cast<int>(samples),
                     scratch.grains.data());
    for (std::size_t i = 0; i < 2 * samples; ++i) at[i] += scratch.rms[i / 2] * scratch.grains[i];
  }
}

}  // namespace sonar
