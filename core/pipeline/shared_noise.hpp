// Noise that all receive channels share, with opposite signs in neighbours: the array, focused at every range, makes streaks of
// it (docs/acoustics.md, section 5).
#pragma once

#include <vector>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

struct PingPlan;

/// What the beams make of it, a function of the plan alone.
class SharedNoiseTable {
 public:
  SharedNoiseTable() = default;
  /// Nothing where the receiver has none. Needs the plan's columns and the level of their noise.
  explicit SharedNoiseTable(const PingPlan& plan);
  bool is_audible() const { return samples_ > 0; }
  int samples() const { return samples_; }  // from the first on; at larger ranges the noise falls outside the sector
  /// Complex [beams][samples]: of a unit draw at that sample [uPa].
  const std::vector<float>& response() const { return response_; }
  /// The draws of one ping, complex [samples], E|c|^2 = 1.
  void draw(const PingNoise& noise, std::vector<float>& draws) const;
  /// On top of the beams; in expected power its power, without `draws`.
  void add(const std::vector<float>& draws, bool expected_power, BeamSignals& beams) const;

 private:
  int samples_ = 0;
  std::vector<float> response_;
};

}  // namespace sonar
