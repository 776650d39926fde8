// Detects that a sonar does not reach the requested rate because pings take too long to compute. PingSource passes the figures
// and gets one sentence to report.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace sonar {

class RateWatch {
 public:
  /// Call it after each ping. `ticks`: ticks since the start; `busy`: SkippedTicks::busy; `ping_s`: computing time of
  /// this ping; `rate_hz`: rate of the ticks; `has_others`: other sonars use the same engine. Returns a sentence at most once.
  std::optional<std::string> look(std::uint64_t ticks, std::uint64_t busy, double ping_s, double rate_hz, bool has_others);

 private:
  void begin(std::uint64_t ticks, std::uint64_t busy, double rate_hz);

  bool warned_ = false;
  int to_pass_over_ = 5;  // number of first pings to ignore, which take longer because they fill caches
  double rate_hz_ = 0;
  std::uint64_t ticks_before_ = 0, busy_before_ = 0;
  int pings_ = 0;
  double ping_s_ = 0, longest_s_ = 0;  // computing time of the counted pings: sum and longest
};

}  // namespace sonar
