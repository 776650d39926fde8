// Begins and ends faults, and applies their effects on the device.
#include "daemon/emulator/faults/faults.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/emulator/faults/alter_message.hpp"

namespace sonar {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t most_hits = 2 * Outbox::most_held;  // number of stored pings; more than are held back or wait

nanoseconds length_of_power_cycle(const Fault& fault) {
  return nanoseconds_from(fault.number("boot-s") + std::max(0.0, fault.number("gap-s")));
}

protocol::SettingsOverride override_of(const Fault& fault) {
  protocol::SettingsOverride wanted;
  const std::string& what = fault.word("what");
  const double value = fault.number("value");
  if (what == "sample-bits") wanted.sample_bits = static_cast<std::uint32_t>(value);
  if (what == "row-gains") wanted.row_gains = true;
  if (what == "beams") wanted.beams = static_cast<std::uint32_t>(value);
  if (what == "range") wanted.range_m = value;
  if (what == "mode") wanted.mode = static_cast<std::uint32_t>(value);
  if (what == "rate") wanted.rate_hz = value;
  if (what == "largest") wanted.beams = 512, wanted.sample_bits = 32;
  return wanted;
}

}  // namespace

bool Faults::any(Effect effect) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& e) { return e.active && e.fault.kind->effect == effect; });
}
Faults::Entry* Faults::active(Effect effect) {
  for (Entry& e : entries_)
    if (e.active && e.fault.kind->effect == effect) return &e;
  return nullptr;
}

// ---- triggers

/// True if this ping triggers an inactive fault. Triggers by time and by events are handled elsewhere.
bool Faults::fires(const Entry& e, std::uint32_t ping) const {
  const FaultRecord::At& at = e.fault.at;
  if (at.ping) return e.begun == 0 && ping >= *at.ping;
  if (at.every) return ping % *at.every == at.phase % *at.every;
  if (at.probability) return FaultDraws{around_.seed, e.key, around_.index, ping, 0}.uniform(~std::uint32_t{0}) < *at.probability;
  return !at.time_s && !e.fault.on && e.begun == 0;  // without a trigger, begins at once
}

// A fault first waits for its trigger (it is neither active nor over). It is delayed while `begins` is set, then active until its
// duration or number of pings is used up, then it waits again or, after the last occurrence, is over.
void Faults::begin(Entry& e, Time now) {
  if (e.active || e.over) return;
  // With a delay, this call only sets the time at which on_tick() calls begin() again.
  if (!e.begins) e.begins = now + e.fault.delay;
  if (now < *e.begins) return;
  e.begins.reset();
  e.active = true;
  ++e.begun;
  e.since = now;
  e.until = e.fault.span.time.count() > 0 ? now + e.fault.span.time : Time::max();
  e.pings_left = e.fault.span.pings;
  e.first_number.reset();
  e.kept = nullptr;
  e.kept_time.reset();
  note(e, FaultEntry::What::began, now);
  begin_effect(e, now);
}

/// Ends an occurrence. A fault with a limited number of occurrences is over after the last one; others wait for their trigger
/// again.
void Faults::end(Entry& e, Time now) {
  if (!e.active) return;
  e.active = false;
  e.until = e.step = Time::max();
  end_effect(e);
  note(e, FaultEntry::What::ended, now);
  if (e.fault.span.count != 0 && e.begun >= e.fault.span.count) e.over = true;
}

/// Adds the orders of a fault that changes the device or its connections. Other faults act later, on each ping, message or
/// request.
void Faults::begin_effect(Entry& e, Time now) {
  switch (e.fault.kind->effect) {
    case Effect::close_ports:
      orders_.emplace_back(SetListening{false});
      if (e.fault.word("close-existing") == "yes") orders_.emplace_back(EndClients{});
      return;
    case Effect::power_cycle:
      e.until = now + length_of_power_cycle(e.fault);
      orders_.emplace_back(SetListening{false});
      orders_.emplace_back(EndClients{e.fault.word("how") == "reset"});
      orders_.emplace_back(RestartDevice{});
      // With a negative gap the ports open before the first status message; step() opens them.
      if (const double gap = e.fault.number("gap-s"); gap < 0)
        e.step = now + std::max(nanoseconds(0), nanoseconds_from(e.fault.number("boot-s") + gap));
      return;
    case Effect::flap:
      e.down = false;
      e.step = now;
      return step(e, now);
    case Effect::change_settings:
      orders_.emplace_back(OverrideSettings{override_of(e.fault)});
      return;
    case Effect::forget_settings:
      orders_.emplace_back(ForgetSettings{});
      return;
    case Effect::clock_restart:
      orders_.emplace_back(RestartDevice{true});
      return;
    case Effect::change_rate:
    case Effect::heat:
      orders_.emplace_back(ChangePace{});
      return;
    case Effect::stop_reading:
      orders_.emplace_back(ReadClients{false});
      return;
    case Effect::outbox_policy:
      orders_.emplace_back(DropNewestPings{true});
      return;
    default:
      return;
  }
}

