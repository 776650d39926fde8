#include "daemon/config/faults/fault.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"

namespace sonar {
namespace {

using std::chrono::nanoseconds;

constexpr double longest_s = 86400;
constexpr std::uint64_t most_pings = 1'000'000'000;
constexpr double least_probability = 1e-9;  // a fault with a lower probability would never act, because no run has enough pings

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (end > 0) words.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

std::optional<double> number_from(std::string_view text) {
  if (text.starts_with("0x") || text.starts_with("0X")) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), value, 16);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return static_cast<double>(value);
  }
  return text::parse_decimal(text);
}

/// Checks one record. Errors begin with the name of the record.
class Check {
 public:
  Check(const FaultRecord& record, bool manual) : record_(record), manual_(manual) {}

  Result<std::vector<Fault>> faults() {
    std::vector<Fault> all;
    if (const FaultKind* const kind = find_fault_kind(record_.what)) {
      all.push_back(of_kind(*kind, record_.with, kind->default_s));
    } else if (const Trouble* const trouble = find_trouble()) {
      all = of_trouble(*trouble);
    } else {
      std::vector<std::string_view> names;
      for (const FaultKind& k : fault_kinds()) names.push_back(k.name);
      for (const Trouble& t : troubles()) names.push_back(t.name);
      wrong("\"" + record_.what.substr(0, 64) + "\" is not a fault" + text::suggestion(record_.what, names, "faults"));
    }
    if (!error_.empty()) {
      const std::string name = record_.name.empty() ? record_.what : record_.name;
      return failure(ErrorKind::usage, "fault " + name.substr(0, 64) + ": " + error_);
    }
    return all;
  }

 private:
  // Stores the first error; the checks continue with harmless values.
  void wrong(std::string text) {
    if (error_.empty()) error_ = std::move(text);
  }

  const Trouble* find_trouble() const {
    for (const Trouble& t : troubles())
      if (t.name == record_.what) return &t;
    return nullptr;
  }

  // Converts a trouble to one fault for each of its kinds, with the parameters of the severity.
  std::vector<Fault> of_trouble(const Trouble& trouble) {
    auto with = record_.with;
    std::size_t severity = 2;
    if (const auto it = with.find("severity"); it != with.end()) {
      if (it->second != "1" && it->second != "2" && it->second != "3")
        wrong("severity must be 1, 2 or 3, not " + it->second);
      else
        severity = static_cast<std::size_t>(it->second.front() - '0');
      with.erase(it);
    }
    if (!with.empty())
      wrong("the trouble " + std::string(trouble.name) + " has one parameter, severity, not " + with.begin()->first);
    std::vector<Fault> all;
    for (const Trouble::Part& part : trouble.parts) {
      if (part.code.empty()) break;
      std::map<std::string, std::string> given;
      for (const std::string_view pair : words_of(part.with[severity - 1])) {
        const std::size_t sign = pair.find('=');
        given.emplace(pair.substr(0, sign), pair.substr(sign + 1));
      }
      all.push_back(of_kind(*find_fault_kind(part.code), given, trouble.default_s));
      // `after` is a fraction of the trouble's duration; all parts end at the same time.
      all.back().delay = nanoseconds(static_cast<std::int64_t>(part.after * static_cast<double>(all.back().span.time.count())));
      all.back().span.time -= all.back().delay;
      all.back().name = (record_.name.empty() ? std::string(trouble.name) : record_.name) + "." + std::to_string(all.size());
    }
    return all;
  }

  Fault of_kind(const FaultKind& kind, const std::map<std::string, std::string>& with, double default_s) {
    Fault fault;
    fault.name = record_.name.empty() ? record_.what : record_.name;
    fault.what = record_.what;
    fault.kind = &kind;
    fault.sonar = record_.sonar;
    fault.at = record_.at;
    read_parameters(kind, with, fault);
    read_trigger(fault);
    read_client(kind, fault);
    read_span(kind, default_s, fault);
    return fault;
  }

