#include "daemon/server/stepper.hpp"

#include <algorithm>

namespace sonar {
namespace {

bool is_first(std::optional<Time> t, std::optional<Time> of) { return t && (!of || *t < *of); }

}  // namespace

/// Returns the earliest ping, request and dialogue tick of all sonars; for equal times, the event of the first sonar of the
/// configuration.
Stepper::Due Stepper::next_due() {
  Due due;
  for (Device& d : fleet_.devices()) {
    if (const auto t = d.sonar().next_ping(); is_first(t, due.ping)) due.ping = t, due.pings = &d;
    if (const auto t = d.sonar().next_request(); is_first(t, due.request)) due.request = t;
    if (const auto t = d.sonar().next_conversation(); is_first(t, due.conversation)) due.conversation = t;
  }
  return due;
}

// Makes a step of simulated time: once every client has received everything, time advances to the next event (a tick of a
// dialogue or a ping) that the clock allows, and that event happens. Returns true if the daemon may end: enough pings are served,
// and all requests that can be answered are answered.
bool Stepper::step(const std::function<bool()>& enough_served) {
  skip();
  if (time_.end_left()) on_change_();
  const std::list<Device>& devices = fleet_.devices();
  if (!std::all_of(devices.begin(), devices.end(), [](const Device& d) { return d.sonar().settled(); })) return false;
  const Due due = next_due();
  const SteppedTime::Bound bound = time_.bound(is_first(due.request, due.ping) ? due.request : due.ping);
  // If a dialogue's tick and a ping are due at the same time, the dialogue is first.
  const bool converses = is_first(due.conversation, due.ping) || due.conversation == due.ping;
  const std::optional<Time> next = converses ? due.conversation : due.ping;
  // A dialogue's tick that is due now may run even if time must not advance.
  const bool may_come = next && (*next <= bound.last_tick || (converses && *next <= clock_.now()));
  if (!may_come && bound.then && (*bound.then > clock_.now() || is_overdue())) advance(*bound.then);
  const bool answered = time_.answer(next);
  if (answered) on_change_();  // answers precede events, in separate turns of the event loop
  if (enough_served()) return !answered;
  if (!may_come) return false;
  advance(time_.tick_at(*next));
  if (converses)
    on_change_();  // replies and requests of the tick precede the next ping
  else
    due.pings->step();
  return false;
}

/// True if a sonar has an event, other than a ping, that is due at the present time.
bool Stepper::is_overdue() {
  return std::any_of(fleet_.devices().begin(), fleet_.devices().end(), [this](const Device& d) {
    const auto next = d.sonar().next_tick_of_conversations();
    return next && *next <= clock_.now();
  });
}

/// Advances time; dialogues, faults and held pings that are due then act at once.
void Stepper::advance(Time to) {
  clock_.advance_to(to);
  for (Device& d : fleet_.devices()) d.tick_sessions();
}

/// With `clock: follow`, makes time jump to the first stamp and, if there is only one vehicle, with jumps of the stamps.
void Stepper::skip() {
  const auto skipped = world_.take_skipped();
  if (skipped.count() == 0) return;
  clock_.skip(skipped);
  for (Device& d : fleet_.devices()) d.skip(skipped);
  log_.info("time follows the poses: it jumps ahead by " + std::to_string(seconds(skipped)) + " s");
}

}  // namespace sonar
