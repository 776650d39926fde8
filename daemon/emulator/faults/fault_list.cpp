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

}  // namespace sonar
