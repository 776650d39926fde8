// Tables of a plan: for beamforming by a transform, for mixing beams, and for noise that channels share. beam_transform.cpp,
// beam_mix.cpp and shared_noise.cpp make and use them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/arithmetic/beam_mix.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/noise.hpp"
#include "core/pipeline/signals.hpp"
#include "core/pipeline/simd/kernels.hpp"

namespace sonar {

struct PingPlan;

/// Tables for forming all beams from all columns at once. Columns are uniform in the sine, so the sum over columns
/// (form_beams.hpp) is a convolution. A Fourier transform of twice the length computes it exactly. Beams between columns are
/// interpolated with a few weights, because the aperture limits how fast the response changes. form_beams() uses this class
/// instead of wide bands of weights.
class BeamTransformTables {
 public:
  /// Makes the tables. The relative error of the interpolation is at most 2e-6 for columns up to 0.35 of a beam apart (single
  /// precision: 1e-6).
  BeamTransformTables(const ReceivePattern& pattern, const Columns& columns, const std::vector<double>& beam_sines);
  /// Makes the tables for as many beams as columns, beam k at column k. The weight of columns d away is of_distance[d].
  explicit BeamTransformTables(const std::vector<double>& of_distance);
  BeamTransformTables(const BeamTransformTables&) = delete;
  BeamTransformTables& operator=(const BeamTransformTables&) = delete;

  const simd::BeamTransform& tables() const { return tables_; }
  /// Number of floats of working memory for the kernel, 64-byte aligned.
  std::size_t work_floats() const { return static_cast<std::size_t>(4 * tables_.quarter) * 32; }

  std::size_t bytes() const;
  /// Number of vector operations for a group of sixteen samples, for a comparison with a band of weights.
  double cost() const;

 private:
  void lay_out(int columns, int beams);
  void plan_passes();
  void transform_weights(const std::vector<double>& of_distance);
  void point_at_tables();
  void compute_interpolation(double aperture_in_spacings, const Columns& columns, const std::vector<double>& beam_sines);

  simd::BeamTransform tables_;
  std::vector<float> split_, response_, between_;
  std::vector<std::vector<float>> turns_;
  std::vector<std::int32_t> first_column_;
};

/// Value of a product's table (BeamProfile) at a sine; linear between the table's values. `top`: sine of the sector's edge.
double at_sine(const std::vector<float>& table, double sine, double top);

/// Mixes neighbouring beams. Near the sonar they are mixed because the array is focused only for broadside; at all ranges a
/// fitted fraction of the neighbours is added (docs/acoustics.md, section 6). The tables depend only on the plan.
class BeamMix {
 public:
  BeamMix() = default;
  /// The tables stay empty if beams are not uniform in the sine.
  explicit BeamMix(const PingPlan& plan);
  bool blurs() const { return !turn_m_.empty(); }
  bool blends() const { return !own_.empty(); }
  const std::vector<float>& turn_m() const { return turn_m_; }
  const std::vector<float>& taps() const { return taps_; }
  const std::vector<std::int32_t>& reach() const { return reach_; }
  const std::vector<float>& own() const { return own_; }
  const std::vector<float>& share() const { return share_; }
  BeamMixView view() const;
  std::size_t bytes() const;
  /// blur() and blend() work in place; `scratch` keeps its memory. They do nothing if blurs() or blends() is false.
  void blur(const simd::Kernels& kernels, BeamSignals& beams, std::vector<float>& scratch) const;
  void blend(BeamSignals& beams, std::vector<float>& scratch) const;

 private:
  void lay_out_focus(const PingPlan& plan, double spacing);
  void lay_out_blend(const PingPlan& plan, double spacing);

  std::vector<float> turn_m_, taps_, own_, share_;
  std::vector<std::int32_t> reach_;
  std::int32_t widest_ = 0, step_ = 1;
  float first_range_m_ = 0, sample_m_ = 1, largest_turn_m_ = 0;
};

/// Weights of the beams for shared noise. They depend only on the plan.
class SharedNoiseTable {
 public:
  static constexpr std::size_t block_samples = 32;  // samples that are stored or omitted together
  SharedNoiseTable() = default;
  /// The table stays empty if the receiver has no shared noise. The plan must have its columns and the level of their noise.
  SharedNoiseTable(const PingPlan& plan, Parallel& pool);
  bool is_audible() const { return samples_ > 0; }
  bool has_leak() const { return !leak_upa_.empty(); }
  int samples() const { return samples_; }  // number of samples with shared noise; in later ones it lies outside the sector
  std::size_t parts() const { return parts_; }
  /// Real and imaginary part, [parts][beams][2][samples], of the response to a signal of amplitude 1. In each part but the last,
  /// the signal is in the channels of one group; in the last, in all channels.
  std::vector<float> response() const;
  std::size_t bytes() const {
    return sizeof(float) * (stored_.capacity() + noise_upa_.capacity() + steady_upa_.capacity() + leak_upa_.capacity()) +
           sizeof(std::uint32_t) * at_.capacity();
  }
  // Levels in a channel by sample: noise_upa, rms of the noise that differs between pings and groups; steady_upa, amplitude of
  // the noise that does not differ; leak_upa, amplitude of the leak, up to its last sample.
  const std::vector<float>& noise_upa() const { return noise_upa_; }
  const std::vector<float>& steady_upa() const { return steady_upa_; }
  const std::vector<float>& leak_upa() const { return leak_upa_; }
  double noise_power(std::size_t beam, std::size_t sample) const;  // [uPa^2]; 0 beyond the samples
  /// Draws the shared part of one ping's channels, [parts][2][samples]; in expected power, its rms. `noise` and `leak` select
  /// what is drawn.
  void draw(const PingNoise& key, bool noise, bool leak, bool expected_power, std::vector<float>& shared) const;
  /// Adds the shared signals to the beams.
  void add(const std::vector<float>& shared, bool expected_power, BeamSignals& beams) const;

 private:
  /// [2][block_samples] of a part in a beam, or null if the block is omitted.
  const float* stored(std::size_t part, std::size_t beam, std::size_t block) const;
  struct Block;
  void gather(std::vector<Block>& blocks);

  int samples_ = 0;
  std::size_t parts_ = 0, beams_ = 0, blocks_ = 0;
  std::vector<std::uint32_t> at_;  // [parts][beams][blocks]: number of the block in stored_, from 1; 0: none
  std::vector<float> stored_;      // [stored blocks][2][block_samples]
  std::vector<float> noise_upa_, steady_upa_, leak_upa_;
};

}  // namespace sonar
