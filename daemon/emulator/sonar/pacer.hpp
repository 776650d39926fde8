// Computes when the next ping of one sonar is due: on a grid from its start (never a sum of sleeps), or one ping per trigger.
// Pure arithmetic on times passed in; the Sonar asks it and its caller sets the timer.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/units.hpp"
#include "core/sonar/ping_settings.hpp"

namespace sonar {

/// Time between two pings that these settings allow: the rate asked for, and never less than the two-way travel of sound to the
/// range plus 2 ms (docs/protocols/oculus.md, section 5.6). Zero in standby.
std::chrono::nanoseconds ping_period(const PingSettings& settings);

/// Ticks and triggers that no ping came of.
struct SkippedTicks {
  std::uint64_t late = 0;     // the next one was due already
  std::uint64_t busy = 0;     // the ping before it was still being computed
  std::uint64_t trigger = 0;  // one waited already, or pings ended before its turn
  std::uint64_t total() const { return late + busy + trigger; }
};

class Pacer {
 public:
  /// New settings. The grid continues if period and trigger mode stay the same; otherwise it restarts at `now`, but not before
  /// the sound of the last ping has come back, and not sooner after it than the shorter of both periods. A pending trigger is
  /// kept as long as pings are triggered.
  void configure(const PingSettings& settings, Time now);
  /// The clock jumps ahead by `by`: everything is due as long from now as it was.
  void skip(std::chrono::nanoseconds by);
  /// No pings until the next configure().
  void stop();
  /// A trigger from the client; one is kept while the previous ping is still under way, more are counted as skipped,
  /// unless they join the one that waits.
  void trigger(Time now, bool joins = false);
  /// When fire() wants to be called next; none in standby, when stopped or waiting for a trigger.
  std::optional<Time> next_tick() const;
  /// At or after next_tick(): true = ping now, stamped with last_tick(). `busy`: the previous ping is still being computed; its
  /// ticks are skipped and counted, never queued (a trigger waits instead). A late call does not shift the grid.
  bool fire(Time now, bool busy);

  Time last_tick() const { return last_tick_; }
  bool trigger_waits() const { return trigger_waits_; }
  std::chrono::nanoseconds period() const { return period_; }
  /// Ticks that were due: those skipped, those fired, and a trigger that waits.
  std::uint64_t ticks() const { return ticks_; }
  const SkippedTicks& skipped() const { return skipped_; }
  std::uint64_t skipped_ticks() const { return skipped_.total(); }

 private:
  void forget_trigger();
  void note_ping(Time at);

  bool running_ = false, triggered_ = false, trigger_waits_ = false, has_fired_ = false;
  std::chrono::nanoseconds period_{0}, travel_{0};  // travel: of sound to the range and back
  Time start_{};                                    // start of the grid
  std::int64_t index_ = 0;                          // index of the next tick on the grid
  Time trigger_at_{};
  Time last_tick_{}, home_at_{};  // time of the last ping, and when its sound is back
  std::uint64_t ticks_ = 0;
  SkippedTicks skipped_;
};

}  // namespace sonar
