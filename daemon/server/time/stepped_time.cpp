#include "daemon/server/time/stepped_time.hpp"

#include <algorithm>
#include <utility>

namespace sonar {

SteppedTime::Bound SteppedTime::bound(std::optional<Time> for_pings) const {
  // A ping that is due exactly at the end of a step belongs to the next step.
  if (mode_ == ClockMode::lockstep) return {asked_ - std::chrono::nanoseconds(1), asked_};
  if (mode_ != ClockMode::follow) return {std::max(for_pings.value_or(Time::min()), clock_.now()), {}};
  const std::optional<Time> stamped = world_.followed_until();
  return {stamped.value_or(Time::min()), stamped};
}

Time SteppedTime::tick_at(Time due) const {
  const Bound now = bound();
  if (mode_ != ClockMode::follow || !now.then) return due;  // before the first pose nothing can be ahead
  const bool is_waited_for =
      std::any_of(waiting_.begin(), waiting_.end(), [&](const Waiting& w) { return w.until.last_tick >= due; });
  // Without a waiting request, a ping may lag the stamps by at most most_lead; beyond that, time advances and ticks are skipped.
  return is_waited_for ? due : std::max(due, now.last_tick - most_lead);
}

std::string SteppedTime::step(double dt_s) {
  if (mode_ != ClockMode::lockstep)
    return "time steps on request only with clock: lockstep; here it is clock: " + std::string(name_of(mode_));
  if (is_full()) return std::to_string(most_waiting) + " requests wait for time to pass already";
  if (!(dt_s > 0 && dt_s <= longest_step_s))
    return "dt_s must be more than 0 and at most " + std::to_string(static_cast<int>(longest_step_s)) + " seconds";
  const std::chrono::nanoseconds dt = nanoseconds_from(dt_s);
  if (dt.count() == 0) return "dt_s is less than a nanosecond";
  if (seconds(asked_ + dt - clock_.now()) > longest_step_s)
    return "steps that wait to be done would take more than " + std::to_string(static_cast<int>(longest_step_s)) + " seconds";
  // Pings up to the new end are now computed, and the clock advances with them.
  asked_ += dt;
  return {};
}

void SteppedTime::wait(Reached reached, HasLeft has_left) {
  waiting_.push_back({bound(), std::move(reached), std::move(has_left)});
}

bool SteppedTime::end_left() {
  bool any = false;
  while (!waiting_.empty() && waiting_.front().has_left && waiting_.front().has_left()) {
    const Waiting gone = std::move(waiting_.front());
    waiting_.pop_front();
    any = true;
    const std::chrono::nanoseconds rest =
        gone.until.then ? std::max(*gone.until.then - clock_.now(), std::chrono::nanoseconds(0)) : std::chrono::nanoseconds(0);
    asked_ -= rest;
    for (Waiting& later : waiting_) {
      later.until.last_tick -= rest;
      if (later.until.then) *later.until.then -= rest;
    }
    gone.reached(clock_.now(), false);
  }
  return any;
}

bool SteppedTime::answer(std::optional<Time> next) {
  // The bound decreases when a vehicle that lags joins the followed vehicles. Requests that wait for a later time are then
  // answered, because otherwise the sender and sonard would wait for each other. Answering a request may add another.
  bool any = false;
  while (!waiting_.empty() && (!next || *next > std::min(waiting_.front().until.last_tick, bound().last_tick))) {
    // The request is removed before the call, because the call may add another.
    const Waiting done = std::move(waiting_.front());
    waiting_.pop_front();
    any = true;
    done.reached(done.until.then.value_or(clock_.now()), true);
  }
  return any;
}

}  // namespace sonar
