#include "clients/sonarctl/view_caption.hpp"

#include <algorithm>

#include "core/text/format.hpp"

namespace sonar::clients {

void ViewCaption::add(const AnyPing& any, Seconds at) {
  if (const auto* ping = std::get_if<oculus::DecodedPing>(&any)) sequence_.add(*ping), has_sequence_ = true;  // listen tells more
  arrivals_.push_back(at);
  if (arrivals_.size() > remembered) arrivals_.pop_front();
  ++pings_;
  const PingFacts f = facts_of(any);
  ping_text_ =
      text::format("ping %u  %.2f m  %.4g MHz  %u beams x %u rows", f.number, f.range_m, f.frequency_hz / 1e6, f.beams, f.rows);
}

std::string ViewCaption::text() const {
  std::string text = ping_text_;
  if (arrivals_.size() < 2) return text;
  const double rate_hz = static_cast<double>(arrivals_.size() - 1) / std::max(1e-9, arrivals_.back() - arrivals_.front());
  text += text::format("  %.1f Hz", rate_hz);
  if (!has_sequence_) return text;
  const std::uint64_t gaps = sequence_.skipped_ids();
  return text + (gaps == 0 ? "  no gaps" : "  " + std::to_string(gaps) + " missed");
}

}  // namespace sonar::clients