  void read_parameters(const FaultKind& kind, std::map<std::string, std::string> with, Fault& fault) {
    std::vector<std::string_view> names;
    for (const FaultParameter& parameter : kind.given()) {
      names.push_back(parameter.name);
      const auto given = with.find(std::string(parameter.name));
      const std::string value(given == with.end() ? std::string(parameter.value) : given->second);
      if (given != with.end()) with.erase(given);
      read_parameter(parameter, value, fault);
    }
    if (with.empty()) return;
    const std::string unknown = with.begin()->first.substr(0, 64);
    wrong(std::string(kind.code) + " (" + std::string(kind.name) + ") has no parameter \"" + unknown + '"' +
          (names.empty() ? "; it has none" : text::suggestion(unknown, names, "parameters")));
  }

  void read_parameter(const FaultParameter& parameter, const std::string& value, Fault& fault) {
    const std::string name(parameter.name);
    if (!parameter.words.empty()) {
      const std::vector<std::string_view> words = words_of(parameter.words);
      if (std::find(words.begin(), words.end(), value) == words.end())
        wrong(name + " cannot be \"" + value.substr(0, 64) + '"' + text::suggestion(value, words, "words"));
      fault.words[name] = value;
      return;
    }
    const auto number = number_from(value);
    const bool fits = number && *number >= parameter.lowest && *number <= parameter.highest &&
                      (!parameter.whole || std::trunc(*number) == *number);
    if (!fits)
      wrong(text::format("%s must be a %s from %.10g to %.10g, not \"%s\"", name.c_str(),
                         parameter.whole ? "whole number" : "number", parameter.lowest, parameter.highest,
                         value.substr(0, 64).c_str()));
    fault.numbers[name] = number.value_or(0);
  }

  void read_trigger(Fault& fault) {
    const FaultRecord::At& at = record_.at;
    const int given = int{at.ping.has_value()} + int{at.every.has_value()} + int{at.time_s.has_value()} +
                      int{at.probability.has_value()} + int{!at.on.empty()};
    if (given > 1) wrong("at: give one of ping, every, time_s, probability and on, not " + std::to_string(given));
    if (at.ping && *at.ping == 0) wrong("at: ping counts from 1");
    if (at.every && (*at.every == 0 || *at.every > most_pings)) wrong("at: every must be from 1 to 1000000000");
    if (at.phase != 0 && !at.every) wrong("at: phase belongs to every");
    if (at.every && at.phase >= std::max<std::uint64_t>(*at.every, 1))
      wrong("at: phase must be below every, " + std::to_string(*at.every) + ": no ping number modulo " +
            std::to_string(*at.every) + " is " + std::to_string(at.phase));
    if (at.time_s && !(*at.time_s >= 0 && *at.time_s <= 1e9)) wrong("at: time_s must be from 0 to 1e9 s since the start");
    if (at.probability && !(*at.probability >= least_probability && *at.probability <= 1))
      wrong("at: probability must be from 1e-9 to 1");
    if (at.on.empty()) return;
    const auto it = std::find(occasion_names.begin(), occasion_names.end(), at.on);
    if (it == occasion_names.end())
      return wrong("at: on cannot be \"" + at.on.substr(0, 64) + '"' + text::suggestion(at.on, occasion_names, "occasions"));
    fault.on = static_cast<Occasion>(it - occasion_names.begin());
  }

  // Reads a choice of clients: all, newest, oldest, an ordinal, an address, or a prefix.
  void read_client(const FaultKind& kind, Fault& fault) {
    const std::string& text = record_.client;
    using Kind = ClientChoice::Kind;
    if (text.empty() || text == "all") return;
    const bool of_clients = kind.stage == FaultStage::framing || kind.stage == FaultStage::stream ||
                            kind.stage == FaultStage::link || kind.effect == FaultEffect::stop_reading;
    if (!of_clients || kind.effect == FaultEffect::close_ports || kind.effect == FaultEffect::power_cycle)
      return wrong("acts on the device: it cannot be limited to the client " + text.substr(0, 64));
    if (text == "newest" || text == "oldest") {
      fault.client.kind = text == "newest" ? Kind::newest : Kind::oldest;
      return;
    }
    if (const auto number = text::parse_unsigned(text)) {
      if (*number == 0) wrong("client: ordinals count from 1");
      fault.client = {Kind::number, *number, {}, 32};
      return;
    }
    const std::size_t slash = std::min(text.find('/'), text.size());
    const auto address = text::parse_ipv4(std::string_view(text).substr(0, slash));
    const auto bits =
        slash == text.size() ? std::optional<std::uint64_t>(32) : text::parse_unsigned(std::string_view(text).substr(slash + 1));
    if (!address || !bits || *bits > 32)
      return wrong("client must be all, newest, oldest, an ordinal, an address or a prefix such as 10.0.0.0/8, not \"" +
                   text.substr(0, 64) + '"');
    fault.client = {Kind::prefix, 0, *address, static_cast<int>(*bits)};
  }

