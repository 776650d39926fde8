// Signals that receive channels share, with opposite signs in neighbours: noise, and in some receivers the transmitter's leak. An
// array that is focused at every range turns them into wide grains and fringes (docs/acoustics.md, section 5).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/noise.hpp"
#include "core/pipeline/signals.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

struct PingPlan;

/// The fault of the numbers of channels and of a group; empty for valid ones.
std::string why_impossible(const SharedNoise& law);
/// Why the table below would need too much memory or time; empty if it does not. Needs possible numbers of channels.
std::string why_table_too_large(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches);

/// Weights of the beams for shared noise, a function of the plan alone.
class SharedNoiseTable {
 public:
  static constexpr std::size_t block_samples = 32;  // kept or left out together
  SharedNoiseTable() = default;
  /// Empty if the receiver has none. Needs the plan's columns and the level of their noise.
  SharedNoiseTable(const PingPlan& plan, Parallel& pool);
  bool is_audible() const { return samples_ > 0; }
  bool has_leak() const { return !leak_upa_.empty(); }
  int samples() const { return samples_; }  // from the first on; at larger ranges the signal falls outside the sector
  std::size_t parts() const { return parts_; }
  /// Real and imaginary part, [parts][beams][2][samples]: of a signal of amplitude 1 in the channels of a group; in the last
  /// part, in all channels.
  std::vector<float> response() const;
  std::size_t bytes() const {
    return sizeof(float) * (heard_.capacity() + noise_upa_.capacity() + steady_upa_.capacity() + leak_upa_.capacity()) +
           sizeof(std::uint32_t) * at_.capacity();
  }
  // In a channel. Of what is new in every ping and by group, rms [samples]; of what is not, amplitude [samples]; of the leak,
  // amplitude [as far as it reaches].
  const std::vector<float>& noise_upa() const { return noise_upa_; }
  const std::vector<float>& steady_upa() const { return steady_upa_; }
  const std::vector<float>& leak_upa() const { return leak_upa_; }
  double noise_power(std::size_t beam, std::size_t sample) const;  // [uPa^2]; 0 beyond the samples
  /// Draws the shared part of one ping's channels, [parts][2][samples], or its rms; without the noise, or without the leak.
  void draw(const PingNoise& key, bool noise, bool leak, bool expected_power, std::vector<float>& shared) const;
  /// On top of the beams.
  void add(const std::vector<float>& shared, bool expected_power, BeamSignals& beams) const;

 private:
  /// [2][block_samples] of a part in a beam, or null where it is left out.
  const float* heard(std::size_t part, std::size_t beam, std::size_t block) const;
  struct Block;
  void gather(std::vector<Block>& blocks);

  int samples_ = 0;
  std::size_t parts_ = 0, beams_ = 0, blocks_ = 0;
  std::vector<std::uint32_t> at_;  // [parts][beams][blocks]: number of the block in heard_, from 1; 0: none
  std::vector<float> heard_;       // [received blocks][2][block_samples]
  std::vector<float> noise_upa_, steady_upa_, leak_upa_;
};

}  // namespace sonar