/// Restores the device to its state without this fault.
void Faults::end_effect(Entry& e) {
  switch (e.fault.kind->effect) {
    case Effect::close_ports:
    case Effect::power_cycle:
    case Effect::flap:
      // Another fault may keep the ports closed.
      if (!any(Effect::close_ports) && !any(Effect::power_cycle)) orders_.emplace_back(SetListening{true});
      return;
    case Effect::change_rate:
    case Effect::heat:
      orders_.emplace_back(ChangePace{});
      return;
    case Effect::stop_reading:
      orders_.emplace_back(ReadClients{true});
      return;
    case Effect::outbox_policy:
      orders_.emplace_back(DropNewestPings{false});
      return;
    case Effect::leave_waiting:
      orders_.emplace_back(ServeWaiting{});
      return;
    case Effect::delay_requests:
      // Delayed requests take effect now, so that the last requested settings are in use.
      for (auto& [at, request] : e.late) orders_.emplace_back(std::move(request));
      e.late.clear();
      return;
    case Effect::end_after:
      e.ends.clear();
      return;
    case Effect::burst:
    case Effect::delay:
    case Effect::jitter:
    case Effect::coalesce:
      orders_.emplace_back(ReleaseHeld{});
      return;
    default:
      return;
  }
}

// ---- time

/// Handles the events of each fault in this order: begin, step, delayed requests, ends of clients, end, expiry.
void Faults::on_tick(Time now) {
  for (Entry& e : entries_) {
    const auto& at = e.fault.at;
    if (!e.over && !e.active && at.time_s && e.begun == 0 && now - start_ >= nanoseconds_from(*at.time_s)) begin(e, now);
    if (e.begins && *e.begins <= now) begin(e, now);
    // Steps, delayed requests and ends of clients that are due now happen before the end of the fault.
    if (e.active && e.step <= now) step(e, now);
    while (!e.late.empty() && e.late.front().first <= now) {
      orders_.emplace_back(std::move(e.late.front().second));
      e.late.erase(e.late.begin());
    }
    while (!e.ends.empty() && e.ends.front().first <= now) {
      orders_.emplace_back(EndClients{e.fault.word("how") == "reset", e.ends.front().second});
      note(e, FaultEntry::What::injected, now);
      e.ends.erase(e.ends.begin());
    }
    if (e.active && e.until <= now) end(e, now);
    if (!e.over && e.expires <= now) finish(e, now);
  }
}

/// Returns the earliest time at which a condition of on_tick() becomes true.
std::optional<Time> Faults::next_tick() const {
  Time next = Time::max();
  for (const Entry& e : entries_) {
    if (e.over) continue;
    next = std::min(next, e.expires);
    if (e.active) next = std::min({next, e.until, e.step});
    if (e.begins) next = std::min(next, *e.begins);
    if (!e.late.empty()) next = std::min(next, e.late.front().first);
    if (!e.ends.empty()) next = std::min(next, e.ends.front().first);
    if (!e.active && e.begun == 0 && e.fault.at.time_s) next = std::min(next, start_ + nanoseconds_from(*e.fault.at.time_s));
  }
  return next == Time::max() ? std::nullopt : std::optional(next);
}

void Faults::on(Occasion occasion, Time now) {
  for (Entry& e : entries_)
    if (e.fault.on == occasion && (e.fault.span.count == 0 || e.begun < e.fault.span.count)) begin(e, now);
}

