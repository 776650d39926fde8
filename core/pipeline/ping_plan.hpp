// All values of a ping that depend only on the model and the client's settings: columns, sample grid, pulse and beamforming
// tables, noise filter, gains. They are computed when settings change. All stages use them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "core/pipeline/plan_tables.hpp"
#include "core/pipeline/pulses/pulse.hpp"
#include "core/pipeline/signals.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/pipeline/spectral_columns.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Directions of the rays: angles about the array axis, and the tangents that form an axis of the depth map.
struct Fan {
  double half_angle_rad = 0;  // half the angle of the main part; the fixed fan and mirror paths cover only this part
  double reach_rad = 0;       // half the angle with the side lobes
  TangentAxis axis{};
  int bins = 0;
  std::vector<float> tangent;        // tangents of the lower edge of every bin, and of the end: bins + 1
  std::vector<float> elevation_rad;  // the base fan, from bottom to top
  // Number of elevations at each end that lie in side lobes. They are not refined, and side_columns neighbouring columns share
  // their rays.
  int side_elevations = 0;
  bool is_side(int interval) const {
    return interval < side_elevations || interval + 1 >= static_cast<int>(elevation_rad.size()) - side_elevations;
  }
};

/// A ray of the fixed fan: its elevation about the array axis. weight: pattern times the root of the solid angle. For flat
/// beams it excludes the factor that depends on the column.
struct FixedFanRay {
  float elevation_rad = 0, cosine = 1, sine = 0, weight = 0;
};

/// Weights of four neighbouring beams for the columns that they share.
struct BeamPanel {
  int first_beam = 0;  // the four beams first_beam .. +3; those past the last beam have zero weights
  int first_column = 0, count = 0;
  std::size_t weights = 0;  // offset into BeamWeights::weights, count x 4 values
};
/// Options for the sums of columns that form beams.
struct BeamWeightOptions {
  double dropped_energy = 1e-4;  // fraction of energy outside the band: -40 dB
  bool transform = true;         // use a transform instead of a band if the beams allow it and it is faster
};
struct BeamWeights {
  int half_band = 0;  // number of columns on either side that a beam sums
  std::vector<BeamPanel> panels;
  std::vector<float> weights;
  std::shared_ptr<const BeamTransformTables> transform;  // if set, there are no panels: it sums all columns faster
  double weight_energy = 1;                              // sum_k W_jk^2 of a beam of the pattern's width
};

/// Noise power of a column at a sample / column_noise_upa^2: far + near_less_far * decay (docs/acoustics.md, section 5).
struct NoiseProfile {
  std::vector<float> far, near_less_far;  // [columns]; empty = uniform
  std::vector<float> decay;               // [samples], up to the last one that is not negligible

  bool is_even() const { return far.empty(); }
};

struct PingPlan {
  FrequencyMode mode;
  PingSettings settings;
  Switches switches;
  bool expected_power = false;
  int fixed_fan = 0;
  std::vector<FixedFanRay> fixed_fan_rays;

  Columns columns;
  Fan fan;
  BeamWeights beam_weights;
  double bearing_scale = 1;                  // bearing_scale_of() the request
  std::vector<float> beam_azimuth_rad;       // as the device reports them
  std::vector<double> beam_sine;             // true sines, like all sines here except in tables by reported sine
  std::vector<ReceivePattern> beam_pattern;  // [beams]

  // The sample grid. Sample n lies at the device range (n + sample_offset) sample_spacing_m.
  int samples = 0;  // rows * samples_per_row
  double sample_spacing_m = 0;
  double start_samples = 0;    // device range of the picture's near edge, in spacings
  double sample_offset = 0.5;  // start_samples plus the sample's position in its spacing, see PingSettings::row_centre
  double sample_time_s = 0;    // 2 sample_spacing_m / the device's sound speed
  Pulse pulse_shape;
  double pulse_width_m = 0;       // -3 dB, from the settings or from a measured pulse; in metres as the device computes them
  std::vector<float> pulse_rows;  // simd::PulseRows
  int taps = 8, pulse_steps = 256;
  double envelope_hz = 0;                           // b of the Gaussian of pulse_width_m
  std::shared_ptr<const SpectralColumns> spectral;  // if set, used instead of pulse_rows

