// Computes when the next ping of a sonar is due: at a start time plus a multiple of the period, so that delays do not add up, or
// once per trigger. The caller passes all times, and sets the timer.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

#include "core/base/units.hpp"
#include "core/sonar/ping_settings.hpp"

namespace sonar {

// Measures the rate of a sonar's pings, because no setting states the rate if the host requests each ping.

class RecentRate {
 public:
  void add(Time fired) {
    if (!fired_.empty() && fired < fired_.back()) fired_.clear();
    fired_.push_back(fired);
    while (fired_.size() > 2 && fired - fired_[1] >= window) fired_.pop_front();
  }
  /// Returns pings per second, over the last five seconds or, if the last two pings are farther apart, over their interval; 0
  /// after pings have stopped.
  double hz(Time now) const {
    if (fired_.size() < 2) return 0;
    const double mean_s = sonar::seconds(fired_.back() - fired_.front()) / static_cast<double>(fired_.size() - 1);
    const bool has_stopped = sonar::seconds(now - fired_.back()) > std::max(stopped_after_s, 2 * mean_s);
    return has_stopped || mean_s <= 0 ? 0 : 1 / mean_s;
  }

 private:
  static constexpr std::chrono::seconds window{5};
  static constexpr double stopped_after_s = 2;

  std::deque<Time> fired_;
};

/// Returns the time between two pings: 1 / requested rate, but at least the two-way travel time to the range plus 2 ms
/// (docs/protocols/oculus.md, section 5.6). Zero in standby.
std::chrono::nanoseconds ping_period(const PingSettings& settings);

/// Counts of ticks and triggers without a ping.
struct SkippedTicks {
  std::uint64_t late = 0;     // ticks missed because a later tick was already due
  std::uint64_t busy = 0;     // ticks that waited for the previous ping and were then skipped
  std::uint64_t trigger = 0;  // triggers that came while another one was waiting, or that were not used before pings stopped
  std::uint64_t total() const { return late + busy + trigger; }
};

class Pacer {
 public:
  /// Uses new settings. If period and trigger mode are unchanged, the grid continues. Otherwise it restarts at `now`, but not
  /// before the echoes of the last ping have returned and the shorter of the old and the new period has passed since that ping. A
  /// pending trigger is kept while pings are triggered.
  void configure(const PingSettings& settings, Time now);
  /// Call it when the clock jumps ahead: moves all times by `by`.
  void skip(std::chrono::nanoseconds by);
  /// Restarts the grid at `now`, without a pause, unless pings are triggered.
  void hurry(Time now);
  /// Stops pings until the next configure().
  void stop();
  /// Call it when a client requests a ping. One trigger can wait while the previous ping is computed. Further triggers count as
  /// skipped or, with `joins`, share the ping of the waiting trigger.
  void trigger(Time now, bool joins = false);
  /// Returns the time at which fire() must be called next; nullopt in standby, when stopped, or without a trigger.
  std::optional<Time> next_tick() const;
  /// Call it at or after next_tick(). True: make a ping now, with the stamp last_tick(). `busy`: the previous ping is being
  /// computed; the tick, or a trigger, then waits for the end of that ping. If the next tick comes first, the waiting tick is
  /// skipped and counted. A late call does not shift the grid.
  bool fire(Time now, bool busy);
  /// Call it when a ping has been computed. True: a tick has waited; make its ping now, with the stamp last_tick().
  bool fire_waiting();
  /// Skips a tick that waits.
  void forget_tick();

  Time last_tick() const { return last_tick_; }
  bool trigger_waits() const { return trigger_waits_; }
  std::chrono::nanoseconds period() const { return period_; }
  /// Returns the number of ticks that were due: skipped, fired, and a waiting tick or trigger.
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
  Time last_tick_{}, home_at_{};  // time of the last ping; time when the sound of that ping has returned
  std::uint64_t ticks_ = 0;
  SkippedTicks skipped_;
};

}  // namespace sonar
