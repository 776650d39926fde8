#include "daemon/config/fault_support.hpp"

#include <algorithm>
#include <iterator>

#include "core/text/nearest.hpp"
#include "daemon/config/config_parts.hpp"
#include "daemon/config/products.hpp"
#include "protocol/host.hpp"

namespace sonar {
namespace {

using E = FaultEffect;
using S = FaultStage;

/// True if a kind acts on a sonar that sends pings only as datagrams: the kind changes the first datagram, or does not change
/// pings. In a dialogue over UDP it may also withhold pings.
bool acts_without_stream(const FaultKind& kind, bool dialogue) {
  if (kind.stage == S::stream) return false;
  if (kind.stage == S::framing)
    return kind.effect == E::set_field || kind.effect == E::add_to_field || kind.effect == E::flip || kind.effect == E::drop ||
           kind.effect == E::renumber;
  if (dialogue && (kind.effect == E::delay || kind.effect == E::jitter)) return true;
  constexpr E of_streams[] = {E::end, E::thin_link, E::delay, E::jitter, E::outbox_policy};
  return std::find(std::begin(of_streams), std::end(of_streams), kind.effect) == std::end(of_streams);
}

/// True if an effect can change an integer without a fixed offset.
bool takes_integer(E effect) {
  constexpr E all[] = {E::renumber, E::add_to_field, E::heat, E::beacon_address, E::second_beacon};
  return std::find(std::begin(all), std::end(all), effect) != std::end(all);
}

bool has_integer(const protocol::Vendor& vendor, protocol::Part part, protocol::FieldName name) {
  protocol::Bytes none;
  return vendor.change_integer(
      part, name, [](auto n) { return n; }, none);
}

/// True if a model of the vendor accepts `enough` of the values from first to last.
template <class T>
bool accepts(const protocol::Vendor& vendor, std::optional<T> protocol::SettingsOverride::*setting, std::uint32_t first,
             std::uint32_t last, int enough) {
  for (const auto& model : vendor.models()) {
    protocol::DeviceState device;
    device.id = 1;
    device.model = model;
    if (const auto options = check_options(vendor, {})) device.options = *options;
    device.settings = vendor.initial_settings(device).vendor_settings;
    int taken = 0;
    for (std::uint32_t value = first; value <= last; ++value) {
      protocol::SettingsOverride wanted;
      wanted.*setting = static_cast<T>(value);
      if (vendor.apply_override(wanted, device) && ++taken == enough) return true;
    }
  }
  return false;
}

/// Returns the reason if Vendor::apply_override refuses every value of the setting `what`, a parameter of the kind.
std::string why_without_setting(std::string_view what, const protocol::Vendor& vendor) {
  using Wanted = protocol::SettingsOverride;
  const auto has_modes = [](const auto& model) { return model->modes.size() > 1; };
  if ((what == "sample-bits" || what == "row-gains" || what == "largest") && !accepts(vendor, &Wanted::sample_bits, 8, 32, 2))
    return "has one type of samples";
  if (what == "beams" && !accepts(vendor, &Wanted::beams, 1, 512, 2)) return "has one number of beams";
  if (what == "mode" && std::none_of(vendor.models().begin(), vendor.models().end(), has_modes)) return "has one mode";
  if (what == "rate" && !accepts(vendor, &Wanted::rate_hz, 0, 0, 1)) return "has no standby";
  return {};
}

}  // namespace

std::string why_without_effect(const FaultKind& kind, const protocol::Vendor& vendor) {
  using Port = protocol::Port::Kind;
  if (kind.code == "B15") return "applies to files: cut one with head -c";
  if (kind.effect == E::harness) return "needs two network namespaces: sonarctl lab";
  for (const protocol::Make& make : protocol::makes())
    if (kind.code.front() == make.own_faults && vendor.name() != make.name())
      return "only the " + title_of(*make.device) + " link has it";
  const bool dialogue = vendor.port(Port::udp_dialogue) != nullptr;
  if (const protocol::Port* const stream = vendor.port(Port::udp_stream); kind.stage == S::datagrams) {
    if (stream == nullptr && !dialogue) return "sends no datagrams of pings";
    return kind.effect == E::leave_group && (stream == nullptr || stream->group.port == 0) ? "has no group of its own" : "";
  }
  const bool of_beacon = kind.stage == S::status || kind.effect == E::heat;
  if (of_beacon && vendor.port(Port::udp_beacon) == nullptr) return "has no status message";
  const protocol::Part part = of_beacon ? protocol::Part::beacon : protocol::Part::ping;
  if (kind.field && !vendor.field(part, *kind.field, {}) &&
      !(takes_integer(kind.effect) && has_integer(vendor, part, *kind.field)))
    return "has no field " + std::string(protocol::field_names[static_cast<std::size_t>(*kind.field)]);
  if (kind.effect == E::bearings && !vendor.region(protocol::Region::bearings, {})) return "sends no bearings";
  const bool of_stream = kind.stage == S::framing || kind.stage == S::stream || kind.stage == S::link || kind.stage == S::clients;
  const bool of_port = kind.effect == E::close_ports || kind.effect == E::flap || kind.effect == E::power_cycle;
  const bool of_datagrams = dialogue && kind.stage != S::clients && !of_port && acts_without_stream(kind, dialogue);
  if (of_stream && vendor.port(Port::tcp_stream) == nullptr && !of_datagrams) return "has no TCP stream";
  if (vendor.pings_by() == protocol::PingsBy::datagrams && !acts_without_stream(kind, dialogue))
    return "sends pings by datagrams alone";
  return kind.effect == E::change_settings ? why_without_setting(kind.given().front().value, vendor) : std::string();
}

std::string support_table() {
  std::string text = "| code | name | tier |";
  for (const protocol::Vendor* vendor : protocol::vendors()) text += " " + std::string(vendor->name()) + " |";
  text += "\n|---|---|---|";
  for (std::size_t i = 0; i < protocol::vendors().size(); ++i) text += "---|";
  for (const FaultKind& kind : fault_kinds()) {
    text += "\n| " + std::string(kind.code) + " | " + std::string(kind.name) + " | " + std::to_string(kind.tier) + " |";
    for (const protocol::Vendor* vendor : protocol::vendors()) {
      const std::string why = why_without_effect(kind, *vendor);
      text += " " + (why.empty() ? std::string("takes effect") : why) + " |";
    }
  }
  return text + "\n";
}

// Reads the keys for faults from the configuration: faults.armed, faults.journal and the plan (docs/faults.md).

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
