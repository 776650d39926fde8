// Pings for viewers while no driver is connected: at most 5 per second, or 25 with one beam. They have their own numbers and
// noise, so that they do not affect a driver's pings. Pure: the caller computes the pings that are due, and calls why_over()
// regularly.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "daemon/emulator/connections/recent_rate.hpp"
#include "daemon/emulator/sonar/sonar.hpp"

namespace sonar {

class Preview {
 public:
  static constexpr std::chrono::milliseconds shortest_period{200}, shortest_of_one_beam{40};
  static constexpr std::chrono::seconds longest{600};

  void begin(Time now) { until_ = now + longest; }
  void end();
  bool on() const { return until_.has_value(); }
  /// The time between two previews of this sonar.
  static std::chrono::nanoseconds period(const Sonar& sonar);
  /// The reason, for the log, why the preview must end now; empty if it may continue.
  std::string why_over(const Sonar& sonar, Time now) const;
  /// Returns the ping that is due. Call done() when it is computed; until then no other is due.
  std::optional<PingRequest> due(const Sonar& sonar, Time now);
  void done(bool made);
  /// Previews per second, measured by RecentRate; 0 = none.
  double hz(Time now) const { return made_.hz(now); }

 private:
  std::optional<Time> until_, fired_at_;
  std::uint32_t number_ = 0;
  bool busy_ = false;
  RecentRate made_;
};

}  // namespace sonar
