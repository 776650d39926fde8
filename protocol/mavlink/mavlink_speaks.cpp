// What MavlinkPoses says: heartbeats and requests to the autopilot, and one sentence to the user about whom it found.
#include <algorithm>
#include <cmath>

#include "protocol/mavlink/mavlink_poses.hpp"

namespace sonar::mavlink {
namespace {

constexpr std::chrono::nanoseconds heartbeat_period = std::chrono::seconds(1);
constexpr std::chrono::nanoseconds listen_before_report = std::chrono::seconds(1);
constexpr std::chrono::nanoseconds request_period = std::chrono::seconds(5);

// Values of minimal.xml and common.xml.
constexpr std::uint8_t onboard_controller = 18, state_active = 4;
constexpr std::uint16_t set_message_interval = 511;
constexpr std::uint8_t ardupilot = 3, px4 = 12;

std::string name_of_autopilot(std::uint8_t autopilot) {
  if (autopilot == ardupilot) return "ArduPilot";
  if (autopilot == px4) return "PX4";
  return "autopilot type " + std::to_string(autopilot);
}

}  // namespace

Reaction MavlinkPoses::on_tick(Time now) {
  Reaction out;
  if (now >= next_heartbeat_) {
    const bool in_step = now - next_heartbeat_ < heartbeat_period;
    next_heartbeat_ = (in_step ? next_heartbeat_ : now) + heartbeat_period;
    Heartbeat beat;
    beat.type = onboard_controller;
    beat.autopilot = Heartbeat::no_autopilot;
    beat.system_status = state_active;
    out.replies.push_back(framed(beat, us_));
  }
  if (!system_) return out;
  if (!reported_ && now - found_at_ >= listen_before_report) {
    reported_ = true;
    out.notices.push_back(report());
  }
  const auto since = [now](const std::optional<Time>& at) { return at && now - *at <= system_silence; };
  const bool has_poses = std::any_of(yielded_.begin(), yielded_.end(), since);
  if (settings_.request_rates && has_autopilot_ && now >= next_request_) {
    if (!has_poses) request_messages(out);
    next_request_ = now + request_period;
  }
  return out;
}

void MavlinkPoses::request_messages(Reaction& out) {
  const auto ask = [&](std::uint32_t message, double rate_hz) {
    CommandLong command;
    command.param1 = static_cast<float>(message);
    command.param2 = static_cast<float>(1e6 / rate_hz);  // us
    command.command = set_message_interval;
    command.target_system = *system_;
    command.target_component = autopilot_component_;
    out.replies.push_back(framed(command, us_));
  };
  for (const std::uint32_t message : {Odometry::id, AttitudeQuaternion::id, LocalPositionNed::id})
    ask(message, settings_.rate_hz);
  if (!settings_.origin) return;
  for (const std::uint32_t message : {SimState::id, GlobalPositionInt::id}) ask(message, settings_.rate_hz);
  ask(GpsGlobalOrigin::id, 1);
}

/// "system 1 (ArduPilot) sends HEARTBEAT, ATTITUDE; no poses yet: ..."
std::string MavlinkPoses::report() const {
  std::string text = "system " + std::to_string(*system_);
  if (has_autopilot_) text += " (" + name_of_autopilot(autopilot_) + ")";
  text += " sends ";
  bool first = true;
  for (const auto& [id, heard] : heard_) {
    text.append(first ? "" : ", ").append(find_message(id)->name);
    first = false;
  }
  for (std::size_t s = 0; s < source_count; ++s) {
    if (!yielded_[s]) continue;
    text += std::string("; poses from ").append(name_of(static_cast<Source>(s)));
    const bool coarse = static_cast<Source>(s) == Source::sim_state && sim_state_is_coarse_;
    if (coarse) text += ", in steps of up to 0.4 m: lat_int and lon_int need MAVLink 2";
    return text;
  }
  return text + "; no poses yet: " + what_is_missing();
}

std::string MavlinkPoses::what_is_missing() const {
  const bool attitude = hears(Attitude::id) || hears(AttitudeQuaternion::id);
  const bool local = hears(LocalPositionNed::id), global = hears(GlobalPositionInt::id);
  std::vector<std::string> lacks;
  for (const std::uint32_t geodetic : {GlobalPositionInt::id, SimState::id})
    if (hears(geodetic) && !(geodetic == GlobalPositionInt::id && local)) {
      const std::string name(find_message(geodetic)->name);
      lacks.push_back(name + (settings_.origin ? " has no fix" : " needs world.origin"));
    }
  if ((local || global) && !attitude) lacks.emplace_back("a position needs ATTITUDE or ATTITUDE_QUATERNION beside it");
  if (attitude && !local && !global)
    lacks.push_back(std::string("an attitude needs LOCAL_POSITION_NED") + (settings_.origin ? " or GLOBAL_POSITION_INT" : "") +
                    " beside it");
  const bool whole = hears(Odometry::id) || hears(AttPosMocap::id) || hears(VisionPositionEstimate::id);
  if (lacks.empty() && whole) lacks.emplace_back("what came was refused");
  if (lacks.empty() && attitude) lacks.emplace_back("positions and attitudes are never of the same time");
  if (lacks.empty())
    lacks.push_back(settings_.request_rates ? "it was asked for ODOMETRY, ATTITUDE_QUATERNION and LOCAL_POSITION_NED"
                                            : "set its stream rates, or request_rates: true");
  std::string text;
  for (const std::string& l : lacks) text.append(text.empty() ? "" : "; ").append(l);
  return text;
}

}  // namespace sonar::mavlink