/// Makes a change within a fault: opens the ports in a power cycle, or takes a flapping link up or down.
void Faults::step(Entry& e, Time now) {
  if (e.fault.kind->effect == Effect::power_cycle) {  // opens the TCP ports before the first status message
    orders_.emplace_back(SetListening{true});
    e.step = Time::max();
    return;
  }
  e.down = !e.down;
  orders_.emplace_back(SetListening{!e.down});
  if (e.down) orders_.emplace_back(EndClients{true});
  if (e.down) note(e, FaultEntry::What::injected, now);
  e.step = now + nanoseconds_from(e.fault.number(e.down ? "down-s" : "up-s"));
}

// ---- pings

/// Decides once per ping which faults act on it, and stores the decision for all clients and stages.
void Faults::begin_ping(std::uint32_t number, Time now) {
  if (entries_.empty()) return;
  on_tick(now);
  for (Entry& e : entries_) {
    const bool may_begin = !e.over && !e.active && (e.fault.span.count == 0 || e.begun < e.fault.span.count);
    if (may_begin && fires(e, number)) begin(e, now);
    if (!e.active) continue;
    e.hits.push_back(number);
    if (e.hits.size() > most_hits) e.hits.pop_front();
    if (!e.first_number) e.first_number = number;
    count_ping(e, now);
  }
}

/// Counts a ping for a fault. Faults of status messages count status messages instead (alter_beacons).
void Faults::count_ping(Entry& e, Time now) {
  if (e.fault.span.pings == 0 || e.fault.kind->stage == FaultStage::status || --e.pings_left > 0) return;
  // A power cycle ends after its duration.
  if (e.fault.kind->effect != Effect::power_cycle) end(e, now);
}

/// True if the fault acts on this ping. Numbers are remembered, because a ping may be sent long after it was made.
bool Faults::met(const Entry& e, std::uint32_t ping) const {
  return std::find(e.hits.begin(), e.hits.end(), ping) != e.hits.end();
}

double Faults::rate_factor() const {
  double factor = 1;
  for (const Entry& e : entries_)
    if (e.active && (e.fault.kind->effect == Effect::change_rate || e.fault.kind->effect == Effect::heat))
      factor *= e.fault.number("factor");
  return factor;
}

bool Faults::leaves_group() const { return any(Effect::leave_group); }

/// Returns the delay of the first fault that holds the ping back; delays do not add up.
Faults::Hold Faults::hold(const Connection& to, std::uint32_t ping, Time now) {
  for (Entry& e : entries_) {
    if (!met(e, ping) || !chosen(e.fault, to)) continue;
    const FaultDraws draws{around_.seed, e.key, around_.index, ping, static_cast<std::uint32_t>(to.number)};
    const auto late = [&](double ms) { return Hold{Hold::Kind::until, now + nanoseconds_from(ms * 1e-3), 0}; };
    Hold hold;
    switch (e.fault.kind->effect) {
      case Effect::burst:
        hold = {Hold::Kind::until, e.until, 0};
        break;
      case Effect::delay:
        hold = late(e.fault.number("ms") + draws.uniform(0) * e.fault.number("jitter-ms"));
        break;
      case Effect::jitter:
        hold = late(draws.uniform(0) * e.fault.number("ms"));
        break;
      case Effect::swap:
        hold = {Hold::Kind::after_next, {}, 0};
        break;
      case Effect::coalesce:
        hold = {Hold::Kind::collect, {}, static_cast<std::size_t>(e.fault.number("pings"))};
        break;
      default:
        continue;
    }
    FaultEntry more;
    more.client = to.peer.name;
    more.client_number = to.number;
    more.ping = ping;
    note(e, FaultEntry::What::injected, now, std::move(more));
    return hold;
  }
  return {};
}

void Faults::note(Entry& e, FaultEntry::What what, Time now, FaultEntry more) {
  if (what == FaultEntry::What::injected) ++e.injections;
  if (around_.journal == nullptr) return;
  more.what = what;
  more.fault = e.fault.name;
  more.asked = e.fault.what;
  more.kind = e.fault.kind;
  more.sonar = around_.sonar;
  more.with = e.fault.used();
  more.at = now;
  around_.journal->write(more);
}

}  // namespace sonar
