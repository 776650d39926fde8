#include "clients/sonarctl/view_caption.hpp"

#include <algorithm>

#include "core/text/format.hpp"

namespace sonar::clients {

void ViewCaption::add(const HostPing& ping, const std::optional<protocol::Host::Counts>& of_wire, Seconds at) {
  if (of_wire) missed_ = of_wire->missing_pings;
  arrivals_.push_back(at);
  if (arrivals_.size() > remembered) arrivals_.pop_front();
  ++pings_;
  const protocol::PingFacts& f = ping.facts;
  ping_text_ =
      text::format("ping %u  %.2f m  %.4g MHz  %u beams x %u rows", f.number, f.range_m, f.frequency_hz / 1e6, f.beams, f.rows);
}

std::string ViewCaption::text() const {
  std::string text = ping_text_;
  if (arrivals_.size() < 2) return text;
  const double rate_hz = static_cast<double>(arrivals_.size() - 1) / std::max(1e-9, arrivals_.back() - arrivals_.front());
  text += text::format("  %.1f ", rate_hz) + rate_unit_;
  if (!missed_) return text;
  return text + (*missed_ == 0 ? "  no gaps" : "  " + std::to_string(*missed_) + " missed");
}

}  // namespace sonar::clients
