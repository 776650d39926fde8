// Computes how far stepped time may advance, and stores the requests that wait for time. Control requests (lockstep) or the
// stamps of the vehicles' poses (follow) set the limit; with `stepped` there is none. Only the I/O thread uses it.
#pragma once

#include <functional>
#include <list>
#include <optional>
#include <string>

#include "daemon/config/runtime_options.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

class SteppedTime {
 public:
  /// Limits for one request, and for all waiting requests.
  static constexpr double longest_step_s = 3600;
  static constexpr std::size_t most_waiting = 4096;
  /// The lead over time that the poses of a simulator may have if it does not wait for pings. Earlier ticks are skipped, as in
  /// real time, unless a request waits for them.
  static constexpr std::chrono::nanoseconds most_lead = std::chrono::seconds(1);

  SteppedTime(ClockMode mode, const Clock& clock, const World& world) : mode_(mode), clock_(clock), world_(world) {}

  /// Pings and ticks of dialogues that are due up to `last_tick` may run. When no more are due, time advances to `then`.
  struct Bound {
    Time last_tick = Time::max();
    std::optional<Time> then = {};
  };
  /// Returns the bound. `for_pings`: the time at which the next ping is due or will be requested. Without a limit, time may
  /// advance to that time.
  Bound bound(std::optional<Time> for_pings = {}) const;
  /// Returns the time at which an event that was due at `due` happens.
  Time tick_at(Time due) const;

  /// Adds a step of `dt_s` after all previous steps; ticks at its end belong to the next step. Returns the reason if the step is
  /// refused, else an empty text.
  std::string step(double dt_s);

  /// `is_whole`: true if every ping that bound() allowed when the wait began has been served; false if the client has left
  /// before.
  using Reached = std::function<void(Time then, bool is_whole)>;
  /// Adds a request that waits. `reached` is called once. During a step, `has_left` is called before each ping; the step ends if
  /// it returns true.
  void wait(Reached reached, HasLeft has_left = {});
  /// Ends the present step if its client has left: the rest of its time does not pass, and later steps begin earlier. Returns
  /// whether a step has ended.
  bool end_left();
  /// True if no more requests may wait.
  bool is_full() const { return waiting_.size() >= most_waiting; }
  bool follows_poses() const { return mode_ == ClockMode::follow; }
  /// Call it when everything before `next` is done; nullopt = no event is due. Returns whether a request was answered.
  bool answer(std::optional<Time> next);

 private:
  struct Waiting {
    Bound until;
    Reached reached;
    HasLeft has_left;
  };

  ClockMode mode_;
  const Clock& clock_;
  const World& world_;
  Time asked_{};  // in lockstep: end of all requested steps
  std::list<Waiting> waiting_;
};

}  // namespace sonar
