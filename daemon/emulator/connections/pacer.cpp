#include "daemon/emulator/connections/pacer.hpp"

#include <algorithm>
#include <utility>

namespace sonar {

namespace {

/// Returns the time until the last echo has returned, plus a pause of 2 ms before the next ping.
double travel_s(const PingSettings& s) {
  const double sound_speed_mps = s.device_sound_speed_mps > 0 ? static_cast<double>(s.device_sound_speed_mps) : 1500.0;
  return 2.0 * s.range_m / sound_speed_mps + 0.002;
}

}  // namespace

std::chrono::nanoseconds ping_period(const PingSettings& s) {
  if (!(s.rate_hz > 0)) return std::chrono::nanoseconds(0);
  return nanoseconds_from(std::max(1.0 / static_cast<double>(s.rate_hz), travel_s(s)));
}

void Pacer::configure(const PingSettings& settings, Time now) {
  const auto period = ping_period(settings);
  travel_ = nanoseconds_from(travel_s(settings));
  // With an unchanged period the grid does not change, because otherwise a driver that repeats its settings for every ping would
  // postpone each ping.
  if (running_ && period == period_ && settings.triggered == triggered_) return;
  // A new grid begins when the last echo has returned and the shorter of the old and the new period has passed.
  const Time quiet_until = has_fired_ ? std::max(home_at_, last_tick_ + std::min(period_, period)) : now;
  running_ = period.count() > 0;
  forget_tick();
  // A waiting trigger stays valid only if the old and the new settings use triggers.
  if (!(running_ && triggered_ && settings.triggered)) forget_trigger();
  triggered_ = settings.triggered;
  if (running_) {
    period_ = period;
    start_ = std::max(now, quiet_until);
    index_ = 0;
    trigger_at_ = std::max(trigger_at_, start_);
  }
}

void Pacer::skip(std::chrono::nanoseconds by) {
  start_ += by;
  trigger_at_ += by;
  last_tick_ += by;
  home_at_ += by;
}

void Pacer::hurry(Time now) {
  if (!running_ || triggered_) return;
  forget_tick();
  start_ = now;
  index_ = 0;
}

void Pacer::stop() {
  running_ = false;
  forget_tick();
  forget_trigger();
}

void Pacer::forget_tick() {
  if (std::exchange(tick_waits_, false)) ++skipped_.busy;
}

void Pacer::forget_trigger() {
  if (std::exchange(trigger_waits_, false)) ++skipped_.trigger;
}

// A triggered sonar is idle, or a trigger waits (trigger_waits_) until a period has passed since the previous ping (trigger_at_).
// Then fire() fires the ping.
void Pacer::trigger(Time now, bool joins) {
  if (!running_ || !triggered_) return;
  // At most one trigger waits. A further trigger joins it, or is counted as skipped.
  if (trigger_waits_) {
    if (joins) return;
    ++ticks_;
    ++skipped_.trigger;
    return;
  }
  ++ticks_;
  trigger_waits_ = true;
  // A trigger fires as soon as a period has passed since the last ping.
  trigger_at_ = has_fired_ ? std::max({now, start_, last_tick_ + period_}) : std::max(now, start_);
}

std::optional<Time> Pacer::next_tick() const {
  if (!running_) return std::nullopt;
  if (triggered_) return trigger_waits_ ? std::optional(trigger_at_) : std::nullopt;
  return start_ + index_ * period_;
}

/// Stores the time at which the echoes of this ping have returned; configure() begins no new grid earlier.
void Pacer::note_ping(Time at) {
  last_tick_ = at;
  home_at_ = at + travel_;
  has_fired_ = true;
}

// Free running: tick times are start_ + index_ * period_, so that a late call does not shift later ticks.
bool Pacer::fire(Time now, bool busy) {
  const auto due = next_tick();
  if (!due || now < *due) return false;
  if (triggered_) {
    if (busy) {
      trigger_at_ = now + std::chrono::milliseconds(1);  // try again shortly: a trigger causes exactly one ping
      return false;
    }
    trigger_waits_ = false;
    note_ping(now);
    return true;
  }
  // Free running: missed ticks are counted and never repeated. The newest tick waits while the simulation is busy; otherwise, if
  // a ping took a little more than a period, every second ping would be lost.
  const std::int64_t reached = (now - start_) / period_;  // index of the newest tick that has passed
  const auto missed = static_cast<std::uint64_t>(reached - index_);
  ticks_ += missed + 1;
  skipped_.late += missed;
  index_ = reached + 1;
  forget_tick();
  tick_waits_ = busy;
  // The stamp of the ping is the time on the grid, even if the call is late.
  if (!busy) note_ping(start_ + reached * period_);
  return !busy;
}

bool Pacer::fire_waiting() {
  if (!std::exchange(tick_waits_, false)) return false;
  note_ping(start_ + (index_ - 1) * period_);
  return true;
}

}  // namespace sonar
