// Computes when the next ping of a sonar is due: at multiples of the period from a start time (never a sum of sleeps), or one
// ping per trigger. Pure arithmetic on times that the caller passes; the caller of the Sonar sets the timer.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/units.hpp"
#include "core/sonar/ping_settings.hpp"

namespace sonar {

/// The time between two pings: 1 / requested rate, but at least the two-way travel time to the range plus 2 ms
/// (docs/protocols/oculus.md, section 5.6). Zero in standby.
std::chrono::nanoseconds ping_period(const PingSettings& settings);

/// Counts of ticks and triggers without a ping.
struct SkippedTicks {
  std::uint64_t late = 0;     // the next tick was already due
  std::uint64_t busy = 0;     // the previous ping was being computed until the next tick
  std::uint64_t trigger = 0;  // another trigger was waiting, or pings stopped before this trigger was used
  std::uint64_t total() const { return late + busy + trigger; }
};

class Pacer {
 public:
  /// Uses new settings. If period and trigger mode are unchanged, the grid continues. Otherwise it restarts at `now`, but not
  /// before the echoes of the last ping have returned and the shorter of both periods has passed since that ping. A pending
  /// trigger is kept while pings are triggered.
  void configure(const PingSettings& settings, Time now);
  /// Call it when the clock jumps ahead: moves all times by `by`.
  void skip(std::chrono::nanoseconds by);
  /// Free running: the grid restarts at `now`, at once.
  void hurry(Time now);
  /// No pings until the next configure().
  void stop();
  /// A client requests a ping. One trigger can wait while the previous ping is computed. Further triggers count as skipped or,
  /// with `joins`, share the waiting one.
  void trigger(Time now, bool joins = false);
  /// The time at which fire() must be called next; none in standby, when stopped, or without a trigger.
  std::optional<Time> next_tick() const;
  /// Call it at or after next_tick(). True: make a ping now, with the stamp last_tick(). `busy`: the previous ping is being
  /// computed; then the tick waits for its end or for the next tick, which replaces it (it is skipped and counted). A trigger
  /// waits too. A late call does not shift the grid.
  bool fire(Time now, bool busy);
  /// Call it when a ping has been computed. True: a tick has waited for that; make its ping now, with the stamp last_tick().
  bool fire_waiting();
  /// Skips a tick that waits.
  void forget_tick();

  Time last_tick() const { return last_tick_; }
  bool trigger_waits() const { return trigger_waits_; }
  std::chrono::nanoseconds period() const { return period_; }
  /// Number of ticks that were due: skipped, fired, and a waiting tick or trigger.
  std::uint64_t ticks() const { return ticks_; }
  const SkippedTicks& skipped() const { return skipped_; }
  std::uint64_t skipped_ticks() const { return skipped_.total(); }

 private:
  void forget_trigger();
  void note_ping(Time at);

  bool running_ = false, triggered_ = false, tick_waits_ = false, trigger_waits_ = false, has_fired_ = false;
  std::chrono::nanoseconds period_{0}, travel_{0};  // travel_: travel time of sound to the range and back
  Time start_{};                                    // start of the grid
  std::int64_t index_ = 0;                          // index of the next tick on the grid; a waiting tick comes before it
  Time trigger_at_{};
  Time last_tick_{}, home_at_{};  // time of the last ping; time when its sound has returned
  std::uint64_t ticks_ = 0;
  SkippedTicks skipped_;
};

}  // namespace sonar
