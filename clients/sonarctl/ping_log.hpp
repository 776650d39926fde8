// Statistics of a stream of pings: number, regularity, faults, and whether the settings took effect. It does no I/O: `listen`
// passes pings to it, prints its lines and derives the exit code from it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/sonarctl/elapsed.hpp"
#include "protocol/host.hpp"

namespace sonar::clients {

/// A time in seconds on a monotonic clock. The origin is arbitrary.
using Seconds = double;

using protocol::HostPing;

struct PingSummary {
  std::uint64_t pings = 0, bytes = 0, identity_errors = 0;
  std::optional<protocol::Host::Counts> of_wire;   // nullopt: the protocol does not number messages
  std::optional<std::uint64_t> echo_satisfied_at;  // number of the first ping with the requested settings, from 1; nullopt =
                                                   // none; 1 if nothing was requested
  std::uint64_t echo_lost = 0;                     // later pings whose echo differed
  std::vector<std::string> limited;                // HostPing::limited of the last ping with the requested settings
  double rate_hz = 0;
  double interval_p50_ms = 0, interval_p99_ms = 0, interval_max_ms = 0;
};

class PingLog {
 public:
  void add(const HostPing& ping, Seconds at);
  const PingSummary& counts() const { return summary_; }  // counts so far, without rate and intervals
  PingSummary summary(const std::optional<protocol::Host::Counts>& of_wire) const;

 private:
  PingSummary summary_;
  std::vector<Seconds> arrivals_;
};

/// Shortens notices that come with each ping. Notices that differ only in numbers are of one kind. Of each kind the first three
/// are kept, then the 10th, the 100th and so on, with their number.
class NoticeLog {
 public:
  std::vector<std::string> kept(const std::vector<std::string>& notices);
  /// Call it at the end. Returns the last notice of each kind, with the number of notices of the kind, unless it was kept.
  std::vector<std::string> rest() const;

 private:
  static constexpr std::size_t most_kinds = 100;
  struct Kind {
    std::uint64_t count = 0, kept = 0;  // kept: the count when one was last kept
    std::string last;
  };
  std::map<std::string, Kind> kinds_;  // by text without digits
};

/// Returns the value below which the fraction `share` (0..1) of the values lies; 0 if there are none.
double percentile(std::vector<double> values, double share);

/// Describes the faults of the stream that a driver would notice; empty = none.
std::vector<std::string> complaints(const PingSummary& summary, bool asked);

std::string line_from(const HostPing& ping);  // one line, and one for each error or difference of the echo
/// `rate_unit`: that of the sonar's make.
std::string text_from(const PingSummary& summary, bool asked, std::string_view rate_unit);
std::string json_from(const HostPing& ping, Seconds at);
std::string json_from(const PingSummary& summary, bool asked);

}  // namespace sonar::clients