  std::vector<CellLevel> levels;    // coarsest first
  std::vector<float> elevation;     // polynomial of the two-way pattern in sin^2(angle)
  std::vector<float> pulse_filter;  // minimum-phase taps that give white noise the pulse's correlation on this grid
  std::vector<float> noise_filter;  // taps for the receiver's noise, whose filter may be wider
  double column_noise_upa = 0;      // rms of one column
  NoiseProfile noise_profile;
  SharedNoiseTable shared_noise;
  BeamMix beam_mix;
  std::vector<float> row_power_factor;   // per row: (gain * TVG / full scale)^2
  std::vector<std::uint32_t> row_gain;   // set if settings.format.row_gains
  std::vector<float> beam_power_factor;  // per beam: gain of its channel, squared; empty = all equal

  /// Direction of a point in the sonar's axes, for conical beams (about the array's axis) or flat ones.
  ConicalDirection direction_of(Vec3d from_sonar) const {
    return switches.conical ? conical_from_sonar(from_sonar) : flat_from_sonar(from_sonar);
  }
  /// The column of a direction; nullopt if there is none, or if the elevation exceeds half_angle_rad.
  std::optional<std::size_t> column_of(const ConicalDirection& direction, double half_angle_rad) const;
  /// A cell counts as visible up to this distance behind the depth map, because the map is interpolated linearly between rays.
  float depth_tolerance_m() const { return depth_tolerance_in_pulses * static_cast<float>(pulse_width_m); }
  static constexpr float depth_tolerance_in_pulses = 1.5f;  // docs/acoustics.md, section 3
  /// Largest angle about the array's axis in a fan with this half angle. For flat beams it exceeds the half angle, because away
  /// from the middle the same elevation is a larger angle about the axis.
  double widest_about_axis_rad(double half_angle_rad) const;
  /// Number of the column whose rays are used for column k in the side lobes.
  int side_column(int k) const { return std::min(k - k % side_columns + side_columns / 2, columns.count - 1); }
  static constexpr int side_columns = 4;
  /// Sets the members of `view` that describe the fan and the levels of cells.
  void aim(CellView& view) const;
  bool truncates() const { return switches.truncation && mode.receiver.truncates; }
  simd::PulseRows pulse() const { return {pulse_rows.data(), taps, pulse_steps}; }
};

/// Computes a plan. The result does not depend on the number of threads.
PingPlan make_plan(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches, Parallel& pool,
                   double bearing_scale = 1);
PingPlan make_plan(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches, double bearing_scale = 1);
/// Wavelength of the centre frequency, at the sound speed that the device assumes [m].
double device_wavelength_m(const FrequencyMode& mode, const PingSettings& settings);
/// Changes only the client's gain, because the gain may differ in every ping.
void set_gain(PingPlan& plan, float gain_db);
/// True if the plan is valid for this request. The gain (see set_gain()) and settings that affect no table are not compared.
bool serves(const PingPlan& plan, const PingRequest& request);

// Functions that make parts of a plan.
Columns make_columns(const FrequencyMode& mode, int beam_count);
std::vector<ReceivePattern> receive_patterns(const FrequencyMode& mode, std::size_t beams);
std::vector<double> make_beam_sines(const FrequencyMode& mode, int beam_count);
BeamWeights make_beam_weights(const FrequencyMode& mode, const Columns& columns, const std::vector<double>& beam_sines,
                              bool squared, const BeamWeightOptions& options = {});
std::vector<CellLevel> make_cell_levels(double pulse_width_m, double beam_width_rad, double max_range_m);
}  // namespace sonar
