// Signals that all receive channels share, with opposite signs in neighbours: noise, and of some receivers the transmitter's
// leak. The array, focused at every range, makes streaks and fringes of them (docs/acoustics.md, section 5).
#pragma once

#include <vector>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

struct PingPlan;

/// What the beams make of them, a function of the plan alone.
class SharedNoiseTable {
 public:
  SharedNoiseTable() = default;
  /// Nothing where the receiver has none. Needs the plan's columns and the level of their noise.
  explicit SharedNoiseTable(const PingPlan& plan);
  bool is_audible() const { return samples_ > 0; }
  bool has_leak() const { return !leak_.empty(); }
  int samples() const { return samples_; }  // from the first on; at larger ranges the signal falls outside the sector
  /// Complex [beams][samples]: of a signal of amplitude 1 in every channel.
  const std::vector<float>& response() const { return response_; }
  const std::vector<float>& noise_upa() const { return noise_upa_; }  // [samples] rms in a channel of what is new in every ping
  float steady() const { return steady_; }                            // amplitude of what is not, over that
  const std::vector<float>& leak_upa() const { return leak_; }        // [as far as it reaches] amplitude in a channel
  double noise_power(std::size_t beam, std::size_t sample) const;     // [uPa^2]; 0 beyond the samples
  /// What the channels of one ping share, complex [samples]; without `noise`, or without the leak of a ping that is `blank`.
  void draw(const PingNoise& key, bool noise, bool blank, std::vector<float>& shared) const;
  /// On top of the beams; of expected power: `shared` as draw_power() leaves it.
  void add(const std::vector<float>& shared, bool expected_power, BeamSignals& beams) const;
  /// E|signal|^2 of the channels in place of draw().
  void draw_power(bool noise, bool blank, std::vector<float>& shared) const;

 private:
  int samples_ = 0;
  std::vector<float> response_, noise_upa_, leak_;
  float steady_ = 0;
};

}  // namespace sonar
