// Effects of faults on an emulated sonar (daemon/emulator/faults).
#include <algorithm>

#include "daemon/emulator/sonar/sonar.hpp"

namespace sonar {
namespace {

// Pings that a fault holds back for one client.
constexpr std::size_t most_held = 128, most_held_bytes = 64u << 20;

bool is_client(const Connection& c) { return c.role == Role::client && c.state == Connection::State::served && !c.finishing; }

std::size_t held_bytes(const Connection& c) {
  std::size_t bytes = 0;
  for (const Connection::Held& held : c.held) bytes += held.ping.size();
  return bytes;
}

}  // namespace

// ---- the list

std::string Sonar::why_no_faults(const std::vector<Fault>& faults) const {
  bool any = faults.empty();
  std::string why;
  for (const Fault& fault : faults) {
    if (!fault.sonar.empty() && fault.sonar != config_.name) return {};
    const std::string without = why_without_effect(*fault.kind, vendor_);
    if (without.empty()) any = true;
    if (why.empty() && !without.empty())
      why = "fault " + fault.name + ": " + std::string(fault.kind->code) + " has no effect on the sonar " + config_.name + " (" +
            without + ")";
    for (const Faults::Listed& other : faults_.list()) {
      if (other.over) continue;
      if (other.fault->name == fault.name)
        return "there is a fault " + fault.name + " already; end it first, or give another name";
      if (std::string conflict = conflict_of(fault, *other.fault); !conflict.empty()) return conflict;
    }
  }
  const bool is_trouble = !faults.empty() && find_fault_kind(faults.front().what) == nullptr;
  return any ? std::string() : (is_trouble ? "none of the kinds of " + faults.front().what + " has an effect: " : "") + why;
}

Actions Sonar::add_faults(const std::vector<Fault>& faults, bool manual, Time now) {
  Actions actions;
  for (const Fault& fault : faults) {
    if (!fault.sonar.empty() && fault.sonar != config_.name) continue;
    if (const std::string why = why_without_effect(*fault.kind, vendor_); !why.empty()) {
      report(Report::Topic::state, LogLevel::warning, "fault " + fault.name + " left out: this sonar " + why,
             {{"kind", std::string(fault.kind->code)}}, actions);
      continue;
    }
    report(Report::Topic::state, LogLevel::warning, "fault " + fault.name + ": " + std::string(fault.kind->sentence),
           {{"kind", std::string(fault.kind->code)}}, actions);
    faults_.add(fault, manual, now);
  }
  apply_fault_orders(now, actions);
  return actions;
}

bool Sonar::end_faults(const std::string& name, Time now, Actions& actions) {
  const bool found = name.empty() || faults_.remove(name, now);
  if (name.empty()) faults_.clear(now);
  if (found)
    report(Report::Topic::state, LogLevel::info, "faults ended: " + (name.empty() ? std::string("all") : name), {}, actions);
  apply_fault_orders(now, actions);
  return found;
}

// ---- what they order

void Sonar::apply_fault_orders(Time now, Actions& actions) {
  for (const FaultOrder& order : faults_.take_orders()) apply(order, now, actions);
}

void Sonar::apply(const FaultOrder& order, Time now, Actions& actions) {
  if (const auto* listen = std::get_if<SetListening>(&order)) {
    actions.emplace_back(Listen{listen->on});
  } else if (const auto* end = std::get_if<EndClients>(&order)) {
    for (Connection& c : connections_.all()) {
      if (c.role != Role::client || (end->only && *end->only != c.id)) continue;
      if (end->reset || c.state == Connection::State::waiting)
        actions.emplace_back(Reset{c.id, "a fault"});
      else
        begin_finish(c, "a fault", actions);
    }
  } else if (std::holds_alternative<ForgetSettings>(order)) {
    use_initial_settings();
    update_pacer(now);
  } else if (const auto* restart = std::get_if<RestartDevice>(&order)) {
    state_.powered_up_at = now;
    if (restart->clock_only) return;
    // Pings are numbered from 1 again.
    state_.last_ping = ping_number_ = 0;
    last_served_ = {};
    use_initial_settings();
    update_pacer(now);
  } else if (const auto* wanted = std::get_if<OverrideSettings>(&order)) {
    const auto change = vendor_.apply_override(wanted->wanted, state_);
    if (change)
      change_settings(*change, "a fault", now, actions);
    else
      report(Report::Topic::state, LogLevel::warning, "fault without effect: " + change.error().text, {}, actions);
  } else if (const auto* request = std::get_if<ApplyRequest>(&order)) {
    change_settings(request->change, request->who, now, actions);
  } else if (std::holds_alternative<ChangePace>(order)) {
    update_pacer(now);
  } else if (const auto* reads = std::get_if<ReadClients>(&order)) {
    for (const Connection& c : connections_.all())
      if (is_client(c)) actions.emplace_back(ReadFrom{c.id, reads->on});
  } else if (const auto* rules = std::get_if<DropNewestPings>(&order)) {
    for (Connection& c : connections_.all())
      if (is_client(c)) c.outbox.use(rules->on ? OutboxRules{1, WhenFull::drop_newest} : config_.outbox);
  } else if (std::holds_alternative<ReleaseHeld>(order)) {
    for (Connection& c : connections_.all()) release_held(c, now, true, actions);
  } else if (std::holds_alternative<StopShaping>(order)) {
    for (const Connection& c : connections_.all())
      if (is_client(c)) actions.emplace_back(EndPauses{c.id});
  } else if (std::holds_alternative<ServeWaiting>(order)) {
    serve_waiting(now, actions);
  }
}

void Sonar::serve_waiting(Time now, Actions& actions) {
  while (!stopping_ && connections_.clients() < static_cast<std::size_t>(config_.max_clients)) {
    Connection* const next = connections_.longest_waiting();
    if (next == nullptr) return;
    serve(*next, now, actions);
  }
}

void Sonar::change_as_requested(const Source& from, protocol::ChangeSettings change, Time now, Actions& actions) {
  const Faults::RequestVerdict verdict = faults_.on_request(change, from.name, state_, now);
  apply_fault_orders(now, actions);
  if (verdict == Faults::RequestVerdict::apply) return change_settings(change, from.name, now, actions);
  if (from.connection != nullptr && verdict != Faults::RequestVerdict::ignore) end_by_fault(*from.connection, verdict, actions);
}

void Sonar::end_by_fault(Connection& connection, Faults::RequestVerdict verdict, Actions& actions) {
  if (verdict == Faults::RequestVerdict::reset)
    actions.emplace_back(Reset{connection.id, "a fault"});
  else
    begin_finish(connection, "a fault", actions);
}

// ---- pings held back

void Sonar::deliver(Connection& to, Outbox::Message ping, Time now, Actions& actions) {
  using Kind = Faults::Hold::Kind;
  const Faults::Hold hold = faults_.hold(to, ping.ping, now);
  std::deque<Connection::Held>& held = to.held;
  // A ping that no fault holds is sent at once. A ping that was held to be swapped with it follows.
  if (hold.kind == Kind::pass && (held.empty() || held.front().after_next)) {
    to.outbox.push_ping(std::move(ping));
    actions.emplace_back(Wake{to.id});
    if (!held.empty()) release_held(to, now, true, actions);
    return;
  }
  if (held.size() >= most_held || held_bytes(to) + ping.size() > most_held_bytes)
    return to.outbox.drop_offered(DropReason::fault);
  // Pings keep their order: no ping leaves before the previous one.
  const Time earliest = held.empty() ? now : held.back().until;
  const Time until = hold.kind == Kind::until ? std::max(hold.until, earliest) : hold.kind == Kind::pass ? earliest : Time::max();
  held.push_back({std::move(ping), until, hold.kind == Kind::after_next});
  if (hold.kind == Kind::collect && held.size() >= hold.collect) release_held(to, now, true, actions);
}

void Sonar::release_held(Connection& to, Time now, bool all, Actions& actions) {
  if (to.held.empty() || (!all && to.held.front().until > now)) return;
  while (!to.held.empty() && (all || to.held.front().until <= now)) {
    to.outbox.push_held(std::move(to.held.front().ping));
    to.held.pop_front();
  }
  actions.emplace_back(Wake{to.id});
}

}  // namespace sonar
