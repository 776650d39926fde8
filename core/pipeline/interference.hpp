// Signals besides the echoes of the ping: leakage of the transmitter into the first rows, pulses of other sonars, and crosstalk
// between the channels. Each is a small stage of a ping. A stage without data does nothing (docs/acoustics.md, sections 5 and
// 6).
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_context.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Direct leakage of the transmitter, from the time of firing. At range r of the device, its rms pressure at a beam's output is
/// leak_upa 10^(-decay r / 20). It is complex Gaussian with the pulse's correlation, and each column has its own, like the
/// noise. It is nearly the same in every ping. SharedNoiseTable adds the steady part of a leak that the channels share.
class Leak {
 public:
  /// The leak ends after it has decayed by this much [dB]. A leak with a table ends at the table's last entry instead.
  static constexpr double most_leak_decay_db = 100;
  /// Fraction of the leak's power that is new in every ping. The true value is unknown; this one is chosen. In the captured
  /// M1200d pings it is 0.2 % in the first two rows, and about a quarter in the next five.
  static constexpr double changing_share = 0.02;
  // Amplitude factors of the two parts of the leak: sqrt(1 - changing_share) and sqrt(changing_share).
  static constexpr double steady_part = 0.98994949366116653, changing_part = 0.14142135623730951;
  static_assert(steady_part * steady_part + changing_share > 1 - 1e-15 && steady_part * steady_part + changing_share < 1 + 1e-15);
  static_assert(changing_part * changing_part / changing_share > 1 - 1e-15 &&
                changing_part * changing_part / changing_share < 1 + 1e-15);

  /// Range at which the leak ends [m]; infinity if it does not decay, 0 without a leak.
  static double reach_m(const ReceiverModel& law);

  Leak() = default;
  Leak(const PingPlan& plan, const Switches& switches);
  bool is_audible() const { return !rms_upa_.empty(); }
  const std::vector<float>& rms_upa() const { return rms_upa_; }  // rms of a column, for each sample
  float steady() const { return steady_; }                        // amplitude of the part that the columns receive in every ping
  /// Adds the leak to columns [first, last). The table of `noise` must be prepared with the request's seed and the plan's
  /// filter. In expected power the table is not used.
  void add(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals) const;

 private:
  std::vector<float> rms_upa_;
  float steady_ = 0;
};

/// A pulse of another sonar during reception: a tone after our receiver's filter.
struct ReceivedPulse {
  double sine = 0;  // direction of its arrival, y / r
  double from_sample = 0, to_sample = 0;
  double amplitude_upa = 0;     // in a beam in its direction
  double phase_turns = 0;       // at from_sample
  double turns_per_sample = 0;  // difference from our carrier
  double edge_per_sample = 0;   // b t of one sample; gives the rise of its edges after our filter
};
/// The pulses of the scene's other sonars that arrive during this ping. Each sonar sends at its own rate from a hashed start
/// time. Its sound travels one way. A surface between the two sonars blocks it.
std::vector<ReceivedPulse> receive_other_sonars(const PingContext& context, const PingRequest& request);
/// The part of a pulse that lies within samples [from, to), in a beam in its direction.
SampledPulse tone_of(const ReceivedPulse& pulse, int from, int to);
/// Adds pulses to the beams, through the receive pattern with all side lobes. In expected power, the power of the pulses is
/// added.
void add_pulses(std::span<const ReceivedPulse> pulses, const PingPlan& plan, BeamSignals& beams);

/// Each channel leaks into every beam. A single echo of amplitude A in one direction adds e A to all beams; e is crosstalk_db as
/// a factor.
class Crosstalk {
 public:
  Crosstalk() = default;
  Crosstalk(const PingPlan& plan, const Switches& switches);
  bool is_audible() const { return amplitude_ > 0; }
  void add(const PingPlan& plan, BeamSignals& beams) const;
  /// Replaces a beam by `own` times the beam plus `leaked` times the sum of all beams.
  struct Mix {
    float own = 1, leaked = 0;
  };
  Mix mix(bool expected_power) const;

 private:
  double amplitude_ = 0;
  double share_ = 1;         // factor of the sum over beams: beams overlap, so the sum counts an echo several times
  double own_in_power_ = 0;  // for expected power: 2 sum W / sum W^2, the cross term of a beam with its own leakage
};

}  // namespace sonar