  // Determines the duration of an occurrence (a time or pings) and the number of occurrences (count).
  void read_span(const FaultKind& kind, double default_s, Fault& fault) {
    const FaultRecord::For& lasts = record_.lasts;
    if (manual_ && lasts.seconds.value_or(0) > static_cast<double>(longest_manual_fault.count()))
      return wrong(
          "for: a fault of a running daemon ends after 600 s at the latest; a plan in the configuration may last longer");
    if (lasts.seconds && !(*lasts.seconds > 0 && *lasts.seconds <= longest_s))
      return wrong("for: seconds must be above 0 and at most 86400");
    if ((lasts.pings && (*lasts.pings == 0 || *lasts.pings > most_pings)) ||
        (lasts.count && (*lasts.count == 0 || *lasts.count > most_pings)))
      return wrong("for: pings and count must be from 1 to 1000000000");
    if (lasts.pings && !kind.per_ping() && kind.stage != FaultStage::payload && kind.stage != FaultStage::framing)
      return wrong(std::string(kind.code) + " lasts for a time: give for: {seconds: ...}");
    // A span is either a time or a number of pings; the other value is 0.
    const double seconds = lasts.seconds.value_or(lasts.pings || kind.per_ping() ? 0 : default_s);
    fault.span.time = nanoseconds(static_cast<std::int64_t>(std::llround(seconds * 1e9)));
    fault.span.pings = lasts.pings.value_or(seconds > 0 ? 0 : 1);
    // A fault whose trigger can recur acts without limit unless a count is given. Any other fault acts once.
    const bool once = !record_.at.every && !record_.at.probability && record_.at.on.empty();
    fault.span.count = lasts.count.value_or(once ? 1 : 0);
    // A record with a count but no trigger acts on that many successive pings.
    if (once && kind.per_ping() && lasts.count && !lasts.pings && !lasts.seconds) {
      fault.span.pings = *lasts.count;
      fault.span.count = 1;
    }
  }

  const FaultRecord& record_;
  bool manual_;
  std::string error_;
};

bool overlap(const std::string& a, const std::string& b) { return a.empty() || b.empty() || a == b; }

}  // namespace

double Fault::number(const std::string& parameter) const {
  const auto it = numbers.find(parameter);
  return it == numbers.end() ? 0 : it->second;
}

const std::string& Fault::word(const std::string& parameter) const {
  static const std::string none;
  const auto it = words.find(parameter);
  return it == words.end() ? none : it->second;
}

std::map<std::string, std::string> Fault::used() const {
  std::map<std::string, std::string> all = words;
  for (const auto& [parameter, value] : numbers) all[parameter] = text::format("%.10g", value);
  return all;
}

Result<std::vector<Fault>> check_fault(const FaultRecord& record, bool manual) { return Check(record, manual).faults(); }

/// Returns an error if two faults write the same part of the same sonar, because the result would depend on their order.
std::string conflict_of(const Fault& a, const Fault& b) {
  if (a.kind->touches.empty() || a.kind->touches != b.kind->touches || !overlap(a.sonar, b.sonar)) return {};
  return "fault " + a.name + " (" + std::string(a.kind->code) + ") and fault " + b.name + " (" + std::string(b.kind->code) +
         ") would both write the same part (" + std::string(a.kind->touches) + "); remove one, or name different sonars";
}

}  // namespace sonar
