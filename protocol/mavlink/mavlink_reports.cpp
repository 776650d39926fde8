// The messages and reports that MavlinkPoses makes: heartbeats, requests to the autopilot, reports on the system that was found
// and on missing parts of poses.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "protocol/mavlink/mavlink_poses.hpp"

namespace sonar::mavlink {
namespace {

constexpr std::chrono::nanoseconds heartbeat_period = std::chrono::seconds(1);
constexpr std::chrono::nanoseconds listen_before_report = std::chrono::seconds(1);   // time after a system was found
constexpr std::chrono::nanoseconds silence_before_report = std::chrono::seconds(5);  // time after the start, without a system
constexpr std::chrono::nanoseconds request_period = std::chrono::seconds(5);
constexpr std::chrono::nanoseconds first_reminder = std::chrono::seconds(15), longest_reminder = std::chrono::minutes(10);

// Values of minimal.xml and common.xml.
constexpr std::uint8_t onboard_controller = 18, state_active = 4;
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
    // After a late call, heartbeats keep their rhythm. After a longer pause, missed heartbeats are not sent.
    const bool in_step = now - next_heartbeat_ < heartbeat_period;
    next_heartbeat_ = (in_step ? next_heartbeat_ : now) + heartbeat_period;
    Heartbeat beat;
    beat.type = onboard_controller;
    beat.autopilot = Heartbeat::no_autopilot;
    beat.system_status = state_active;
    out.replies.push_back(framed(beat, self_));
  }
  report_changes(now, out);
  if (system_ && settings_.request_rates && has_autopilot_ && now >= next_request_) {
    if (!has_poses(now)) request_messages(out);
    next_request_ = now + request_period;
  }
  return out;
}

bool MavlinkPoses::has_poses(Time now) const {
  return std::any_of(last_pose_.begin(), last_pose_.end(),
                     [now](const std::optional<Time>& at) { return at && now - *at <= system_silence; });
}

/// Reports when poses start or stop. Without poses it repeats the report at growing intervals, so that the end of the log always
/// states what is missing.
void MavlinkPoses::report_changes(Time now, Reaction& out) {
  if (!first_tick_) first_tick_ = now;
  if (has_other_poses_()) return;
  if (system_ ? now - found_at_ < listen_before_report : now - *first_tick_ < silence_before_report) return;
  const bool arriving = has_poses(now);
  const bool is_change = reported_ != arriving;
  if (!is_change && (arriving || now < next_reminder_)) return;
  reminder_period_ = is_change ? first_reminder : std::min(2 * reminder_period_, longest_reminder);
  next_reminder_ = now + reminder_period_;
  reported_ = arriving;
  out.notices.push_back(report(now));
}

std::string MavlinkPoses::health_error(Time now) const {
  return has_poses(now) || has_other_poses_() ? std::string() : report(now);
}

void MavlinkPoses::request_messages(Reaction& out) {
  const auto ask = [&](std::uint32_t message, double rate_hz) {
    CommandLong command;
    command.param1 = static_cast<float>(message);
    command.param2 = static_cast<float>(1e6 / rate_hz);  // us
    command.command = CommandLong::set_message_interval;
    command.target_system = *system_;
    command.target_component = autopilot_component_;
    out.replies.push_back(framed(command, self_));
  };
  for (const std::uint32_t message : {Odometry::id, AttitudeQuaternion::id, LocalPositionNed::id})
    ask(message, settings_.rate_hz);
  ask(GlobalPositionInt::id, settings_.rate_hz);  // has a position, or only the depth
  if (!settings_.origin) return;
  ask(SimState::id, settings_.rate_hz);
  ask(GpsGlobalOrigin::id, 1);
}

bool MavlinkPoses::contains_pose(std::uint32_t id) {
  return id != Heartbeat::id && id != SystemTime::id && id != GpsGlobalOrigin::id;
}

bool MavlinkPoses::identifies_vehicle(const Frame& frame) {
  return frame.id == Heartbeat::id ? message_in<Heartbeat>(frame).autopilot != Heartbeat::no_autopilot : contains_pose(frame.id);
}

void MavlinkPoses::note_ignored(const Frame& frame, Moment at) {
  if (frame.component == own_component) return;
  ignored_ = {frame.system, frame.component};
  if (system_ && !is_excluded(frame) && identifies_vehicle(frame)) report_ignored(frame, at);
}

/// Reports each ignored system and component once, because two vehicles at one port are a mistake that is not visible otherwise.
/// If too many have been reported, the one that has been silent longest leaves its place.
void MavlinkPoses::report_ignored(const Frame& frame, Moment at) {
  const std::pair<int, int> sender(frame.system, frame.component);
  const auto reported = reported_ignored_.find(sender);
  const bool is_new = reported == reported_ignored_.end();
  if (is_new && reported_ignored_.size() >= most_reported) {
    const auto oldest = std::min_element(reported_ignored_.begin(), reported_ignored_.end(),
                                         [](const auto& a, const auto& b) { return a.second.last < b.second.last; });
    if (at.now - oldest->second.last < forgotten_after) return;
    reported_ignored_.erase(oldest);
  }
  if (frame.system != *system_) rival_ = sender;
  if (!is_new) {
    reported->second.last = at.now;
    return;
  }
  const auto name_of = [](int system, int component) {
    return "system " + std::to_string(system) + ", component " + std::to_string(component);
  };
  const auto known = received_.find(frame.id);
  const int steering = frame.system == *system_ && known != received_.end() ? known->second.component : autopilot_component_;
  const std::string text = name_of(frame.system, frame.component) + " sends " + std::string(find_message(frame.id)->name) +
                           " and is ignored: " + name_of(*system_, steering) + " steers " + settings_.vehicle +
                           (frame.system == *system_ ? "; component_id selects another"
                                                     : "; give each vehicle a port of its own, or select one by system_id");
  reported_ignored_.emplace(sender, Ignored{text, at.now});
  at.out.notices.push_back(text);
}

