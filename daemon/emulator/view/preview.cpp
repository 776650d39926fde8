#include "daemon/emulator/view/preview.hpp"

#include <algorithm>

namespace sonar {

std::string Preview::why_over(const Sonar& sonar, Time now) const {
  if (sonar.connections().has_audience()) return "a driver is connected";
  if (until_ && now >= *until_) return "after " + std::to_string(longest.count()) + " s";
  return {};
}

/// A sonar in standby shows what it would see.
std::optional<PingRequest> Preview::due(const Sonar& sonar, Time now) {
  if (!on() || busy_) return std::nullopt;
  const auto period = std::max<std::chrono::nanoseconds>(shortest_period, ping_period(sonar.settings()));
  if (fired_at_ && now < *fired_at_ + period) return std::nullopt;
  auto request = sonar.preview_request(PingNumber(number_ + 1), now);
  if (!request) return std::nullopt;
  ++number_;
  fired_at_ = now;
  busy_ = true;
  return request;
}

}  // namespace sonar
