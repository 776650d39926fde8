// The list of faults of a sonar: checks, adds and ends faults.

#include <algorithm>

#include "daemon/config/fault_support.hpp"
#include "daemon/emulator/faults/faults.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_over = 64;  // number of ended faults that stay listed

/// Returns the FNV-1a hash, which is the same in every run, unlike std::hash.
std::uint32_t key_of_name(const std::string& name) {
  std::uint32_t hash = 2166136261u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return hash;
}

}  // namespace

std::optional<FaultRefusal> Faults::why_not(const std::vector<Fault>& faults) const {
  using Code = FaultRefusal::Code;
  // A trouble consists of several kinds. It is accepted if at least one kind has an effect on this sonar and no kind conflicts
  // with another fault.
  bool any = faults.empty();
  std::string why;
  for (const Fault& fault : faults) {
    if (!is_for_this(fault)) return std::nullopt;
    const std::string without = why_without_effect(*fault.kind, around_.vendor);
    if (without.empty()) any = true;
    if (why.empty() && !without.empty())
      why = "fault " + fault.name + ": " + std::string(fault.kind->code) + " has no effect on the sonar " + around_.sonar + " (" +
            without + ")";
    for (const Entry& other : entries_) {
      if (other.over) continue;
      if (other.fault.name == fault.name)
        return FaultRefusal{Code::conflict, "there is a fault " + fault.name + " already; end it first, or give another name"};
      if (std::string conflict = conflict_of(fault, other.fault); !conflict.empty())
        return FaultRefusal{Code::conflict, std::move(conflict)};
    }
  }
  const bool is_trouble = !faults.empty() && find_fault_kind(faults.front().what) == nullptr;
  if (any) return std::nullopt;
  return FaultRefusal{Code::no_effect,
                      (is_trouble ? "none of the kinds of " + faults.front().what + " has an effect: " : "") + why};
}

void Faults::add(const std::vector<Fault>& faults, bool manual, Time now, Actions& actions) {
  for (const Fault& fault : faults) {
    if (!is_for_this(fault)) continue;
    const std::string without = why_without_effect(*fault.kind, around_.vendor);
    const std::string phrase = without.empty() ? ": " + std::string(fault.kind->sentence) : " left out: this sonar " + without;
    report(around_.sonar, Report::Topic::state, LogLevel::warning, "fault " + fault.name + phrase,
           {{"kind", std::string(fault.kind->code)}}, actions);
    if (without.empty()) add(fault, manual, now);
  }
}

bool Faults::end(const std::string& name, Time now, Actions& actions) {
  bool found = name.empty();
  for (Entry& e : entries_) {
    // The parts of a trouble are NAME.1, NAME.2, ...; the code or the name of a kind ends faults of that kind that the user gave
    // no name.
    const bool by_word = e.fault.name == e.fault.what && (e.fault.kind->code == name || e.fault.kind->name == name);
    const bool named = name.empty() || e.fault.name == name || by_word || e.fault.name.starts_with(name + ".");
    if (!named || (e.over && !name.empty())) continue;
    found = true;
    finish(e, now);
  }
  if (found)
    report(around_.sonar, Report::Topic::state, LogLevel::info, "faults ended: " + (name.empty() ? "all" : name), {}, actions);
  return found;
}

void Faults::add(Fault fault, bool manual, Time now) {
  forget_old();
  // Entries are in the order of their stages, in which they act; entries of one stage are in the order of addition.
  const auto place =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.fault.kind->stage > fault.kind->stage; });
  Entry& entry = *entries_.emplace(place);
  entry.key = key_of_name(fault.name);
  entry.fault = std::move(fault);
  entry.manual = manual;
  if (manual) entry.expires = now + longest_manual_fault;
  const FaultRecord::At& at = entry.fault.at;
  const bool waits = at.ping || at.every || at.time_s || at.probability || entry.fault.on;
  // Faults with a duration begin now; faults of single pings begin with the next ping (begin_ping). Three kinds act at once even
  // if they are counted in pings.
  if (!waits && !entry.fault.kind->per_ping()) begin(entry, now);
  if (!waits && (entry.fault.kind->effect == Effect::power_cycle || entry.fault.kind->effect == Effect::forget_settings ||
                 entry.fault.kind->effect == Effect::clock_restart))
    begin(entry, now);
}

/// Removes ended faults, except the last few.
void Faults::forget_old() {
  std::size_t over =
      static_cast<std::size_t>(std::count_if(entries_.begin(), entries_.end(), [](const Entry& e) { return e.over; }));
  for (auto it = entries_.begin(); it != entries_.end() && over > most_over;) {
    const auto one = it++;
    if (!one->over) continue;
    entries_.erase(one);
    --over;
  }
}

/// Ends the fault for all pings, including those that wait in outboxes.
void Faults::finish(Entry& e, Time now) {
  end(e, now);
  e.over = true;
  e.hits.clear();
  if (e.fault.kind->effect == Effect::swap) orders_.emplace_back(ReleaseHeld{});
  if (e.fault.kind->stage == FaultStage::stream || e.fault.kind->effect == Effect::thin_link) orders_.emplace_back(StopShaping{});
}

std::vector<Faults::Listed> Faults::list() const {
  std::vector<Listed> all;
  for (const Entry& e : entries_)
    all.push_back({&e.fault, e.active, e.over, e.injections, e.active ? std::min(e.until, e.expires) : e.expires});
  return all;
}

std::size_t Faults::active_count() const {
  return static_cast<std::size_t>(std::count_if(entries_.begin(), entries_.end(), [](const Entry& e) { return e.active; }));
}

// Selects the clients on which faults act, and determines admission and the outcome of requests.

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
