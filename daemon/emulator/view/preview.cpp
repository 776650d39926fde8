#include "daemon/emulator/view/preview.hpp"

#include <algorithm>

namespace sonar {

std::string Preview::why_over(const Sonar& sonar, Time now) const {
  if (sonar.connections().has_audience()) return "a driver is connected";
  if (until_ && now >= *until_) return "after " + std::to_string(longest.count()) + " s";
  return {};
}

std::chrono::nanoseconds Preview::period(const Sonar& sonar) {
  const PingSettings& s = sonar.settings();
  return std::max<std::chrono::nanoseconds>(s.beam_count > 1 ? shortest_period : shortest_of_one_beam, ping_period(s));
}

/// A sonar in standby shows the picture that it would have if it pinged.
std::optional<PingRequest> Preview::due(const Sonar& sonar, Time now) {
  if (!on() || busy_) return std::nullopt;
  if (fired_at_ && now < *fired_at_ + period(sonar)) return std::nullopt;
  auto request = sonar.preview_request(PingNumber(number_ + 1), now);
  if (!request) return std::nullopt;
  ++number_;
  fired_at_ = now;
  busy_ = true;
  return request;
}

void Preview::done(bool made) {
  busy_ = false;
  if (made && on()) made_.add(*fired_at_);
}

void Preview::end() {
  until_.reset();
  made_ = {};  // so that the pause before the next preview does not count for the rate
}

}  // namespace sonar
