// Mixes neighbouring beams: near the sonar because the array is focused only for broadside, and everywhere by a fitted share
// (docs/acoustics.md, section 6). A function of the plan alone.
#pragma once

#include <cstddef>
#include <vector>

#include "core/pipeline/arithmetic/beam_mix.hpp"
#include "core/pipeline/signals.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

struct PingPlan;

/// A table of a product at a sine, see BeamProfile; linear between its values, `top` the sine of the sector's edge.
double at_sine(const std::vector<float>& table, double sine, double top);

class BeamMix {
 public:
  BeamMix() = default;
  /// Empty where beams are not even in the sine.
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
  /// Works in place; `scratch` keeps its memory. Does nothing if blurs() or blends() is false.
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

}  // namespace sonar
