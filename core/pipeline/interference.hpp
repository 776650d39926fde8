// Signals besides the ping's own echoes: leakage of the transmitter into the first rows, pulses of other sonars, and crosstalk
// between the channels. They are three small stages of a ping, each of which does nothing without its data (docs/acoustics.md,
// sections 5 and 6).
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_context.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Direct leakage of the transmitter, from the moment it fires: rms pressure at a beam's output leak_upa 10^(-decay r / 20) over
/// the device's range r, complex Gaussian with the pulse's correlation, per column like the noise. Nearly the same in every ping.
/// The steady part of a leak that the channels share is added by SharedNoiseTable.
class Leak {
 public:
  /// How far it may decay before it is left out [dB]. A table ends with its last entry, and may have nulls.
  static constexpr double forgotten_db = 100;
  /// unknown: chosen. Share of its power that is new in every ping; in the captured M1200d pings 0.2 % in the first two rows,
  /// about a quarter in the next five.
  static constexpr double changing_share = 0.02;
  // Factors of its amplitude: sqrt(1 - changing_share), sqrt(changing_share).
  static constexpr double steady_part = 0.98994949366116653, changing_part = 0.14142135623730951;
  static_assert(steady_part * steady_part + changing_share > 1 - 1e-15 && steady_part * steady_part + changing_share < 1 + 1e-15);
  static_assert(changing_part * changing_part / changing_share > 1 - 1e-15 &&
                changing_part * changing_part / changing_share < 1 + 1e-15);

  /// Where it ends [m]; infinity where it does not decay, 0 where there is none.
  static double reach_m(const ReceiverModel& law);

  Leak() = default;
  Leak(const PingPlan& plan, const Switches& switches);
  bool is_audible() const { return !rms_upa_.empty(); }
  const std::vector<float>& rms_upa() const { return rms_upa_; }  // rms of a column, for each sample
  float steady() const { return steady_; }                        // amplitude of the part that the columns receive in every ping
  /// Adds it to columns [first, last). The table of `noise` must be prepared with the request's seed and the plan's filter;
  /// unused in expected power.
  void add(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals) const;

 private:
  std::vector<float> rms_upa_;
  float steady_ = 0;
};

/// A pulse of another sonar while we listen: a tone through our receiver, somewhere on the sample grid.
struct ReceivedPulse {
  double sine = 0;  // direction from which it comes, y / r at its arrival
  double from_sample = 0, to_sample = 0;
  double amplitude_upa = 0;     // in a beam that looks at it
  double phase_turns = 0;       // at from_sample
  double turns_per_sample = 0;  // off our carrier
  double edge_per_sample = 0;   // b t of one sample: how softly our filter lets it begin and end
};
/// The pulses of the scene's other sonars that arrive during this ping: each sends at its own rate from a hashed moment on, its
/// sound travels one way; a surface in between hides it.
std::vector<ReceivedPulse> receive_other_sonars(const PingContext& context, const PingRequest& request);
/// Samples [from, to) of a pulse in a beam that points at it, as far as it reaches.
SampledPulse tone_of(const ReceivedPulse& pulse, int from, int to);
/// On top of the beams, through the receive pattern with all its side lobes. In expected power, its power.
void add_pulses(std::span<const ReceivedPulse> pulses, const PingPlan& plan, BeamSignals& beams);

/// Every channel in every beam: a lone echo of amplitude A in one direction adds e A to all beams, e = crosstalk_db.
class Crosstalk {
 public:
  Crosstalk() = default;
  Crosstalk(const PingPlan& plan, const Switches& switches);
  bool is_audible() const { return amplitude_ > 0; }
  void add(const PingPlan& plan, BeamSignals& beams) const;
  /// A beam becomes `own` times itself plus `leaked` times the sum of all beams.
  struct Mix {
    float own = 1, leaked = 0;
  };
  Mix mix(bool expected_power) const;

 private:
  double amplitude_ = 0;
  double share_ = 1;         // share of the sum over beams that belongs to one echo, because beams overlap
  double own_in_power_ = 0;  // expected power: 2 sum W / sum W^2, how a beam adds up with its own leakage
};

}  // namespace sonar
