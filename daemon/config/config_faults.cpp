// Reads the keys for faults from the configuration: faults.armed, faults.journal and the plan (docs/faults.md).
#include <algorithm>

#include "core/text/nearest.hpp"
#include "daemon/config/config_parts.hpp"
#include "daemon/config/fault_support.hpp"

namespace sonar {
namespace {

using text::Map;
using text::Node;
using text::Range;

constexpr std::uint64_t most = 1'000'000'000;

std::optional<std::uint64_t> optional_count(const Node& node) {
  return node.present() ? std::optional(node.unsigned_integer_or(0, most)) : std::nullopt;
}
std::optional<double> optional_number(const Node& node) {
  return node.present() ? std::optional(node.number(Range::between(0, 1e9))) : std::nullopt;
}

void read_at(const Node& node, FaultRecord::At& at) {
  if (!node.present()) return;
  Map map = node.map();
  at.ping = optional_count(map.optional("ping"));
  at.every = optional_count(map.optional("every"));
  at.phase = map.optional("phase").unsigned_integer_or(0, most);
  at.time_s = optional_number(map.optional("time_s"));
  at.probability = optional_number(map.optional("probability"));
  at.on = map.optional("on").text_or("", 64);
}

void read_for(const Node& node, FaultRecord::For& lasts) {
  if (!node.present()) return;
  Map map = node.map();
  lasts.seconds = optional_number(map.optional("seconds"));
  lasts.pings = optional_count(map.optional("pings"));
  lasts.count = optional_count(map.optional("count"));
}

FaultRecord read_record(const Node& node) {
  Map map = node.map();
  FaultRecord record;
  record.name = map.optional("name").text_or("", 64);
  record.what = map.required("do").text(64);
  if (const Node with = map.optional("with"); with.present())
    for (const auto& [key, value] : with.map().entries()) record.with[key] = value.text(64);
  read_at(map.optional("at"), record.at);
  read_for(map.optional("for"), record.lasts);
  record.sonar = map.optional("sonar").text_or("", 64);
  record.client = map.optional("client").text_or("", 64);
  return record;
}

/// Returns the reason if no sonar can have the fault; empty if at least one can.
std::string why_not(const std::vector<Fault>& faults, const std::vector<SonarConfig>& sonars) {
  const std::string& name = faults.front().sonar;
  std::vector<std::string_view> names;
  for (const SonarConfig& sonar : sonars) names.push_back(sonar.name);
  if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end())
    return "sonar \"" + name + "\" is unknown" + text::suggestion(name, names, "sonars");
  std::string why;
  for (const SonarConfig& sonar : sonars)
    for (const Fault& fault : faults) {
      if ((!name.empty() && sonar.name != name) || sonar.profile.vendor == nullptr) continue;
      const std::string without = why_without_effect(*fault.kind, *sonar.profile.vendor);
      if (without.empty()) return {};
      why = std::string(fault.kind->code) + " has no effect on the sonar " + sonar.name + " (" + without + ")";
    }
  return why;
}

}  // namespace

/// Reads the keys. Each record is checked like a request; in addition, no two faults may have the same name or change the same
/// part.
FaultConfig read_faults(const Node& node, const std::vector<SonarConfig>& sonars, const std::filesystem::path& directory) {
  FaultConfig config;
  if (!node.present()) return config;
  Map map = node.map();
  config.armed = map.optional("armed").boolean_or(false);
  if (const Node journal = map.optional("journal"); journal.present())
    config.journal = (directory / journal.text()).lexically_normal();
  std::vector<Fault> all;
  const Node plan = map.optional("plan");
  if (plan.present()) config.plan_place = plan.location() + ": " + plan.path();
  for (const Node& item : plan.items(0, most_faults)) {
    FaultRecord record = read_record(item);
    // Records without a name get a numbered name, so that each fault can be ended by name.
    if (record.name.empty()) record.name = "plan-" + std::to_string(config.plan.size() + 1);
    const auto faults = check_fault(record, false);
    if (!faults) {
      item.fail(faults.error().text);
      continue;
    }
    if (const std::string why = why_not(*faults, sonars); !why.empty()) item.fail("fault " + record.name + ": " + why);
    for (const Fault& fault : *faults)
      for (const Fault& other : all) {
        if (other.name == fault.name) item.fail("there are two faults " + fault.name + "; give each its own name");
        if (const std::string why = conflict_of(fault, other); !why.empty()) item.fail(why);
      }
    all.insert(all.end(), faults->begin(), faults->end());
    config.plan.push_back(std::move(record));
  }
  return config;
}

}  // namespace sonar
