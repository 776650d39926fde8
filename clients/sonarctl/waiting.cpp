#include "clients/sonarctl/waiting.hpp"

#include <algorithm>
#include <cstdio>

#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

constexpr double said_every_s = 2;

double seconds_between(PictureProgress::Clock::time_point from, PictureProgress::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

FirstPingWait::FirstPingWait(const SourceOptions& source, const PingStream& stream, bool observes, bool is_limited,
                             Clock::time_point now)
    : due_(now + moment) {
  const bool asks = !observes && (!source.wanted.as_it_is || stream.make().each_ping_requested);
  line_ = "connected to " + stream.about() + (asks ? "; requested pings" : "; nothing requested") +
          "; waiting for the first one" + (observes && !is_limited ? "" : text::format(", at most %g s", source.silence_limit_s));
}

std::chrono::milliseconds FirstPingWait::patience(std::chrono::milliseconds most, Clock::time_point now) const {
  if (line_.empty()) return most;
  return std::min(most, std::max(std::chrono::milliseconds(0), std::chrono::ceil<std::chrono::milliseconds>(due_ - now)));
}

void FirstPingWait::look(bool has_ping, Clock::time_point now) {
  if (line_.empty() || (!has_ping && now < due_)) return;
  if (!has_ping) std::fprintf(stderr, "sonarctl: %s\n", line_.c_str());
  line_.clear();
}

std::optional<std::string> PictureProgress::line_at(const HostPing& ping, Clock::time_point now) {
  const std::string have = text::format("the picture has %zu of %zu scan lines", ping.lines, ping.whole_lines);
  if (!begin_) {
    begin_ = said_ = now;
    first_lines_ = ping.lines;
    return have + text::format("; it is used when it is complete, or incomplete after %g s or Ctrl-C", limit_s_);
  }
  if (seconds_between(said_, now) < said_every_s) return std::nullopt;
  said_ = now;
  const double past_s = seconds_between(*begin_, now);
  const double grown = static_cast<double>(ping.lines) - static_cast<double>(first_lines_);
  const double whole_s = grown > 0 ? static_cast<double>(ping.whole_lines - ping.lines) * past_s / grown : limit_s_;
  return have + text::format("; %.0f s more", std::ceil(std::clamp(whole_s, 1.0, std::max(1.0, limit_s_ - past_s))));
}

bool PictureProgress::is_over(Clock::time_point now) const { return seconds_between(begin_.value_or(now), now) >= limit_s_; }

}  // namespace sonar::clients
