#include "daemon/emulator/sonar/rate_watch.hpp"

#include <algorithm>

#include "core/text/format.hpp"

namespace sonar {
namespace {

constexpr std::uint64_t ticks_per_group = 40;
constexpr double tolerated_share = 0.1;  // tolerated fraction of skipped ticks

}  // namespace

void RateWatch::begin(std::uint64_t ticks, std::uint64_t busy, double rate_hz) {
  rate_hz_ = rate_hz;
  ticks_before_ = ticks;
  busy_before_ = busy;
  pings_ = 0;
  ping_s_ = longest_s_ = 0;
}

std::optional<std::string> RateWatch::look(std::uint64_t ticks, std::uint64_t busy, double ping_s, double rate_hz,
                                           bool has_others) {
  if (warned_ || !(rate_hz > 0)) return std::nullopt;
  if (to_pass_over_ > 0) --to_pass_over_;
  // The first pings are ignored, and a change of the rate begins a new group of ticks.
  if (to_pass_over_ > 0 || rate_hz != rate_hz_) {
    begin(ticks, busy, rate_hz);
    return std::nullopt;
  }
  ++pings_;
  ping_s_ += ping_s;
  longest_s_ = std::max(longest_s_, ping_s);
  const std::uint64_t passed = ticks - ticks_before_;
  // Ticks are evaluated in groups of 40, so that a single slow ping causes no warning.
  if (passed < ticks_per_group) return std::nullopt;
  const double skipped = static_cast<double>(busy - busy_before_) / static_cast<double>(passed);
  const double mean_s = ping_s_ / pings_, made_hz = rate_hz * (1 - skipped), alone_hz = 1 / std::max(mean_s, 1e-9);
  const double longest_s = longest_s_;
  begin(ticks, busy, rate_hz);
  if (skipped <= tolerated_share) return std::nullopt;
  warned_ = true;
  // If pings on average take less than a period, other sonars or single slow pings caused the delay.
  const bool by_itself = alone_hz < rate_hz;
  const double possible_hz = by_itself ? alone_hz : made_hz;
  const std::string why = by_itself    ? std::string()
                          : has_others ? ", and other sonars are computed in between"
                                       : text::format(", single pings up to %.0f ms", 1e3 * longest_s);
  return text::format(
      "computing takes %.0f ms per ping%s: %.*f Hz at most here, %.3g Hz are requested; ticks are skipped: request "
      "fewer beams, less range or a lower rate, or give more engine.threads",
      1e3 * mean_s, why.c_str(), possible_hz < 10 ? 1 : 0, possible_hz, rate_hz);
}

}  // namespace sonar
