// Computes how far stepped time may advance, and keeps the requests that wait for it: nothing bounds it (stepped), control
// requests do (lockstep), or the stamps of the vehicles' poses do (follow). Used by Stepper and by control requests; I/O thread
// only.
#pragma once

#include <functional>
#include <list>
#include <optional>
#include <string>

#include "daemon/config/clock_mode.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

class SteppedTime {
 public:
  /// Limit of one request, and of all that wait.
  static constexpr double longest_step_s = 3600;
  static constexpr std::size_t most_waiting = 4096;
  /// Poses of a simulator that does not wait for pings lead by no more than this; ticks before are skipped as in real time, but
  /// for those that a request waits for.
  static constexpr std::chrono::nanoseconds most_lead = std::chrono::seconds(1);

  SteppedTime(ClockMode mode, const Clock& clock, const World& world) : mode_(mode), clock_(clock), world_(world) {}

  /// Pings that are due up to `last_tick` may come, and so may what else conversations have to do; when there is no more, it is
  /// `then`.
  struct Bound {
    Time last_tick = Time::max();
    std::optional<Time> then = {};
  };
  /// `for_pings`: when the next ping is due, or will be asked for. Time that steps by itself passes as far as that.
  Bound bound(std::optional<Time> for_pings = {}) const;
  /// When what was due at `due` comes.
  Time tick_at(Time due) const;

  /// Lets time pass by `dt_s` after all steps before: ticks at its end belong to the next step. Empty, or a sentence why not.
  std::string step(double dt_s);

  using Reached = std::function<void(Time then)>;
  /// `reached` is called when every ping that bound() allows at this moment has been served, and it is `then`.
  void wait(Reached reached);
  /// No more requests may wait; one whose client hangs up is kept until its time is reached.
  bool is_full() const { return waiting_.size() >= most_waiting; }
  bool follows_poses() const { return mode_ == ClockMode::follow; }
  /// All is done that was due before `next`; nothing = nothing more is due. Whether there was anybody to answer.
  bool answer(std::optional<Time> next);

 private:
  struct Waiting {
    Bound until;
    Reached reached;
  };

  ClockMode mode_;
  const Clock& clock_;
  const World& world_;
  Time asked_{};  // lockstep: steps let it pass so far
  std::list<Waiting> waiting_;
};

}  // namespace sonar
