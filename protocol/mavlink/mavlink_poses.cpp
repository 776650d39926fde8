#include "protocol/mavlink/mavlink_poses.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sonar::mavlink {
namespace {

using control::ClockDomain;
using control::RawPose;
using control::Stamp;

constexpr std::int64_t late_ms = 1000;  // largest delay of a packet; a clock that decreases by more has been restarted
constexpr std::int64_t late_ns = late_ms * 1'000'000;
constexpr double farthest_m = 100e3;               // distance from the origin up to which the tangent plane is valid
constexpr double moved_origin_m = 0.01;            // an origin that moves by more causes a jump of the poses
constexpr double highest_hud_m = 1e5;              // keeps the results finite
constexpr std::int64_t longest_sinking_ms = 1000;  // longest time for which the depth is extrapolated with its last speed

std::size_t index_of(Source source) { return static_cast<std::size_t>(source); }

Stamp boot_stamp(std::int64_t at_ms) { return {ClockDomain::sim, at_ms * 1'000'000}; }

/// Returns the parameter of a command as a whole number; nullopt if it has a fraction, is negative, or exceeds 65535.
std::optional<std::uint32_t> whole_number(float value) {
  if (!(value >= 0 && value <= 65535) || value != std::floor(value)) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

std::string fields_of(const RawPose& raw) {
  return std::string("position attitude") + (raw.velocity_mps ? " velocity" : "") + (raw.angular_velocity_radps ? " rates" : "");
}

}  // namespace

std::string_view name_of(Source source) {
  constexpr std::array<std::string_view, source_count> names{"ODOMETRY",
                                                             "SIM_STATE",
                                                             "ATT_POS_MOCAP",
                                                             "VISION_POSITION_ESTIMATE",
                                                             "LOCAL_POSITION_NED and attitude",
                                                             "GLOBAL_POSITION_INT and attitude",
                                                             "depth and attitude"};
  return names[index_of(source)];
}

MavlinkPoses::MavlinkPoses(Settings settings, InjectFailure inject, HasRangeFinder has_finder, HasOtherPoses has_others)
    : settings_(std::move(settings)),
      inject_(std::move(inject)),
      has_range_finder_(std::move(has_finder)),
      has_other_poses_(std::move(has_others)),
      distances_(settings_.sends_distances) {
  self_.component = own_component;
  if (settings_.system_id != 0) self_.system = settings_.system_id;
}

// ---- selection of the vehicle

void MavlinkPoses::select_vehicle(std::uint8_t system, Time now) {
  // Everything that was received from the previous vehicle is dropped.
  system_ = self_.system = system;
  found_at_ = now;
  next_request_ = now;
  has_autopilot_ = is_submarine_ = sim_state_is_coarse_ = global_has_fix_ = sim_state_has_fix_ = false;
  reported_.reset();
  autopilot_component_ = first_autopilot;
  received_.clear();
  reported_ignored_.clear();
  local_in_world_.reset();
  newest_ns_ = {};
  last_pose_ = {};
  timeless_ = {};
  reset_counter_ = {};
  clear_histories();
}

/// Drops received messages, so that messages before and after a restart are not paired.
void MavlinkPoses::clear_histories() {
  attitudes_.clear();
  local_.clear();
  global_.clear();
  depth_.reset();
  newest_boot_ms_ = 0;
  ++resets_;
}

/// True if the frame is from the selected system. If none is selected, selects the configured system, or else the first system
/// that sends a pose or the heartbeat of an autopilot. Another system is selected only after the selected one has been silent
/// for system_silence.
bool MavlinkPoses::is_from_vehicle(const Frame& frame, Time now) {
  if (frame.system == self_.system && frame.component == own_component)
    return false;  // this component sent the frame, and a router returned it
  if (is_excluded(frame)) return false;
  if (settings_.system_id != 0) {
    if (!system_) select_vehicle(frame.system, now);
    return true;
  }
  if (system_ && frame.system == *system_) return true;
  if (system_ && now - last_received_ <= system_silence) return false;
  if (!identifies_vehicle(frame)) return false;
  select_vehicle(frame.system, now);
  return true;
}

/// Accepts each message from only one component, the autopilot or else the first that sends it, because two components may send
/// different estimates of the same pose. Heartbeats are accepted from all components.
bool MavlinkPoses::is_selected_component(const Frame& frame, Time now) {
  const auto known = received_.find(frame.id);
  const bool other = known != received_.end() && known->second.component != frame.component && frame.id != Heartbeat::id;
  const bool takes_over = other && has_autopilot_ && frame.component == autopilot_component_;
  if (other && !takes_over && now - known->second.at <= system_silence) return false;
  if (takes_over) clear_histories();
  received_[frame.id] = {frame.component, now};
  return true;
}

bool MavlinkPoses::received_within(std::uint32_t message, Time now, std::chrono::nanoseconds within) const {
  const auto known = received_.find(message);
  return known != received_.end() && now - known->second.at <= within;
}

// ---- messages

Reaction MavlinkPoses::on_datagram(BytesView datagram, Time now) {
  Reaction out;
  if (datagram.size() > largest_datagram) {
    out.refusals.push_back("datagram is longer than " + std::to_string(largest_datagram) + " bytes");
    return out;
  }
  FrameReader frames(datagram);
  while (const auto frame = frames.next()) {
    if (frame->id == CommandLong::id) {  // usually sent by a ground station, not by the vehicle
      on_command(message_in<CommandLong>(*frame), *frame, out);
      continue;
    }
    if (!is_from_vehicle(*frame, now)) {
      note_ignored(*frame, {now, out});
      continue;
    }
    last_received_ = now;
    out.from_vehicle = true;
    if (is_selected_component(*frame, now))
      on_frame(*frame, {now, out});
    else if (contains_pose(frame->id))
      report_ignored(*frame, {now, out});
  }
  add_counts(frames.counts(), out);
  return out;
}

/// Carries out MAV_CMD_INJECT_FAILURE, and requests for DISTANCE_SENSOR, if they are addressed to this component. Commands for
/// other components of the system are not answered, because those components answer them.
void MavlinkPoses::on_command(const CommandLong& command, const Frame& frame, Reaction& out) {
  const bool is_ours = command.target_system == self_.system && command.target_component == own_component;
  const bool asks_for_message =
      command.command == CommandLong::set_message_interval || command.command == CommandLong::request_message;
  const bool asks_for_distances = asks_for_message && command.param1 == static_cast<float>(DistanceSensor::id);
  if (!is_ours || (command.command != CommandLong::inject_failure && !asks_for_distances)) return;
  const auto unit = whole_number(command.param1), type = whole_number(command.param2), instance = whole_number(command.param3);
  CommandAck ack;
  ack.command = command.command;
  ack.target_system = frame.system;
  ack.target_component = frame.component;
  if (asks_for_distances)
    ack.result = ask_for_distances(command);
  else if (!inject_)
    ack.result = MavResult::unsupported;
  else if (!unit || !type || *type > static_cast<std::uint32_t>(FailureType::intermittent) || !instance)
    ack.result = MavResult::denied;
  else
    ack.result = inject_(*unit, static_cast<FailureType>(*type), *instance);
  out.replies.push_back(framed(ack, self_));
}

MavResult MavlinkPoses::ask_for_distances(const CommandLong& command) {
  if (!has_range_finder_()) return MavResult::unsupported;
  if (command.command == CommandLong::request_message)
    distances_.ask_once();
  else if (!distances_.set_interval_us(command.param2))
    return MavResult::denied;
  return MavResult::accepted;
}

std::optional<Bytes> MavlinkPoses::distance_message(const DistanceSensor& measured) {
  if (!distances_.is_due(measured)) return std::nullopt;
  return framed(measured, self_);
}

void MavlinkPoses::add_counts(const FrameCounts& now, Reaction& out) {
  counts_.frames += now.frames;
  counts_.unknown += now.unknown;
  counts_.bad_checksum += now.bad_checksum;
  counts_.wrong_size += now.wrong_size;
  counts_.junk_bytes += now.junk_bytes;
  if (now.bad_checksum > 0)
    out.refusals.emplace_back(
        "a MAVLink frame has a wrong checksum: damaged, or of a dialect that uses its number for another message");
  else if (now.wrong_size > 0)
    out.refusals.emplace_back("a MAVLink 1 message has the wrong length");
  else if (now.junk_bytes > 0)
    out.refusals.push_back(std::to_string(now.junk_bytes) + " bytes are not MAVLink");
}

void MavlinkPoses::on_frame(const Frame& frame, Moment at) {
  switch (frame.id) {
    case Heartbeat::id:
      return handle(message_in<Heartbeat>(frame), frame);
    case Attitude::id:
      // Autopilots send the same attitude in both messages. While the quaternion arrives, this message is not used.
      if (!received_within(AttitudeQuaternion::id, at.now, source_silence)) handle(attitude_of(message_in<Attitude>(frame)), at);
      return;
    case AttitudeQuaternion::id:
      return handle(attitude_of(message_in<AttitudeQuaternion>(frame)), at);
    case LocalPositionNed::id:
      return handle(message_in<LocalPositionNed>(frame), at);
    case GlobalPositionInt::id:
      return handle(message_in<GlobalPositionInt>(frame), at);
    case GpsGlobalOrigin::id:
      return handle(message_in<GpsGlobalOrigin>(frame), at);
    case VfrHud::id:
      return handle(message_in<VfrHud>(frame), at);
    case VisionPositionEstimate::id:
      return handle(message_in<VisionPositionEstimate>(frame), at);
    case SimState::id:
      return handle(message_in<SimState>(frame), at);
    case AttPosMocap::id:
      return handle(message_in<AttPosMocap>(frame), at);
    case Odometry::id:
      return handle(message_in<Odometry>(frame), at);
    default:
      return;  // SYSTEM_TIME is not used: the World maps the stamps of poses to the daemon's time without it
  }
}

/// Finds the autopilot: component 1, else the first that states an autopilot, because gimbals and cameras may state one too.
void MavlinkPoses::handle(const Heartbeat& m, const Frame& frame) {
  if (m.autopilot == Heartbeat::no_autopilot) return;
  if (!has_autopilot_ || frame.component == first_autopilot) autopilot_component_ = frame.component;
  if (frame.component != autopilot_component_) return;
  has_autopilot_ = true;
  is_submarine_ = m.type == Heartbeat::submarine;
  autopilot_ = m.autopilot;
}

void MavlinkPoses::handle(const AttitudeReading& reading, Moment at) {
  note_boot_time(reading.at_ms);
  attitudes_.put(reading);
  join_pairs(at);
  add_pose_of_depth(reading, at);
}

void MavlinkPoses::handle(const LocalPositionNed& m, Moment at) {
  note_boot_time(m.boot_ms);
  local_.put(place_of(m));
  join_pairs(at);
}

void MavlinkPoses::handle(const GlobalPositionInt& m, Moment at) {
  note_boot_time(m.boot_ms);
  const auto fix = geodetic_of(m);
  global_has_fix_ = fix && fix->has_value();
  const auto place = placed(GlobalPositionInt::name, fix, at);
  // Without a fix, or from a submarine without world.origin, the message has no usable position but still gives the depth.
  const bool is_depth = fix && !place && (!global_has_fix_ || (is_submarine_ && !settings_.origin));
  if (is_depth)
    depth_ = Depth{m.boot_ms, -1e-3 * m.height_mm, 0.01 * m.down_cmps, at.now, GlobalPositionInt::id};
  else
    depth_.reset();
  if (!place) return;
  global_.put({m.boot_ms, *place, {0.01 * m.north_cmps, 0.01 * m.east_cmps, 0.01 * m.down_cmps}});
  join_pairs(at);
}

void MavlinkPoses::handle(const GpsGlobalOrigin& m, Moment at) {
  const auto place = placed(GpsGlobalOrigin::name, geodetic_of(m), at);
  if (!place) return;
  const Vec3d before = local_in_world_.value_or(Pose{}).position_m;
  if (length(place->position_m - before) > moved_origin_m) ++resets_;
  local_in_world_ = *place;
}

/// Reads a depth. Only ArduSub sends an altitude relative to the surface in VFR_HUD; other vehicles send it relative to mean sea
/// level or home. The message has no time stamp, so the newest boot time is used.
void MavlinkPoses::handle(const VfrHud& m, Moment at) {
  const double altitude_m = static_cast<double>(m.altitude_m);
  if (!is_submarine_ || receives(GlobalPositionInt::id, at.now) || !(std::abs(altitude_m) <= highest_hud_m)) return;
  const bool climbs = std::isfinite(m.climb_mps);
  depth_ = Depth{newest_boot_ms_, -altitude_m, climbs ? -static_cast<double>(m.climb_mps) : 0, at.now, VfrHud::id};
}

void MavlinkPoses::handle(const SimState& m, Moment at) {
  const auto place = placed(SimState::name, geodetic_of(m), at);
  sim_state_is_coarse_ = !has_exact_position(m);
  sim_state_has_fix_ = place.has_value();
  if (place) add_pose(Source::sim_state, raw_pose(m), Stamp{}, *place, at);
}

void MavlinkPoses::handle(const VisionPositionEstimate& m, Moment at) {
  on_reset_counter(Source::vision, m.reset_counter);
  add_pose(Source::vision, raw_pose(m), stamp_of(Source::vision, m.time_us), Pose{}, at);
}

void MavlinkPoses::handle(const AttPosMocap& m, Moment at) {
  add_pose(Source::mocap, raw_pose(m), stamp_of(Source::mocap, m.time_us), Pose{}, at);
}

void MavlinkPoses::handle(const Odometry& m, Moment at) {
  const auto raw = raw_pose(m);
  if (!raw) return refuse(Odometry::name, raw.error().text, at);
  on_reset_counter(Source::odometry, m.reset_counter);
  add_pose(Source::odometry, *raw, stamp_of(Source::odometry, m.time_us), local_in_world_.value_or(Pose{}), at);
}

// ---- poses

void MavlinkPoses::join_pairs(Moment at) {
  while (const auto pair = local_.next(attitudes_))
    add_pose(Source::local, raw_pose(pair->attitude, pair->place), boot_stamp(pair->place.at_ms),
             local_in_world_.value_or(Pose{}), at);
  while (const auto pair = global_.next(attitudes_))
    add_pose(Source::global, raw_pose(pair->attitude, {pair->place.at_ms, {}, pair->place.ned_mps}),
             boot_stamp(pair->place.at_ms), pair->place.enu_in_world, at);
}

/// Makes a pose of each attitude and the newest depth, because attitudes arrive more often and the depth changes slowly.
void MavlinkPoses::add_pose_of_depth(const AttitudeReading& reading, Moment at) {
  if (!depth_ || at.now - depth_->received > system_silence || received_within(LocalPositionNed::id, at.now, source_silence))
    return;
  const std::int64_t since_ms = std::clamp(reading.at_ms - depth_->at_ms, std::int64_t{0}, longest_sinking_ms);
  PlaceReading place{reading.at_ms, {0, 0, depth_->down_m + 1e-3 * static_cast<double>(since_ms) * depth_->down_mps}, {}};
  RawPose raw = raw_pose(reading, place);
  raw.velocity_mps.reset();
  add_pose(Source::depth, raw, boot_stamp(reading.at_ms), Pose{{settings_.held_m.x, settings_.held_m.y, 0}, {}}, at);
}

/// Returns the ENU axes at the place, in the world; nullopt if there is no world.origin or no fix, or if the position is
/// implausible, which is reported.
std::optional<Pose> MavlinkPoses::placed(std::string_view message, const Result<std::optional<Geodetic>>& place, Moment at) {
  if (!place) {
    refuse(message, place.error().text, at);
    return std::nullopt;
  }
  if (!settings_.origin || !*place) return std::nullopt;
  const Pose enu = enu_in_enu_of(*settings_.origin, **place);
  const double away_m = length(enu.position_m);
  if (away_m <= farthest_m) return enu;
  refuse(message, "it is " + std::to_string(std::llround(away_m / 1000)) + " km from world.origin; one of the two is wrong", at);
  return std::nullopt;
}

void MavlinkPoses::add_pose(Source source, const RawPose& raw, Stamp stamp, const Pose& enu_in_world, Moment at) {
  // Sources are in the order of preference: a pose is dropped while a better source sends.
  for (std::size_t better = 0; better < index_of(source); ++better)
    if (last_pose_[better] && at.now - *last_pose_[better] <= source_silence) return;
  if (settings_.needs_time && stamp.domain == ClockDomain::arrival) {
    if (!std::exchange(timeless_[index_of(source)], true))
      at.out.notices.push_back(std::string(name_of(source)) + " has no time stamp and is not used: clock: follow needs one");
    return;
  }
  control::PoseSample sample;
  sample.name = settings_.vehicle;
  sample.stamp = stamp;
  sample.reset_counter = resets_;
  sample.fields = fields_of(raw);
  auto pose = checked(std::move(sample), raw);
  if (!pose) return refuse(name_of(source), pose.error().text, at);
  pose->pose = compose(enu_in_world, pose->pose);
  last_pose_[index_of(source)] = at.now;
  at.out.poses.push_back({*std::move(pose), "system " + std::to_string(*system_) + " " + std::string(name_of(source))});
}

/// Returns the stamp of a message: UNIX time or time since boot, of the sender's clock. Without a plausible stamp the pose gets
/// the time of its arrival.
Stamp MavlinkPoses::stamp_of(Source source, std::uint64_t time_us) {
  if (time_us == 0 || time_us > control::largest_stamp_ns / 1000) return {};
  const auto ns = static_cast<std::int64_t>(time_us * 1000);
  std::int64_t& newest_ns = newest_ns_[index_of(source)];
  if (ns < newest_ns - late_ns) ++resets_;
  newest_ns = ns < newest_ns - late_ns ? ns : std::max(newest_ns, ns);
  return {ClockDomain::sim, ns};
}

void MavlinkPoses::note_boot_time(std::int64_t ms) {
  // If the clock decreases by more than late packets explain, the autopilot has restarted.
  if (ms < newest_boot_ms_ - late_ms) clear_histories();
  newest_boot_ms_ = std::max(newest_boot_ms_, ms);
}

void MavlinkPoses::on_reset_counter(Source source, std::uint8_t counter) {
  std::optional<std::uint8_t>& known = reset_counter_[index_of(source)];
  if (known && *known != counter) ++resets_;
  known = counter;
}

void MavlinkPoses::refuse(std::string_view message, const std::string& why, Moment at) {
  at.out.refusals.push_back(std::string(message) + ": " + why);
}

}  // namespace sonar::mavlink
