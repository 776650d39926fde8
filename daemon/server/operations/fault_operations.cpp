#include "daemon/server/operations/fault_operations.hpp"

#include <algorithm>
#include <array>

#include "core/text/nearest.hpp"
#include "daemon/config/fault_support.hpp"
#include "daemon/server/operations/operation_results.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/fault_kinds.hpp"

namespace sonar {
namespace {

constexpr const char* name_by_mavlink = "mavlink";
constexpr std::array<std::string_view, 8> kinds_of_failures = {"",    "L05", "P01", "P04",
                                                               "P12", "T11", "T10", "P13"};  // index: FailureType

void fill_effects(v1::FaultKind& out, const FaultKind& kind) {
  fill(out, kind);
  for (const protocol::Vendor* vendor : protocol::vendors())
    if (const std::string why = why_without_effect(kind, *vendor); !why.empty())
      (*out.mutable_without_effect())[std::string(vendor->name())] = why;
}

/// Returns the event for which a fault that has not begun waits: its trigger `on`, else a ping; empty = none.
std::string awaited(const Fault& fault) {
  constexpr std::array<const char*, occasion_names.size()> words = {"a connection", "new settings", "a status message",
                                                                    "the end of a connection"};
  if (fault.on) return words[static_cast<std::size_t>(*fault.on)];
  return fault.kind->per_ping() && fault.kind->effect != FaultEffect::power_cycle ? "a ping" : "";
}

void fill(v1::Trouble& out, const Trouble& trouble, const Fleet& fleet) {
  fill(out, trouble);
  control::FaultRecord record;
  record.what = trouble.name;
  const auto faults = check_fault(record, true);
  if (!faults) return;
  for (const Fault& fault : *faults) {
    if (out.waits_for().empty()) out.set_waits_for(awaited(fault));
    if (fault.kind->effect == FaultEffect::power_cycle)
      out.set_own_s(fault.number("boot-s") + std::max(0.0, fault.number("gap-s")));
    if (fault.kind->effect == FaultEffect::change_settings) out.set_stays("the settings that it changed");
  }
  for (const Device& device : fleet.devices()) {
    std::string why;
    const bool acts = std::any_of(faults->begin(), faults->end(), [&](const Fault& fault) {
      why = why_without_effect(*fault.kind, device.sonar().vendor());
      return why.empty();
    });
    if (!acts) (*out.mutable_cannot_act())[device.config().name] = why;
  }
}

void fill(v1::FaultStatus& out, const Faults::Listed& listed, const std::string& sonar, Time now) {
  out.set_name(listed.fault->name);
  out.set_do_(listed.fault->what);
  out.set_code(std::string(listed.fault->kind->code));
  out.set_sonar(sonar);
  out.set_state(listed.over ? "over" : listed.active ? "active" : "waiting");
  out.set_injections(listed.injections);
  if (listed.active && listed.expires != Time::max()) out.set_expires_s(seconds(listed.expires - now));
  if (!listed.active && !listed.over) out.set_waits_for(awaited(*listed.fault));
}

}  // namespace

std::vector<v1::FaultStatus> fault_statuses(const Fleet& fleet, Time now, bool over_too) {
  std::vector<v1::FaultStatus> all;
  for (const Device& device : fleet.devices())
    for (const Faults::Listed& listed : device.sonar().faults().list())
      if (over_too || !listed.over) fill(all.emplace_back(), listed, device.config().name, now);
  return all;
}

OperationResult FaultOperations::add(const control::AddFault& asked, const Sender& sender) {
  if (!config_.faults.armed)
    return refused("faults are not armed: start the daemon with sonard run --faults, or with faults: {armed: true}");
  OperationResult result = add(asked.fault, true);
  if (result.code == OperationResult::Code::done) log_.warning("fault requested: " + asked.fault.what, {{"client", sender.id}});
  return result;
}

/// Checks all sonars first, so that a fault is never applied to only some of them.
OperationResult FaultOperations::add(const control::FaultRecord& record, bool manual, const Device* only) {
  const auto faults = check_fault(record, manual);
  if (!faults) return result_of(faults.error());
  std::vector<Device*> takers;
  std::vector<std::string_view> names;
  std::string why;
  for (Device& device : fleet_.devices()) {
    names.push_back(device.config().name);
    if (only != nullptr && only != &device) continue;
    if (!record.sonar.empty() && device.config().name != record.sonar) continue;
    std::optional<FaultRefusal> why_not = device.sonar().why_no_faults(*faults);
    if (!why_not)
      takers.push_back(&device);
    else if (record.sonar.empty() && why_not->code == FaultRefusal::Code::no_effect)
      // A request for all sonars skips sonars on which the fault has no effect. Any other refusal ends the request.
      why = std::move(why_not->text);
    else
      return refused(std::move(why_not->text));
  }
  if (takers.empty() && !why.empty()) return refused(std::move(why));
  if (takers.empty())
    return refused("no sonar is called \"" + record.sonar.substr(0, 64) + '"' + text::suggestion(record.sonar, names, "sonars"));
  for (Device* device : takers) device->add_faults(*faults, manual);
  return {};
}

/// Ends a fault. An empty name ends all faults, and always succeeds.
OperationResult FaultOperations::end(const control::EndFaults& asked, const Sender& sender) {
  bool found = asked.name.empty();
  for (Device& device : fleet_.devices()) found = device.end_faults(asked.name) || found;
  if (!found) return refused("there is no fault \"" + asked.name.substr(0, 64) + "\" that waits or acts");
  log_.info("faults ended on request", {{"client", sender.id}});
  return {};
}

OperationResult FaultOperations::report(const control::GetFaults& asked) const {
  auto report = std::make_shared<v1::FaultReport>();
  report->set_armed(config_.faults.armed);
  for (v1::FaultStatus& status : fault_statuses(fleet_, clock_.now(), true)) *report->add_faults() = std::move(status);
  for (const auto& entry : journal_.entries())
    if (entry->seq() > asked.journal_after) *report->add_journal() = *entry;
  for (const Trouble& trouble : troubles()) fill(*report->add_troubles(), trouble, fleet_);
  if (asked.kinds)
    for (const FaultKind& kind : fault_kinds()) fill_effects(*report->add_kinds(), kind);
  OperationResult result;
  result.faults = std::move(report);
  return result;
}

/// Checks the new failure, except for conflicts with other faults, before it ends the previous one.
mavlink::MavResult FaultOperations::inject(std::uint32_t unit, mavlink::FailureType type, std::uint32_t instance) {
  using enum mavlink::MavResult;
  if (unit != mavlink::distance_sensor) return unsupported;
  if (!config_.faults.armed || instance > fleet_.devices().size()) return denied;
  if (!config_.control.token_file.empty()) {  // requests need the token, but MAVLink has no field for it
    log_.warning("failure refused: a command of MAVLink cannot show the token of control.token_file",
                 {{"client", name_by_mavlink}});
    return denied;
  }
  std::vector<Device*> chosen;
  std::uint32_t number = 0;
  for (Device& device : fleet_.devices())
    // Instances count sonars from 1 in the order of the configuration; 0 means all.
    if (++number == instance || instance == 0) chosen.push_back(&device);

  control::FaultRecord record;
  record.name = name_by_mavlink;
  record.what = kinds_of_failures[static_cast<std::size_t>(type)];
  record.sonar = instance == 0 ? std::string() : chosen.front()->config().name;
  record.lasts.seconds = static_cast<double>(longest_manual_fault.count());
  const FaultKind* const kind = find_fault_kind(record.what);  // null: the failure ends
  const auto has_it = [&](const Device* device) { return why_without_effect(*kind, *device->config().profile.vendor).empty(); };
  if (kind != nullptr && std::none_of(chosen.begin(), chosen.end(), has_it)) return unsupported;

  for (Device* device : chosen) device->end_faults(record.name);
  const OperationResult result = kind == nullptr ? OperationResult{} : add(record, true);
  if (result.code != OperationResult::Code::done) {
    log_.warning("failure refused: " + result.text, {{"client", name_by_mavlink}});
    return denied;
  }
  if (kind != nullptr) log_.warning("fault requested: " + record.what, {{"client", name_by_mavlink}});
  return accepted;
}

/// Begins the records of the plan. A refused record is logged, and the other records begin nevertheless.
void FaultOperations::begin_plan(const Device* only) {
  for (const control::FaultRecord& record : config_.faults.plan)
    if (only != nullptr && !record.sonar.empty() && record.sonar != only->config().name)
      continue;
    else if (const OperationResult result = add(record, false, only); result.code != OperationResult::Code::done)
      log_.error("fault of the plan refused: " + result.text);
}

}  // namespace sonar
