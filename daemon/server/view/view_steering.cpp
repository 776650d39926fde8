// Carries out requests of viewers (parameters and services) as requests of control.

#include <algorithm>
#include <array>
#include <utility>

#include "daemon/server/http/operation_answer.hpp"
#include "daemon/server/view/view_feed.hpp"
#include "protocol/control/control.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {
namespace {

/// Returns the name of the viewer in the log.
Sender sender_of(const Viewer& viewer) { return {"live view " + viewer.who(), viewer.who()}; }

/// A row for every POST of the HTTP API: the name in the API, the name in Request.op, and the message. Ids count from 1.
struct ServiceRow {
  const char *name, *op, *type;
};
constexpr std::array<ServiceRow, 14> service_table{{{"set_sonar", "sonar", "SetSonar"},
                                                    {"set_environment", "environment", "SetEnvironment"},
                                                    {"load", "load", "LoadScene"},
                                                    {"pose", "pose", "PoseUpdate"},
                                                    {"object", "object", "ObjectUpdate"},
                                                    {"add_object", "add_object", "AddObject"},
                                                    {"remove_object", "remove_object", "RemoveObject"},
                                                    {"set_object", "set_object", "SetObject"},
                                                    {"set_trajectory", "set_trajectory", "SetTrajectory"},
                                                    {"step", "step", "Step"},
                                                    {"start_recording", "start_recording", "StartRecording"},
                                                    {"stop_recording", "stop_recording", "StopRecording"},
                                                    {"add_fault", "add_fault", "Fault"},
                                                    {"end_faults", "end_faults", "EndFaults"}}};

}  // namespace

std::string ViewFeed::server_info(const Viewer& viewer) const {
  foxglove::ServerInfo info;
  info.name = "sonard " SONARD_VERSION;
  info.capabilities = {"parameters", "parametersSubscribe", "services"};
  const auto watch = watches_.find(viewer.playback());
  if (of_.clock.stepped() || watch != watches_.end()) info.capabilities.emplace_back("time");
  if (watch != watches_.end()) {
    info.capabilities.emplace_back("playbackControl");
    info.data = {Time{}, watch->second.end()};
  }
  info.metadata = {{"sonard.version", SONARD_VERSION},
                   {"sonard.config", of_.config.source},
                   {"sonard.scene", of_.config.scene.name()},
                   {"sonard.clock", std::string(name_of(of_.config.clock))},
                   {"sonard.previews", of_.config.previews ? "true" : "false"},
                   {"sonard.may_steer", viewer.may_steer() ? "true" : "false"}};
  for (const Device& device : of_.fleet.devices()) {
    const SonarModel& model = *device.config().profile.model;
    info.metadata["sonard.product." + model.profile] = model.name;
    std::string& modes = info.metadata["sonard.modes." + device.config().name];
    for (const FrequencyMode& mode : model.modes) modes += (modes.empty() ? "" : "\n") + mode.name;
  }
  info.session = session_;
  return foxglove::text_of(info);
}

std::string ViewFeed::services_word() {
  std::vector<foxglove::Service> services;
  for (const ServiceRow& row : service_table)
    services.push_back({static_cast<std::uint32_t>(services.size() + 1), std::string("/sonard/") + row.name,
                        std::string("sonar.v1.") + row.type});
  return foxglove::advertise_services(services);
}

ParameterSource ViewFeed::source() const { return {of_.config, of_.clock, of_.world, of_.fleet}; }

std::vector<foxglove::Parameter> ViewFeed::parameters(const Viewer& viewer, const std::vector<std::string>& names) {
  std::vector<foxglove::Parameter> all = parameters_of(source());
  for (const SonarView& sonar : sonars_) all.push_back({sonar.points.threshold, threshold_of(viewer, sonar.points)});
  if (!names.empty())
    std::erase_if(all,
                  [&](const foxglove::Parameter& p) { return std::find(names.begin(), names.end(), p.name) == names.end(); });
  return all;
}

/// Sets a parameter of the view. Returns the reason if it was not set, else an empty text; nullopt for a parameter of control.
std::optional<std::string> ViewFeed::set_own(Viewer& viewer, const foxglove::Parameter& wanted) {
  for (SonarView& sonar : sonars_) {
    if (wanted.name != sonar.points.threshold) continue;
    const auto part = number_of(wanted.value);
    if (!part || !(*part >= 0 && *part <= 1)) return "must be a number from 0 to 1";
    viewer.choose(wanted.name, *part);
    begin_slow_ones(sonar);
    return "";
  }
  for (Device& device : of_.fleet.devices()) {
    if (wanted.name != "/" + device.config().name + "/preview") continue;
    const bool* const on = std::get_if<bool>(&wanted.value);
    if (of_.clock.stepped()) return "a preview needs clock: realtime";
    return on == nullptr ? "must be true or false" : set_preview(viewer, device, *on);
  }
  return std::nullopt;
}

std::string ViewFeed::set_parameter(Viewer& viewer, const foxglove::Parameter& wanted) {
  if (auto own = set_own(viewer, wanted)) return *std::move(own);
  const auto operation = operation_of(wanted, source());
  if (!operation) return operation.error().text;
  return perform_at_once(*operation, viewer);
}

/// Returns the reason if the operation was not done, else an empty text.
std::string ViewFeed::perform_at_once(const control::Operation& operation, const Viewer& viewer) {
  const auto why = std::make_shared<std::string>();
  of_.operations.perform(operation, sender_of(viewer), [why](const OperationResult& result) {
    if (result.code != OperationResult::Code::done) *why = result.text;
  });
  changed_ = true;
  return *why;
}

/// Sends the parameters that have changed since the last call to the viewers that watch them.
void ViewFeed::push_parameters() {
  bool watched = false;
  each([&](const ViewConnection& c) { watched = watched || c.viewer().watches_parameters(); });
  if (!watched) return;
  std::vector<foxglove::Parameter> now = parameters_of(source()), changed;
  std::erase_if(now, [](const foxglove::Parameter& p) { return p.name == "/clock/now_s"; });
  for (const foxglove::Parameter& p : now)
    if (std::find(pushed_.begin(), pushed_.end(), p) == pushed_.end()) changed.push_back(p);
  pushed_ = std::move(now);
  if (changed.empty()) return;
  each([&](ViewConnection& c) {
    c.viewer().on_parameters(changed);
    c.wake();
  });
}

/// Performs a call. The answer may arrive after the viewer has left, so only a weak pointer to the viewer is kept.
void ViewFeed::call(Viewer& viewer, const foxglove::ServiceCall& call) {
  if (call.service == 0 || call.service > service_table.size()) return viewer.fail(call, "there is no such service");
  auto request = control::request_from_json(service_table[call.service - 1].op, call.payload);
  if (!request) return viewer.fail(call, request.error().text);
  std::visit(
      [&, from = connection_of(viewer)](auto operation) {
        if constexpr (std::is_constructible_v<control::Operation, decltype(operation)>) {
          const auto done = [from, call](const OperationResult& result) {
            const auto connection = from.lock();
            if (!connection) return;
            if (result.code == OperationResult::Code::done)
              connection->viewer().answer({call.service, call.call, "json", answer_from(result).body});
            else
              connection->viewer().fail(call, result.text);
            connection->wake();
          };
          const auto has_left = [from] {
            const auto connection = from.lock();
            return !connection || connection->over();
          };
          of_.operations.perform(std::move(operation), sender_of(viewer), done, has_left);
        }
      },
      std::move(request->op));
}

// Viewers of a vehicle's trajectory (?playback=NAME), which is shown like a recording: stamps are times of the trajectory, and
// viewers may play, pause and seek.

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