std::string MavlinkPoses::rival(Time now) const {
  const auto report = reported_ignored_.find(rival_);
  return report != reported_ignored_.end() && now - report->second.last <= system_silence ? report->second.text : std::string();
}

/// Returns the reason why x and y do not change, and the messages that would change them.
std::string MavlinkPoses::held_text() const {
  std::string why = " has no fix, and there is no LOCAL_POSITION_NED: no DVL or the like";
  if (depth_ && depth_->message == VfrHud::id)
    why = " and LOCAL_POSITION_NED are missing";
  else if (global_has_fix_)
    why = " needs world.origin";
  std::array<char, 64> held{};
  std::snprintf(held.data(), held.size(), "; x and y are held at %.6g, %.6g: ", settings_.held_m.x, settings_.held_m.y);
  return held.data() + std::string(GlobalPositionInt::name) + why;
}

/// Returns a text such as "system 1 (ArduPilot) sends HEARTBEAT, ATTITUDE; no poses yet: ...".
std::string MavlinkPoses::report(Time now) const {
  if (!system_) {
    if (!ignored_) return "no poses yet: no message received; check that the autopilot or its router sends here";
    const std::string who = "system " + std::to_string(ignored_->first) + ", component " + std::to_string(ignored_->second);
    const bool filtered = settings_.system_id != 0 || settings_.component_id != 0;
    return "no poses yet: " + who + " sends messages, but " +
           (filtered ? "does not match system_id and component_id" : "neither an autopilot's heartbeat nor a pose");
  }
  std::string text = "system " + std::to_string(*system_);
  if (has_autopilot_) text += " (" + name_of_autopilot(autopilot_) + ")";
  if (const auto silent = now - last_received_; silent > system_silence)
    return text + " has sent nothing for " + std::to_string(std::chrono::duration_cast<std::chrono::seconds>(silent).count()) +
           " s: no poses";
  text += " sends ";
  bool first = true;
  for (const auto& [id, arrival] : received_) {
    if (!receives(id, now)) continue;
    text.append(first ? "" : ", ").append(find_message(id)->name);
    first = false;
  }
  for (std::size_t s = 0; s < source_count; ++s) {
    if (!last_pose_[s] || now - *last_pose_[s] > system_silence) continue;
    text += std::string("; poses from ").append(name_of(static_cast<Source>(s)));
    const bool coarse = static_cast<Source>(s) == Source::sim_state && sim_state_is_coarse_;
    if (coarse) text += ", in steps of up to 0.4 m: lat_int and lon_int need MAVLink 2";
    if (static_cast<Source>(s) == Source::depth) text += held_text();
    return text;
  }
  const bool had_poses = std::any_of(last_pose_.begin(), last_pose_.end(), [](const auto& at) { return at.has_value(); });
  return text + (had_poses ? "; no more poses: " : "; no poses yet: ") + missing_inputs(now);
}

std::string MavlinkPoses::missing_inputs(Time now) const {
  const bool attitude = receives(Attitude::id, now) || receives(AttitudeQuaternion::id, now);
  const bool local = receives(LocalPositionNed::id, now), global = receives(GlobalPositionInt::id, now);
  const bool sim_state = receives(SimState::id, now);
  std::vector<std::string> missing;
  const auto note_missing_fix = [&](std::uint32_t id, bool has_fix) {
    const std::string name(find_message(id)->name);
    if (!settings_.origin || !has_fix) missing.push_back(name + (settings_.origin ? " has no fix" : " needs world.origin"));
  };
  if (global && !local) note_missing_fix(GlobalPositionInt::id, global_has_fix_);
  if (sim_state) note_missing_fix(SimState::id, sim_state_has_fix_);
  for (const Source source : {Source::odometry, Source::sim_state, Source::mocap, Source::vision})
    if (timeless_[static_cast<std::size_t>(source)])
      missing.push_back(std::string(name_of(source)) + " has no time stamp, which clock: follow needs");

  const bool refused = receives(Odometry::id, now) || receives(AttPosMocap::id, now) || receives(VisionPositionEstimate::id, now);
  if (refused && missing.empty()) missing.emplace_back("the received messages were refused");
  if (refused || sim_state) {  // one of these messages would be enough, so nothing more is missing
  } else if (attitude && (local || global)) {
    if (missing.empty()) missing.emplace_back("positions and attitudes have no common time");
  } else {
    if (!attitude) missing.emplace_back("an attitude is missing (ATTITUDE_QUATERNION or ATTITUDE)");
    if (!local && !global)
      missing.push_back(std::string("a position or depth is missing (LOCAL_POSITION_NED; GLOBAL_POSITION_INT") +
                        (settings_.origin ? "" : " with world.origin or depth alone") + "; of a submarine also VFR_HUD)");
    if (!local && !global && receives(VfrHud::id, now))
      missing.emplace_back(
          "VFR_HUD gives a depth only if HEARTBEAT says that the vehicle is a submarine, and after a message with time_boot_ms");
    missing.emplace_back(settings_.request_rates
                             ? "requested (request_rates) but not received"
                             : "set its stream rates (ArduPilot: SR0_POSITION, SR0_EXTRA1), or request_rates: true");
  }
  std::string text;
  for (const std::string& l : missing) text.append(text.empty() ? "" : "; ").append(l);
  return text;
}

}  // namespace sonar::mavlink
