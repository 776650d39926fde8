// Trajectories of bodies that the World plays: their poses, and requests to pause, seek and change the speed.
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

/// Everything is checked before anything changes.
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

}  // namespace sonar
