#include "core/motion/playback.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sonar::motion {
namespace {

__extension__ using Wide = __int128;
constexpr std::int64_t one = 1'000'000;  // in millionths

}  // namespace

std::optional<Speed> Speed::from(double factor) {
  // The condition also rejects NaN. Whole millionths make products with nanoseconds exact.
  if (!(factor >= slowest && factor <= fastest)) return std::nullopt;
  return Speed{std::llround(factor * static_cast<double>(one))};
}

bool is_same(const Plan& a, const Plan& b) {
  if (!a || !b) return !a && !b;
  return a.rules == b.rules && (a.trajectory == b.trajectory || *a.trajectory == *b.trajectory);
}

Ns Playback::line(Time clock) const {
  if (paused_) return place_at_;
  // A 64-bit product of nanoseconds and millionths would overflow after 2.5 hours at speed 1.
  const Wide product = static_cast<Wide>((clock - clock_at_).count()) * rules_.speed.millionths;
  Wide passed = product / one;
  if (product % one < 0) --passed;  // rounds down, also before clock_at_
  constexpr auto last_ns = static_cast<Wide>(std::numeric_limits<std::int64_t>::max());
  // The result is limited to 292 years; stamps of a file are smaller.
  return Ns(static_cast<std::int64_t>(std::clamp(place_at_.count() + passed, -last_ns, last_ns)));
}

Playback::Place Playback::place(Time clock) const {
  const Ns reached = line(clock);
  const double rate = paused_ ? 0 : rules_.speed.factor();
  // Before the start the body rests at the first pose.
  if (reached < Ns{0}) return {Ns{0}, 0};
  if (duration_ == Ns{0}) return {Ns{0}, 0};
  // The end of a round is the start of the next one.
  if (rules_.loop) return {reached % duration_, rate};
  return reached > duration_ ? Place{duration_, 0} : Place{reached, rate};
}

void Playback::begin_anew(Time clock) {
  // Later speeds and pauses count from here, so the trajectory time does not jump.
  const Ns reached = line(clock);
  place_at_ = reached < Ns{0} ? reached : place(clock).at;  // a remaining wait is kept
  clock_at_ = clock;
}

void Playback::pause(Time clock) {
  begin_anew(clock);
  paused_ = true;
}

void Playback::resume(Time clock) {
  begin_anew(clock);
  paused_ = false;
}

void Playback::seek(Time clock, Ns to) {
  clock_at_ = clock;
  // The speed and the pause do not change.
  place_at_ = std::clamp(to, Ns{0}, duration_);
}

void Playback::use_speed(Time clock, Speed speed) {
  begin_anew(clock);
  rules_.speed = speed;
}

}  // namespace sonar::motion
