// Counters and histograms of one sonar. The Sonar updates the values, and prometheus.hpp prints them.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/emulator/connections/outbox.hpp"
#include "daemon/emulator/connections/pacer.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

/// A histogram of durations. The bounds are fixed, so that add() needs no memory and runs can be compared.
class Histogram {
 public:
  static constexpr std::array bounds_s{0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02,
                                       0.05,   0.1,    0.2,    0.5,   1.0,   2.0,   5.0,  10.0};

  /// Adds a duration; a negative one counts as 0.
  void add(double seconds);
  std::uint64_t count() const { return count_; }
  double sum_s() const { return sum_s_; }
  /// Returns the counts. Element i counts durations above bounds_s[i - 1] up to bounds_s[i]; the last element counts those beyond
  /// all bounds.
  const std::array<std::uint64_t, bounds_s.size() + 1>& counts() const { return counts_; }
  /// Estimates a quantile, q in [0, 1], with linear interpolation between two bounds; the error is at most a factor of 2.5.
  /// Returns the last bound for a quantile beyond it, and 0 for an empty histogram.
  double quantile_s(double q) const;

 private:
  std::array<std::uint64_t, bounds_s.size() + 1> counts_{};
  std::uint64_t count_ = 0;
  double sum_s_ = 0;
};

/// The counters of one sonar. ticks = pings + skipped (+ one ping being computed, + a waiting tick or trigger);
/// pings = refused + unwanted + those offered to clients; offered = sent + dropped (+ those in the outboxes now).
struct DeviceFigures {
  std::uint64_t ticks = 0;
  std::uint64_t skipped_ticks = 0;  // number of ticks without a ping
  SkippedTicks skipped;             // skipped ticks by reason
  std::uint64_t skipped_stale = 0;  // one more reason: the vehicle's poses had stopped (poses.on_stale: stop)
  std::uint64_t pings = 0;          // simulated pings
  std::uint64_t refused = 0;        // pings that the engine refused
  std::uint64_t unwanted = 0;       // pings whose clients had left or had requested other settings
  std::uint64_t out_of_water = 0;   // pings of noise only, because the sonar was above the sea surface
  std::uint64_t served = 0;         // pings that at least one client received completely
  std::uint64_t offered = 0;        // pings offered to clients, counted once per client
  std::uint64_t sent = 0;           // pings that a client received completely, counted once per client
  std::uint64_t dropped = 0;        // offered pings that a client did not receive completely
  std::array<std::uint64_t, drop_reasons> dropped_by{};  // dropped pings by DropReason
  std::uint64_t waiting = 0;                             // pings in outboxes now that are not being written yet
  std::uint64_t clients = 0, refused_clients = 0;        // served and refused clients since the start
  std::uint64_t clients_now = 0, clients_queued = 0;
  std::uint64_t bytes_written = 0, bytes_read = 0;
  double simulation_s = 0;  // wall time of all pings
  Histogram simulation;     // time to compute a ping
  Histogram lateness;       // delay from a tick's time to its processing
  Histogram jitter;         // difference between the interval at which two pings were sent and that of their ticks
  Histogram latency;        // time from a ping's tick until the kernel has the last byte, for each client
};

}  // namespace sonar
