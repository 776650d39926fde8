#include "clients/sonarctl/control/fault_text.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <set>
#include <string_view>

#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "protocol/control/answers.hpp"

namespace sonar::clients {
namespace {

using text::format;

constexpr std::array<std::string_view, 6> triggers = {"ping", "every", "phase", "time_s", "probability", "on"};

Error wrong(const char* option, const std::string& given, const std::string& why) {
  return {ErrorKind::usage, std::string(option) + " " + given + ": " + why};
}

std::string parameter_text(const v1::FaultParameter& p) {
  std::string values;
  for (const std::string& word : p.words()) values += (values.empty() ? "" : "|") + word;
  return p.name() + "=" + p.value() + " (" + (values.empty() ? format("%.10g to %.10g", p.lowest(), p.highest()) : values) + ")";
}

}  // namespace

std::string text_from(const v1::FaultEntry& e) {
  std::string text =
      "fault " + e.fault() + (e.fault() == e.kind() ? "" : " (" + e.kind() + ")") + " " + e.event() + "  " + e.sonar();
  if (e.ping() > 0) text += format("  ping %u", e.ping());
  if (!e.client().empty()) text += format("  client %" PRIu64 " %s", e.client_number(), e.client().c_str());
  if (e.offset() >= 0) text += format("  byte %lld", static_cast<long long>(e.offset()));
  if (e.bytes_before() != e.bytes_after())
    text += format("  %" PRIu64 " -> %" PRIu64 " bytes", e.bytes_before(), e.bytes_after());
  const std::set<std::string> names = [&] {  // sorts them, because a map of protobuf has no order
    std::set<std::string> all;
    for (const auto& [name, value] : e.with()) all.insert(name);
    return all;
  }();
  if (e.event() == "began")
    for (const std::string& name : names) text += "  " + name + "=" + e.with().at(name);
  return text;
}

std::string fault_list_text(const v1::FaultReport& report) {
  if (!report.armed()) return "faults are not armed: sonard run --faults, or faults: {armed: true}\n";
  if (report.faults().empty()) return "no faults\n";
  std::vector<const v1::FaultStatus*> faults;  // active ones first, then waiting ones, then ended ones
  int name_width = 16, asked_width = 16;
  for (const v1::FaultStatus& f : report.faults()) {
    faults.push_back(&f);
    name_width = std::max(name_width, static_cast<int>(f.name().size()));
    asked_width = std::max(asked_width, static_cast<int>(f.do_().size()));
  }
  const auto rank = [](const v1::FaultStatus& f) { return f.state() == "active" ? 0 : f.state() == "over" ? 2 : 1; };
  std::stable_sort(faults.begin(), faults.end(), [&](const auto* a, const auto* b) { return rank(*a) < rank(*b); });
  std::string text = format("%-*s %-4s %-*s %-12s %-8s\n", name_width, "NAME", "KIND", asked_width, "ASKED AS", "SONAR", "STATE");
  for (const v1::FaultStatus* const one : faults) {
    const v1::FaultStatus& f = *one;
    text +=
        format("%-*s %-4s %-*s %-12s %-8s %6" PRIu64 " injection%s", name_width, f.name().c_str(), f.code().c_str(), asked_width,
               f.do_().c_str(), f.sonar().c_str(), f.state().c_str(), f.injections(), f.injections() == 1 ? "" : "s");
    if (f.expires_s() > 0) text += format("  ends in %.1f s", f.expires_s());
    text += (f.waits_for().empty() ? "" : "  waits for " + f.waits_for()) + "\n";
  }
  return text;
}

std::string fault_kinds_text(const v1::FaultReport& report) {
  std::string text;
  for (const v1::FaultKind& k : report.kinds()) {
    text += format("%-4s %-22s ", k.code().c_str(), k.name().c_str()) + k.sentence();
    text += k.default_s() > 0 ? format(" %g s.", k.default_s()) : std::string(" Per ping.");
    for (const v1::FaultParameter& p : k.parameters()) text += "  " + parameter_text(p);
    text += "\n";
  }
  for (const v1::Trouble& t : report.troubles()) {
    std::string codes;
    for (const std::string& code : t.codes()) codes += (codes.empty() ? "" : "+") + code;
    text += format("%-27s ", t.name().c_str()) + t.sentence() + " " + codes + "  severity=2 (1|2|3)\n";
  }
  return text;
}

std::string fault_support_text(const v1::FaultReport& report) {
  std::set<std::string> vendors;  // all vendors, taken from the faults that a daemon cannot inject, which name each of them
  for (const v1::FaultKind& k : report.kinds())
    for (const auto& [vendor, why] : k.without_effect()) vendors.insert(vendor);
  std::string text = "| code | name | tier |", rule = "|---|---|---|";
  for (const std::string& vendor : vendors) {
    text += " " + vendor + " |";
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const v1::FaultKind& k : report.kinds()) {
    text += "| " + k.code() + " | " + k.name() + format(" | %u |", k.tier());
    for (const std::string& vendor : vendors) {
      const auto why = k.without_effect().find(vendor);
      text += " " + (why == k.without_effect().end() ? std::string("takes effect") : why->second) + " |";
    }
    text += "\n";
  }
  return text;
}

Result<void> read_parameters(const std::vector<std::string>& given, control::FaultRecord& record) {
  for (const std::string& pair : given) {
    const std::size_t sign = pair.find('=');
    if (sign == 0 || sign == std::string::npos) return tl::unexpected(wrong("--with", pair, "give NAME=VALUE, such as bytes=16"));
    if (!record.with.emplace(pair.substr(0, sign), pair.substr(sign + 1)).second)
      return tl::unexpected(wrong("--with", pair, "is given twice"));
  }
  return {};
}

Result<void> read_trigger(const std::vector<std::string>& given, control::FaultRecord& record) {
  control::FaultRecord::At& at = record.at;
  for (const std::string& pair : given) {
    const std::size_t sign = std::min(pair.find('='), pair.size());
    const std::string name = pair.substr(0, sign);
    const std::string value = sign < pair.size() ? pair.substr(sign + 1) : std::string();
    if (name == "on") {
      at.on = value;
      if (!value.empty()) continue;
      return tl::unexpected(wrong("--at", pair, "give on=connect, config, status or disconnect"));
    }
    if (name == "time_s" || name == "probability") {
      (name == "time_s" ? at.time_s : at.probability) = text::parse_decimal(value);
      if (name == "time_s" ? at.time_s : at.probability) continue;
      return tl::unexpected(wrong("--at", pair, "is not a number"));
    }
    if (std::find(triggers.begin(), triggers.end(), name) == triggers.end())
      return tl::unexpected(wrong("--at", pair, "give NAME=VALUE" + text::suggestion(name, triggers, "triggers")));
    const auto number = text::parse_unsigned(value);
    if (!number) return tl::unexpected(wrong("--at", pair, "is not a whole number"));
    if (name == "phase")
      at.phase = *number;
    else
      (name == "ping" ? at.ping : at.every) = *number;
  }
  return {};
}

}  // namespace sonar::clients
