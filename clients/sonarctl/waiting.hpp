// Prints to standard error the reason why a command waits.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "clients/sonarctl/commands.hpp"

namespace sonar::clients {

/// Prints a line about the wait for the first ping, unless the wait is very short.
class FirstPingWait {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds moment{300};

  /// `observes`: the command has requested nothing. The line then names no limit of the wait, unless the wait `is_limited`.
  FirstPingWait(const SourceOptions& source, const PingStream& stream, bool observes, bool is_limited = false,
                Clock::time_point now = Clock::now());
  /// Returns how long to wait: `most`, or less if the line is due before.
  std::chrono::milliseconds patience(std::chrono::milliseconds most, Clock::time_point now = Clock::now()) const;
  /// Call it after each wait. `has_ping`: a ping has arrived.
  void look(bool has_ping, Clock::time_point now = Clock::now());

 private:
  std::string line_;  // empty after it was printed, or if it is no longer needed
  Clock::time_point due_;
};

/// The growth of a picture of many pings.
class PictureProgress {
 public:
  using Clock = std::chrono::steady_clock;

  explicit PictureProgress(double limit_s) : limit_s_(limit_s) {}
  /// Returns a line to print with the first ping, then every two seconds. `ping` is not whole.
  std::optional<std::string> line_at(const HostPing& ping, Clock::time_point now);
  /// True if the time for completing the picture is over.
  bool is_over(Clock::time_point now) const;

 private:
  double limit_s_;
  std::optional<Clock::time_point> begin_;
  Clock::time_point said_;
  std::size_t first_lines_ = 0;
};

}  // namespace sonar::clients
