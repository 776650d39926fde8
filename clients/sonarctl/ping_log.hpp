// Statistics of a stream of pings: number, regularity, faults, and whether the settings took effect. Without I/O: listen feeds
// it, prints its lines and derives its exit code from it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/any_ping.hpp"

namespace sonar::clients {

/// Seconds on a monotonic clock, from any origin.
using Seconds = double;

struct PingReport {
  std::vector<std::string> errors;           // of identities and sequence
  std::vector<std::string> echo_mismatches;  // settings that do not have the requested value yet
};

struct PingSummary {
  std::uint64_t pings = 0, bytes = 0, missing_ids = 0, identity_errors = 0, dummies = 0, junk_bytes = 0;
  std::optional<std::uint64_t> echo_satisfied_at;  // number of the ping, from 1; nullopt = never, or nothing was requested
  bool of_head = false;         // a BlueView head: numbers may skip, since other hosts request pings too, and nothing is echoed
  std::uint64_t echo_lost = 0;  // pings after that one whose echo differed
  double rate_hz = 0;
  double interval_p50_ms = 0, interval_p99_ms = 0, interval_max_ms = 0;
};

class PingLog {
 public:
  /// `asked`: the fire message sent, if any.
  explicit PingLog(std::optional<oculus::FireRequest> asked) : asked_(std::move(asked)) {}

  PingReport add(const AnyPing& ping, Seconds at);
  void add_dummy() { ++summary_.dummies; }
  const PingSummary& counts() const { return summary_; }  // so far, without rate and intervals
  PingSummary summary(std::uint64_t junk_bytes) const;

 private:
  std::optional<oculus::FireRequest> asked_;
  oculus::PingSequence sequence_;
  PingSummary summary_;
  std::vector<Seconds> arrivals_;
};

/// Value below which `share` (0..1) of the values lie; 0 for none. Sorts a copy.
double percentile(std::vector<double> values, double share);

/// Faults of the stream for a driver; empty = none.
std::vector<std::string> complaints(const PingSummary& summary, bool asked);

std::string line_from(const AnyPing& ping, const PingReport& report);  // one line per ping
std::string text_from(const PingSummary& summary, bool asked);
std::string json_from(const AnyPing& ping, const PingReport& report, Seconds at);
std::string json_from(const PingSummary& summary, bool asked);

}  // namespace sonar::clients
