#include "clients/sonarctl/ping_log.hpp"

#include <algorithm>
#include <cinttypes>
#include <cmath>

#include <nlohmann/json.hpp>

#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

using text::format;

std::string echo_text(const PingSummary& summary) {
  if (!summary.echo_satisfied_at) return "never";
  return "ping " + std::to_string(*summary.echo_satisfied_at) +
         (summary.echo_lost > 0 ? ", then lost in " + std::to_string(summary.echo_lost) : "");
}

}  // namespace

void PingLog::add(const HostPing& ping, Seconds at) {
  arrivals_.push_back(at);
  ++summary_.pings;
  summary_.bytes += ping.facts.message_size;
  summary_.identity_errors += ping.errors.size();
  if (ping.echo_mismatches.empty() && !summary_.echo_satisfied_at) summary_.echo_satisfied_at = summary_.pings;
  if (ping.echo_mismatches.empty()) summary_.limited = ping.limited;
  if (!ping.echo_mismatches.empty() && summary_.echo_satisfied_at) ++summary_.echo_lost;
}

PingSummary PingLog::summary(const std::optional<protocol::Host::Counts>& of_wire) const {
  PingSummary summary = summary_;
  summary.of_wire = of_wire;
  std::vector<double> intervals_ms;
  for (std::size_t i = 1; i < arrivals_.size(); ++i) intervals_ms.push_back(1000 * (arrivals_[i] - arrivals_[i - 1]));
  if (intervals_ms.empty()) return summary;
  const double total_s = arrivals_.back() - arrivals_.front();
  if (total_s > 0) summary.rate_hz = static_cast<double>(intervals_ms.size()) / total_s;
  summary.interval_p50_ms = percentile(intervals_ms, 0.50);
  summary.interval_p99_ms = percentile(intervals_ms, 0.99);
  summary.interval_max_ms = *std::max_element(intervals_ms.begin(), intervals_ms.end());
  return summary;
}

std::vector<std::string> NoticeLog::kept(const std::vector<std::string>& notices) {
  constexpr std::uint64_t first_ones = 3;
  std::vector<std::string> kept;
  for (const std::string& notice : notices) {
    std::string kind = notice;
    std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
    if (kinds_.size() >= most_kinds && !kinds_.contains(kind)) kind.clear();  // all further kinds count as one
    Kind& of = kinds_[kind];
    of.last = notice;
    const std::uint64_t count = ++of.count;
    std::uint64_t ten = 1;
    while (ten < count) ten *= 10;
    if (count > first_ones && count != ten) continue;
    of.kept = count;
    kept.push_back(count <= first_ones ? notice : notice + "  (the " + std::to_string(count) + "th message of this kind)");
  }
  return kept;
}

std::vector<std::string> NoticeLog::rest() const {
  std::vector<std::string> rest;
  for (const auto& [kind, of] : kinds_)
    if (of.count > of.kept)
      rest.push_back(of.last + "  (the last of " + std::to_string(of.count) + " messages of " +
                     (kind.empty() ? "further kinds)" : "this kind)"));
  return rest;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto place = static_cast<std::ptrdiff_t>(std::lround(std::clamp(share, 0.0, 1.0) * last));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

std::vector<std::string> complaints(const PingSummary& summary, bool asked) {
  std::vector<std::string> found;
  if (summary.pings == 0) found.push_back("no ping arrived");
  if (summary.identity_errors > 0)
    found.push_back(std::to_string(summary.identity_errors) + " broken identities: drivers would drop these pings");
  if (const auto& of = summary.of_wire; of && of->junk_bytes > 0)
    found.push_back(text::counted(of->junk_bytes, "byte") + " between messages");
  if (asked && summary.pings > 0 && !summary.echo_satisfied_at)
    found.push_back("the echoed settings never matched the request; a recording that is replayed keeps its own: --as-it-is");
  if (summary.echo_lost > 0)
    found.push_back("the echo was lost again in " + std::to_string(summary.echo_lost) +
                    " pings: another client or the live view changed the settings");
  return found;
}

std::string line_from(const HostPing& ping) {
  const protocol::PingFacts& f = ping.facts;
  std::string line = format("ping %u  %u x %u  %u bit  %.2f m  %.4f MHz  %zu bytes", f.number, f.rows, f.beams, f.bits, f.range_m,
                            f.frequency_hz / 1e6, f.message_size);
  if (!f.note.empty()) line += "  " + f.note;
  for (const std::string& error : ping.errors) line += "\n  error: " + error;
  for (const std::string& mismatch : ping.echo_mismatches) line += "\n  echo: " + mismatch;
  return line;
}

std::string text_from(const PingSummary& s, bool asked, std::string_view rate_unit) {
  std::string text = "pings " + std::to_string(s.pings);
  if (s.of_wire)
    text += format(", missing ids %" PRIu64 ", identity errors %" PRIu64 ", junk bytes %" PRIu64 ", dummies %" PRIu64,
                   s.of_wire->missing_pings, s.identity_errors, s.of_wire->junk_bytes, s.of_wire->dummies);
  text += "\n";
  text += format("rate %.2f %s, interval p50 %.1f ms, p99 %.1f ms, longest %.1f ms, %.2f MB/s", s.rate_hz,
                 std::string(rate_unit).c_str(), s.interval_p50_ms, s.interval_p99_ms, s.interval_max_ms,
                 s.pings > 0 ? s.rate_hz * static_cast<double>(s.bytes) / static_cast<double>(s.pings) / 1e6 : 0.0);
  if (asked) text += "\nsettings echoed as requested: " + echo_text(s);
  const std::string limits = text::joined(s.limited, "; ");
  if (!limits.empty()) text += (asked ? ", but the sonar limits them: its pings have " : "\nthe sonar's pings have ") + limits;
  return text;
}

std::string json_from(const HostPing& ping, Seconds at) {
  const protocol::PingFacts& f = ping.facts;
  const nlohmann::json out{{"ping", f.number},
                           {"at_s", at},
                           {"rows", f.rows},
                           {"beams", f.beams},
                           {"bits", f.bits},
                           {"row_m", f.row_m},
                           {"frequency_hz", f.frequency_hz},
                           {"bytes", f.message_size},
                           {"errors", ping.errors},
                           {"echo_mismatches", ping.echo_mismatches}};
  return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string json_from(const PingSummary& s, bool asked) {
  const auto judged = [&s](std::uint64_t value) { return s.of_wire ? nlohmann::json(value) : nlohmann::json(nullptr); };
  const protocol::Host::Counts of_wire = s.of_wire.value_or(protocol::Host::Counts{});
  nlohmann::json out{{"pings", s.pings},
                     {"missing_ids", judged(of_wire.missing_pings)},
                     {"identity_errors", judged(s.identity_errors)},
                     {"junk_bytes", judged(of_wire.junk_bytes)},
                     {"dummies", judged(of_wire.dummies)},
                     {"bytes", s.bytes},
                     {"rate_hz", s.rate_hz},
                     {"interval_p50_ms", s.interval_p50_ms},
                     {"interval_p99_ms", s.interval_p99_ms},
                     {"interval_max_ms", s.interval_max_ms}};
  if (!s.limited.empty()) out["limited"] = s.limited;
  if (asked) out["echo_satisfied_at"] = s.echo_satisfied_at ? nlohmann::json(*s.echo_satisfied_at) : nlohmann::json(nullptr);
  return nlohmann::json{{"summary", out}}.dump();
}

}  // namespace sonar::clients
