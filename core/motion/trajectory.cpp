#include "core/motion/trajectory.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/base/units.hpp"

namespace sonar::motion {

Trajectory::Trajectory(Points points, Ns duration)
    : points_(std::move(points)), duration_(std::max(duration, points_.times.back())) {
  assert(points_.poses.size() == points_.times.size());
  assert(points_.velocities_mps.empty() || points_.velocities_mps.size() == points_.times.size());
  assert(points_.angular_velocities_radps.empty() || points_.angular_velocities_radps.size() == points_.times.size());
}

/// Motion in the interval that ends at point `after`, at fraction u of the interval.
Motion Trajectory::between(std::size_t after, double u) const {
  const std::size_t before = after - 1;
  // The times of points increase, so there is no division by 0 s.
  const double per_s = 1 / seconds(points_.times[after] - points_.times[before]);
  const Pose &a = points_.poses[before], &b = points_.poses[after];
  const auto interpolated = [&](const std::vector<Vec3d>& values) {
    return values[before] + u * (values[after] - values[before]);
  };
  Motion moves;
  // If the file has no velocities, these are the mean velocities of the interval: world axes [m/s], body axes [rad/s].
  moves.velocity_mps =
      points_.velocities_mps.empty() ? per_s * (b.position_m - a.position_m) : interpolated(points_.velocities_mps);
  moves.angular_velocity_radps = points_.angular_velocities_radps.empty() ? per_s * rotation_between(a.orientation, b.orientation)
                                                                          : interpolated(points_.angular_velocities_radps);
  return moves;
}

Moment Trajectory::at(Ns time) const {
  const std::vector<Ns>& times = points_.times;
  // Before the first point and after the last one the body rests at the pose of that point.
  if (time < times.front()) return {points_.poses.front(), {}};
  if (time > times.back() || times.size() == 1) return {points_.poses.back(), {}};
  if (time == times.back()) return {points_.poses.back(), between(times.size() - 1, 1)};
  // The first point later than `time`. The current interval ends at this point.
  const auto after = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
  const Pose &a = points_.poses[after - 1], &b = points_.poses[after];
  // Fraction of the interval, in [0, 1); differences of whole nanoseconds are exact.
  const double u =
      static_cast<double>((time - times[after - 1]).count()) / static_cast<double>((times[after] - times[after - 1]).count());
  const Motion moves = between(after, u);
  // At the time of a point the pose is exactly the pose of the point.
  if (u == 0) return {a, moves};
  return {{a.position_m + u * (b.position_m - a.position_m), slerp(a.orientation, b.orientation, u)}, moves};
}

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
