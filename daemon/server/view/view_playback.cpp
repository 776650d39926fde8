// Viewers of a vehicle's trajectory (?playback=NAME), which is shown like a recording: stamps are times of the trajectory, and
// viewers may play, pause and seek.
#include <algorithm>

#include "daemon/server/view/view_feed.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {

/// Returns null if the vehicle does not follow a trajectory.
const motion::Playback* ViewFeed::playback_of(const std::string& vehicle) const {
  const auto& vehicles = of_.config.vehicles;
  const auto found = std::find_if(vehicles.begin(), vehicles.end(), [&](const VehicleConfig& v) { return v.name == vehicle; });
  if (found == vehicles.end()) return nullptr;
  const auto played = of_.world.vehicle_plays(static_cast<std::size_t>(found - vehicles.begin()));
  return played ? &played->playback : nullptr;
}

/// Begins the playback that the viewer's URL requests. Returns the reason if that fails, else an empty text.
std::string ViewFeed::begin_playback(Viewer& viewer, const std::string& vehicle) {
  if (vehicle.empty()) return {};
  const motion::Playback* const playback = playback_of(vehicle);
  if (playback == nullptr) return "playback: no vehicle " + vehicle.substr(0, 64) + " follows a trajectory";
  watch_playback();
  watches_.try_emplace(vehicle, *playback, of_.clock.now());
  viewer.play(vehicle);
  return {};
}

/// Sends the changed state to all viewers except `but`.
void ViewFeed::watch_playback(const Viewer* but) {
  const Time now = of_.clock.now();
  for (auto it = watches_.begin(); it != watches_.end();) {
    const std::string& vehicle = it->first;
    PlaybackWatch& watch = it->second;
    const auto news = watch.look(playback_of(vehicle), now);
    bool is_watched = false;
    each([&](ViewConnection& c) {
      Viewer& viewer = c.viewer();
      if (viewer.playback() != vehicle) return;
      is_watched = true;
      if (news && &viewer != but) viewer.say_frame(foxglove::playback_frame(*news));
      viewer.set_time(watch.stamp(now));
      c.wake();
    });
    it = is_watched ? std::next(it) : watches_.erase(it);
  }
}

/// Converts the request to an operation of control; after a refusal, the viewer gets a status.
bool ViewFeed::steer_playback(Viewer& viewer, const foxglove::PlaybackControl& asked) {
  auto watch = watches_.find(viewer.playback());
  if (watch == watches_.end()) return false;
  std::string why = viewer.may_steer() ? "" : Viewer::read_only;
  if (why.empty()) {
    control::SetTrajectory op;
    op.of = control::PoseSample::Of::vehicle;
    op.name = viewer.playback();
    op.paused = asked.pause;
    op.speed = static_cast<double>(asked.speed);
    if (asked.seeks) op.position_s = seconds(std::clamp(asked.to, Time{}, watch->second.end()).time_since_epoch());
    why = perform_at_once(op, viewer);
  }
  if (!why.empty()) viewer.send_status(foxglove::StatusLevel::error, why);
  watch_playback(&viewer);
  watch = watches_.find(viewer.playback());  // may be missing, because watches without viewers are removed
  if (watch == watches_.end()) return false;
  foxglove::PlaybackState state = watch->second.state(of_.clock.now());
  state.did_seek = asked.seeks && why.empty();
  state.request = asked.request;
  viewer.say_frame(foxglove::playback_frame(state));
  return true;
}

/// Returns the payload with stamps in the time of the viewer's trajectory.
ViewPayloadPointer ViewFeed::in_time_of(const Viewer& viewer, std::uint32_t channel, const ViewPayloadPointer& payload) const {
  const auto watch = watches_.find(viewer.playback());
  if (watch == watches_.end()) return payload;
  const auto stamp = [&](Time at) { return watch->second.stamp(at); };
  ViewPayload other{stamp(payload->at), {}, payload->merges};
  wire::Bytes whole;
  for (const ViewPayload::Piece& piece : payload->pieces) {
    whole.insert(whole.end(), piece.bytes->begin(), piece.bytes->end());
    if (!payload->merges && &piece != &payload->pieces.back()) continue;
    auto stamped = foxglove::with_stamps(channels_.at(channel).advertised, whole, stamp);
    other.pieces.push_back({piece.key, std::make_shared<const wire::Bytes>(std::move(stamped))});
    whole.clear();
  }
  return std::make_shared<const ViewPayload>(std::move(other));
}

}  // namespace sonar
