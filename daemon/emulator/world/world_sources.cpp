// Plays the trajectories of bodies: computes their poses, and handles requests to pause, seek and change the speed.

#include <algorithm>
#include <cmath>

#include "daemon/emulator/world/world.hpp"

namespace sonar {

motion::Moment World::played(const Track& track, Time t) {
  const motion::Playback::Place place = track.playback.place(t);
  motion::Moment moment = track.body.plan.trajectory->at(place.at);
  moment.moves.velocity_mps = place.rate * moment.moves.velocity_mps;
  moment.moves.angular_velocity_radps = place.rate * moment.moves.angular_velocity_radps;
  return moment;
}

/// Checks everything before anything changes.
std::string World::steer(const control::SetTrajectory& asked, Time now) {
  std::string refusal;
  Track* const track = find(asked.of, asked.name, refusal);
  if (track == nullptr) return refusal;
  const std::string& name = track->body.name;
  if (!track->body.plan) return name + " follows no trajectory; the configuration gives it one (docs/poses.md)";
  if (!track->history.empty())
    return name + " is moved by poses from " + track->source + "; its trajectory plays only until the first of them";
  if (!asked.paused && !asked.position_s && !asked.speed) return "give at least one of: paused, position_s or speed";
  motion::Playback& playback = track->playback;
  const double length_s = seconds(playback.duration());
  if (asked.position_s && !(*asked.position_s >= 0 && *asked.position_s <= length_s))
    return "position_s must be from 0 to " + std::to_string(length_s) + ", the length of the trajectory of " + name;
  std::optional<motion::Speed> speed;
  if (asked.speed && !(speed = motion::Speed::from(*asked.speed)))
    return "speed must be from 0.001 to 1000; to stand still, pause";

  if (asked.position_s) playback.seek(now, nanoseconds_from(*asked.position_s));
  if (speed) playback.use_speed(now, *speed);
  if (asked.paused && *asked.paused != playback.paused()) *asked.paused ? playback.pause(now) : playback.resume(now);
  return {};
}

// The functions below are for time that follows the stamps of the vehicles' poses (`clock: follow`). They convert stamps to our
// time, and determine how far time may advance.

namespace {
__extension__ using Wide = __int128;  // the difference between a sender's stamp and our time may exceed 64 bits
Wide wide(Time t) { return t.time_since_epoch().count(); }
}  // namespace

bool World::is_followed(const Track& track, Time newest) const {
  return !track.history.empty() && track.history.newest().at + track.offset >= newest - rules_.stale_after;
}

/// Returns the offset from the stamps of a sender to sonard's time. The candidates are the vehicle's present offset, 0, and the
/// offsets of other vehicles; the first one that places the stamp near the newest stamp is used. If none does, this is the first
/// pose, or the sender's clock has jumped. In this case, if the stamp is ahead and no other vehicle is followed, sonard's time
/// jumps to the stamp; otherwise the stamp counts as the present time.
World::Ns World::followed_offset_for(const Track& track, Time at, Time now) {
  const Time newest = newest_followed_.value_or(now);
  const bool vehicle = std::any_of(vehicles_.begin(), vehicles_.end(), [&](const Track& t) { return &t == &track; });
  const auto take = [&](Ns offset) {
    if (vehicle) newest_followed_ = std::max(newest, at + offset);
    return offset;
  };
  const auto lead = [&](Ns offset) { return wide(at) + offset.count() - wide(newest); };
  const auto is_near = [&](Ns offset) {
    const Wide by = lead(offset);
    return (by < 0 ? -by : by) <= rules_.stale_after.count();
  };
  if (!vehicle || newest_followed_) {  // time begins with the first pose, even if its stamp is close to 0
    if (is_near(track.offset)) return take(track.offset);
    if (is_near(Ns{0})) return take(Ns{0});
    for (const Track& other : vehicles_)
      if (!other.history.empty() && is_near(other.offset)) return take(other.offset);
  }

  const bool alone = std::none_of(vehicles_.begin(), vehicles_.end(),
                                  [&](const Track& other) { return &other != &track && is_followed(other, newest); });
  if (const Wide ahead = lead(track.offset); vehicle && alone && ahead > 0 && wide(newest) + ahead <= control::largest_stamp_ns) {
    skipped_ += Ns(static_cast<std::int64_t>(ahead));
    return take(track.offset);
  }
  return take(newest - at);
}

std::optional<Time> World::followed_until() const {
  if (!newest_followed_) return std::nullopt;
  // The slowest vehicle limits time, except vehicles whose poses are older than stale_after.
  Time least = *newest_followed_;
  for (const Track& t : vehicles_)
    if (is_followed(t, *newest_followed_)) least = std::min(least, t.history.newest().at + t.offset);
  return least;
}

World::Ns World::take_skipped() {
  const Ns skipped = std::exchange(skipped_, Ns{0});
  // Nothing moves during the skipped time: orbits are delayed, received poses of objects keep their age, and trajectories stop.
  start_ += skipped;
  for (Track& t : objects_)
    if (!t.history.empty()) t.offset += skipped;
  for (std::vector<Track>* tracks : {&vehicles_, &objects_})
    for (Track& t : *tracks) t.playback.skip(skipped);
  return skipped;
}

}  // namespace sonar
