// Detects that a sonar misses the requested rate because pings take too long to compute, and reports it once. It is pure: Sonar
// passes the figures and gets a sentence.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace sonar {

class RateWatch {
 public:
  /// After each ping. `ticks` and `busy` count since the start, `busy` those of them at which the ping before was still being
  /// computed; the ping took `ping_s`; `rate_hz` is what the ticks have; `has_others`: other sonars are computed too. A sentence,
  /// at most once in its life.
  std::optional<std::string> look(std::uint64_t ticks, std::uint64_t busy, double ping_s, double rate_hz, bool has_others);

 private:
  void begin(std::uint64_t ticks, std::uint64_t busy, double rate_hz);

  bool said_ = false;
  int to_pass_over_ = 5;  // the first pings take longer, because they fill caches; they do not count
  double rate_hz_ = 0;
  std::uint64_t ticks_before_ = 0, busy_before_ = 0;
  int pings_ = 0;
  double ping_s_ = 0, longest_s_ = 0;  // computing time of the counted pings: sum and longest
};

}  // namespace sonar
