// Selects the clients on which faults act, and determines admission and the outcome of requests.
#include "daemon/emulator/faults/faults.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_late_requests = 64;

}  // namespace

/// True if the fault acts on this client. A stream sends the same datagrams to all receivers, so the choice of a client does
/// not apply to it.
bool Faults::chosen(const Fault& fault, const Connection& client) const {
  if (client.role == Role::observer) return false;
  using Kind = ClientChoice::Kind;
  const ClientChoice& choice = fault.client;
  if (choice.kind == Kind::all || client.role == Role::stream) return true;
  if (choice.kind == Kind::number) return client.number == choice.number;
  if (choice.kind == Kind::prefix) {
    const std::uint32_t mask = choice.prefix_bits == 0 ? 0 : ~std::uint32_t{0} << (32 - choice.prefix_bits);
    return ((text::number_from_ipv4(client.peer.ip) ^ text::number_from_ipv4(choice.address)) & mask) == 0;
  }
  return std::none_of(around_.connections.all().begin(), around_.connections.all().end(), [&](const Connection& other) {
    const bool counts = other.role == Role::client && other.state == Connection::State::served;
    return counts && (choice.kind == Kind::newest ? other.number > client.number : other.number < client.number);
  });
}

/// Returns the verdict of the first active fault of admission.
Faults::Admission Faults::admission() const {
  for (const Entry& e : entries_) {
    if (!e.active) continue;
    if (e.fault.kind->effect == Effect::leave_waiting) return Admission::wait;
    if (e.fault.kind->effect == Effect::take_over) return Admission::take_over;
    if (e.fault.kind->effect == Effect::refuse) return e.fault.word("how") == "reset" ? Admission::reset : Admission::refuse;
  }
  return Admission::as_configured;
}

/// Applies active faults to a client that has just connected.
void Faults::on_served(const Connection& client, Time now) {
  if (entries_.empty()) return;
  on(Occasion::connect, now);
  for (Entry& e : entries_)
    if (e.active && e.fault.kind->effect == Effect::end_after)
      e.ends.emplace_back(now + nanoseconds_from(e.fault.number("seconds")), client.id);
  if (any(Effect::stop_reading)) orders_.emplace_back(ReadClients{false});
  if (any(Effect::outbox_policy)) orders_.emplace_back(DropNewestPings{true});
}

Faults::RequestVerdict Faults::on_request(protocol::ChangeSettings& change, const std::string& who,
                                          const protocol::DeviceState& state, Time now) {
  // The first fault that withholds the request or ends the client determines the verdict; limits of several faults combine.
  on(Occasion::config, now);
  for (Entry& e : entries_) {
    if (!e.active) continue;
    FaultEntry more;
    more.client = who;
    switch (e.fault.kind->effect) {
      case Effect::ignore_requests:
        note(e, FaultEntry::What::injected, now, std::move(more));
        return RequestVerdict::ignore;
      case Effect::delay_requests:
        if (e.late.size() < most_late_requests)
          e.late.emplace_back(now + nanoseconds_from(e.fault.number("seconds")), ApplyRequest{change, who});
        note(e, FaultEntry::What::injected, now, std::move(more));
        return RequestVerdict::ignore;
      case Effect::clamp_requests: {
        if (change.settings.range_m <= e.fault.number("range-m")) break;
        protocol::DeviceState with = state;
        with.settings = change.vendor_settings;
        protocol::SettingsOverride limit;
        limit.range_m = e.fault.number("range-m");
        auto limited = around_.vendor.apply_override(limit, with);
        if (!limited) break;
        change = *std::move(limited);
        note(e, FaultEntry::What::injected, now, std::move(more));
        break;
      }
      case Effect::end_on_request:
        note(e, FaultEntry::What::injected, now, std::move(more));
        return e.fault.word("how") == "reset" ? RequestVerdict::reset : RequestVerdict::end;
      default:
        break;
    }
  }
  return RequestVerdict::apply;
}

/// Ends a client that sends its first bytes, if a fault does so.
Faults::RequestVerdict Faults::on_bytes(const std::string& who, Time now) {
  for (Entry& e : entries_) {
    if (!e.active || e.fault.kind->effect != Effect::end_on_request || e.fault.word("command") != "any") continue;
    FaultEntry more;
    more.client = who;
    note(e, FaultEntry::What::injected, now, std::move(more));
    return e.fault.word("how") == "reset" ? RequestVerdict::reset : RequestVerdict::end;
  }
  return RequestVerdict::apply;
}

}  // namespace sonar
