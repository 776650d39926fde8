// The MAVLink messages with poses and distances, and commands. Fields are in wire order: base fields sorted by size, then
// extensions in the order of their addition. The numbers, CRC_EXTRA and lengths are those of minimal.xml, standard.xml and
// common.xml of the MAVLink project; a test computes CRC_EXTRA and lengths from the fields below. protocol/mavlink/frames.hpp
// reads and writes them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/wire/wire.hpp"

namespace sonar::mavlink {

using wire::Bytes;
using wire::BytesView;

struct Heartbeat {
  static constexpr std::uint32_t id = 0;
  static constexpr std::uint8_t crc_extra = 50;
  static constexpr std::string_view name = "HEARTBEAT";
  static constexpr std::uint8_t submarine = 12;    // MAV_TYPE_SUBMARINE
  static constexpr std::uint8_t no_autopilot = 8;  // MAV_AUTOPILOT_INVALID: ground stations, cameras, sonard
  std::uint32_t custom_mode = 0;
  std::uint8_t type = 0, autopilot = 0, base_mode = 0, system_status = 0, mavlink_version = 3;
};
constexpr void fields(auto& visit, wire::Like<Heartbeat> auto& m) {
  visit("custom_mode", m.custom_mode);
  visit("type", m.type), visit("autopilot", m.autopilot), visit("base_mode", m.base_mode);
  visit("system_status", m.system_status), visit("mavlink_version", m.mavlink_version);
}

struct SystemTime {
  static constexpr std::uint32_t id = 2;
  static constexpr std::uint8_t crc_extra = 137;
  static constexpr std::string_view name = "SYSTEM_TIME";
  std::uint64_t unix_us = 0;
  std::uint32_t boot_ms = 0;
};
constexpr void fields(auto& visit, wire::Like<SystemTime> auto& m) {
  visit("time_unix_usec", m.unix_us), visit("time_boot_ms", m.boot_ms);
}

struct Attitude {
  static constexpr std::uint32_t id = 30;
  static constexpr std::uint8_t crc_extra = 39;
  static constexpr std::string_view name = "ATTITUDE";
  std::uint32_t boot_ms = 0;
  float roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
  float roll_radps = 0, pitch_radps = 0, yaw_radps = 0;  // about the body's axes
};
constexpr void fields(auto& visit, wire::Like<Attitude> auto& m) {
  visit("time_boot_ms", m.boot_ms);
  visit("roll", m.roll_rad), visit("pitch", m.pitch_rad), visit("yaw", m.yaw_rad);
  visit("rollspeed", m.roll_radps), visit("pitchspeed", m.pitch_radps), visit("yawspeed", m.yaw_radps);
}

struct AttitudeQuaternion {
  static constexpr std::uint32_t id = 31;
  static constexpr std::uint8_t crc_extra = 246;
  static constexpr std::string_view name = "ATTITUDE_QUATERNION";
  std::uint32_t boot_ms = 0;
  float w = 1, x = 0, y = 0, z = 0;
  float roll_radps = 0, pitch_radps = 0, yaw_radps = 0;
  std::array<float, 4> offset{};  // rotation with which the autopilot shows attitude; the attitude itself does not include it
};
constexpr void fields(auto& visit, wire::Like<AttitudeQuaternion> auto& m) {
  visit("time_boot_ms", m.boot_ms);
  visit("q1", m.w), visit("q2", m.x), visit("q3", m.y), visit("q4", m.z);
  visit("rollspeed", m.roll_radps), visit("pitchspeed", m.pitch_radps), visit("yawspeed", m.yaw_radps);
}
constexpr void extensions(auto& visit, wire::Like<AttitudeQuaternion> auto& m) { visit("repr_offset_q", m.offset); }

struct LocalPositionNed {
  static constexpr std::uint32_t id = 32;
  static constexpr std::uint8_t crc_extra = 185;
  static constexpr std::string_view name = "LOCAL_POSITION_NED";
  std::uint32_t boot_ms = 0;
  float north_m = 0, east_m = 0, down_m = 0, north_mps = 0, east_mps = 0, down_mps = 0;
};
constexpr void fields(auto& visit, wire::Like<LocalPositionNed> auto& m) {
  visit("time_boot_ms", m.boot_ms);
  visit("x", m.north_m), visit("y", m.east_m), visit("z", m.down_m);
  visit("vx", m.north_mps), visit("vy", m.east_mps), visit("vz", m.down_mps);
}

struct GlobalPositionInt {
  static constexpr std::uint32_t id = 33;
  static constexpr std::uint8_t crc_extra = 104;
  static constexpr std::string_view name = "GLOBAL_POSITION_INT";
  std::uint32_t boot_ms = 0;
  std::int32_t latitude_e7_deg = 0, longitude_e7_deg = 0, altitude_mm = 0, height_mm = 0;
  std::int16_t north_cmps = 0, east_cmps = 0, down_cmps = 0;
  std::uint16_t heading_cdeg = 0;
};
constexpr void fields(auto& visit, wire::Like<GlobalPositionInt> auto& m) {
  visit("time_boot_ms", m.boot_ms);
  visit("lat", m.latitude_e7_deg), visit("lon", m.longitude_e7_deg);
  visit("alt", m.altitude_mm), visit("relative_alt", m.height_mm);
  visit("vx", m.north_cmps), visit("vy", m.east_cmps), visit("vz", m.down_cmps), visit("hdg", m.heading_cdeg);
}

/// The origin of the autopilot's local north-east-down axes.
struct GpsGlobalOrigin {
  static constexpr std::uint32_t id = 49;
  static constexpr std::uint8_t crc_extra = 39;
  static constexpr std::string_view name = "GPS_GLOBAL_ORIGIN";
  std::int32_t latitude_e7_deg = 0, longitude_e7_deg = 0, altitude_mm = 0;
  std::uint64_t time_us = 0;
};
constexpr void fields(auto& visit, wire::Like<GpsGlobalOrigin> auto& m) {
  visit("latitude", m.latitude_e7_deg), visit("longitude", m.longitude_e7_deg), visit("altitude", m.altitude_mm);
}
constexpr void extensions(auto& visit, wire::Like<GpsGlobalOrigin> auto& m) { visit("time_usec", m.time_us); }

/// Values for a pilot's display.
struct VfrHud {
  static constexpr std::uint32_t id = 74;
  static constexpr std::uint8_t crc_extra = 20;
  static constexpr std::string_view name = "VFR_HUD";
  float airspeed_mps = 0, groundspeed_mps = 0, altitude_m = 0, climb_mps = 0;
  std::int16_t heading_deg = 0;
  std::uint16_t throttle_percent = 0;
};
constexpr void fields(auto& visit, wire::Like<VfrHud> auto& m) {
  visit("airspeed", m.airspeed_mps), visit("groundspeed", m.groundspeed_mps), visit("alt", m.altitude_m);
  visit("climb", m.climb_mps), visit("heading", m.heading_deg), visit("throttle", m.throttle_percent);
}

struct CommandLong {
  static constexpr std::uint32_t id = 76;
  static constexpr std::uint8_t crc_extra = 152;
  static constexpr std::string_view name = "COMMAND_LONG";
  static constexpr std::uint16_t inject_failure = 420;        // MAV_CMD_INJECT_FAILURE: unit, type, instance
  static constexpr std::uint16_t set_message_interval = 511;  // MAV_CMD_SET_MESSAGE_INTERVAL: message, interval in us
  static constexpr std::uint16_t request_message = 512;       // MAV_CMD_REQUEST_MESSAGE: message
  float param1 = 0, param2 = 0, param3 = 0, param4 = 0, param5 = 0, param6 = 0, param7 = 0;
  std::uint16_t command = 0;
  std::uint8_t target_system = 0, target_component = 0, confirmation = 0;
};
constexpr void fields(auto& visit, wire::Like<CommandLong> auto& m) {
  visit("param1", m.param1), visit("param2", m.param2), visit("param3", m.param3), visit("param4", m.param4);
  visit("param5", m.param5), visit("param6", m.param6), visit("param7", m.param7);
  visit("command", m.command), visit("target_system", m.target_system);
  visit("target_component", m.target_component), visit("confirmation", m.confirmation);
}

/// MAV_RESULT of common.xml.
enum class MavResult : std::uint8_t { accepted = 0, temporarily_rejected = 1, denied = 2, unsupported = 3, failed = 4 };

/// Only written, never read.
struct CommandAck {
  static constexpr std::uint32_t id = 77;
  static constexpr std::uint8_t crc_extra = 143;
  static constexpr std::string_view name = "COMMAND_ACK";
  std::uint16_t command = 0;
  MavResult result{};
  std::uint8_t progress = 0;
  std::int32_t result_param2 = 0;
  std::uint8_t target_system = 0, target_component = 0;  // ids of the sender of the command
};
constexpr void fields(auto& visit, wire::Like<CommandAck> auto& m) { visit("command", m.command), visit("result", m.result); }
constexpr void extensions(auto& visit, wire::Like<CommandAck> auto& m) {
  visit("progress", m.progress), visit("result_param2", m.result_param2);
  visit("target_system", m.target_system), visit("target_component", m.target_component);
}

/// Only written, never read. Lengths in centimetres.
struct DistanceSensor {
  static constexpr std::uint32_t id = 132;
  static constexpr std::uint8_t crc_extra = 85;
  static constexpr std::string_view name = "DISTANCE_SENSOR";
  static constexpr std::uint8_t ultrasound = 1;            // MAV_DISTANCE_SENSOR_ULTRASOUND
  static constexpr std::uint8_t unknown_covariance = 255;  // UINT8_MAX
  std::uint32_t boot_ms = 0;
  std::uint16_t min_cm = 0, max_cm = 0, current_cm = 0;
  std::uint8_t type = ultrasound, sensor = 0, orientation = 0, covariance_cm2 = unknown_covariance;
  float horizontal_fov_rad = 0, vertical_fov_rad = 0;
  std::array<float, 4> wxyz{};      // only for orientation 100, else zeros
  std::uint8_t signal_percent = 0;  // 0 = unknown, 1 = no valid signal
};
constexpr void fields(auto& visit, wire::Like<DistanceSensor> auto& m) {
  visit("time_boot_ms", m.boot_ms);
  visit("min_distance", m.min_cm), visit("max_distance", m.max_cm), visit("current_distance", m.current_cm);
  visit("type", m.type), visit("id", m.sensor), visit("orientation", m.orientation), visit("covariance", m.covariance_cm2);
}
constexpr void extensions(auto& visit, wire::Like<DistanceSensor> auto& m) {
  visit("horizontal_fov", m.horizontal_fov_rad), visit("vertical_fov", m.vertical_fov_rad);
  visit("quaternion", m.wxyz), visit("signal_quality", m.signal_percent);
}

struct VisionPositionEstimate {
  static constexpr std::uint32_t id = 102;
  static constexpr std::uint8_t crc_extra = 158;
  static constexpr std::string_view name = "VISION_POSITION_ESTIMATE";
  std::uint64_t time_us = 0;
  float north_m = 0, east_m = 0, down_m = 0, roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
  std::array<float, 21> covariance{};
  std::uint8_t reset_counter = 0;
};
constexpr void fields(auto& visit, wire::Like<VisionPositionEstimate> auto& m) {
  visit("usec", m.time_us);
  visit("x", m.north_m), visit("y", m.east_m), visit("z", m.down_m);
  visit("roll", m.roll_rad), visit("pitch", m.pitch_rad), visit("yaw", m.yaw_rad);
}
constexpr void extensions(auto& visit, wire::Like<VisionPositionEstimate> auto& m) {
  visit("covariance", m.covariance), visit("reset_counter", m.reset_counter);
}

/// Ground truth of a simulator. It has no time stamp.
struct SimState {
  static constexpr std::uint32_t id = 108;
  static constexpr std::uint8_t crc_extra = 32;
  static constexpr std::string_view name = "SIM_STATE";
  float w = 1, x = 0, y = 0, z = 0;
  float roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
  float acceleration_x = 0, acceleration_y = 0, acceleration_z = 0;
  float roll_radps = 0, pitch_radps = 0, yaw_radps = 0;
  float latitude_deg = 0, longitude_deg = 0, altitude_m = 0;  // floats have steps of 0.4 m; the extensions are better
  float std_dev_horizontal = 0, std_dev_vertical = 0;
  float north_mps = 0, east_mps = 0, down_mps = 0;
  std::int32_t latitude_e7_deg = 0, longitude_e7_deg = 0;
};
constexpr void fields(auto& visit, wire::Like<SimState> auto& m) {
  visit("q1", m.w), visit("q2", m.x), visit("q3", m.y), visit("q4", m.z);
  visit("roll", m.roll_rad), visit("pitch", m.pitch_rad), visit("yaw", m.yaw_rad);
  visit("xacc", m.acceleration_x), visit("yacc", m.acceleration_y), visit("zacc", m.acceleration_z);
  visit("xgyro", m.roll_radps), visit("ygyro", m.pitch_radps), visit("zgyro", m.yaw_radps);
  visit("lat", m.latitude_deg), visit("lon", m.longitude_deg), visit("alt", m.altitude_m);
  visit("std_dev_horz", m.std_dev_horizontal), visit("std_dev_vert", m.std_dev_vertical);
  visit("vn", m.north_mps), visit("ve", m.east_mps), visit("vd", m.down_mps);
}
constexpr void extensions(auto& visit, wire::Like<SimState> auto& m) {
  visit("lat_int", m.latitude_e7_deg), visit("lon_int", m.longitude_e7_deg);
}

struct AttPosMocap {
  static constexpr std::uint32_t id = 138;
  static constexpr std::uint8_t crc_extra = 109;
  static constexpr std::string_view name = "ATT_POS_MOCAP";
  std::uint64_t time_us = 0;
  std::array<float, 4> wxyz{1, 0, 0, 0};
  float north_m = 0, east_m = 0, down_m = 0;
  std::array<float, 21> covariance{};
};
constexpr void fields(auto& visit, wire::Like<AttPosMocap> auto& m) {
  visit("time_usec", m.time_us), visit("q", m.wxyz);
  visit("x", m.north_m), visit("y", m.east_m), visit("z", m.down_m);
}
constexpr void extensions(auto& visit, wire::Like<AttPosMocap> auto& m) { visit("covariance", m.covariance); }

struct Odometry {
  static constexpr std::uint32_t id = 331;
  static constexpr std::uint8_t crc_extra = 91;
  static constexpr std::string_view name = "ODOMETRY";
  std::uint64_t time_us = 0;
  float x_m = 0, y_m = 0, z_m = 0;
  std::array<float, 4> wxyz{1, 0, 0, 0};
  float vx_mps = 0, vy_mps = 0, vz_mps = 0, roll_radps = 0, pitch_radps = 0, yaw_radps = 0;
  std::array<float, 21> pose_covariance{}, velocity_covariance{};
  std::uint8_t frame_id = 0, child_frame_id = 0;
  std::uint8_t reset_counter = 0, estimator_type = 0;
  std::int8_t quality = 0;
};
constexpr void fields(auto& visit, wire::Like<Odometry> auto& m) {
  visit("time_usec", m.time_us);
  visit("x", m.x_m), visit("y", m.y_m), visit("z", m.z_m), visit("q", m.wxyz);
  visit("vx", m.vx_mps), visit("vy", m.vy_mps), visit("vz", m.vz_mps);
  visit("rollspeed", m.roll_radps), visit("pitchspeed", m.pitch_radps), visit("yawspeed", m.yaw_radps);
  visit("pose_covariance", m.pose_covariance), visit("velocity_covariance", m.velocity_covariance);
  visit("frame_id", m.frame_id), visit("child_frame_id", m.child_frame_id);
}
constexpr void extensions(auto& visit, wire::Like<Odometry> auto& m) {
  visit("reset_counter", m.reset_counter), visit("estimator_type", m.estimator_type), visit("quality", m.quality);
}

/// Visits the base fields, then the extensions, if the message has any.
template <class V, class M>
constexpr void all_fields(V& visit, M& m) {
  fields(visit, m);
  if constexpr (requires { extensions(visit, m); }) extensions(visit, m);
}
template <class M>
constexpr std::size_t full_size() {
  wire::Counter counter;
  const M message{};
  all_fields(counter, message);
  return counter.bytes;
}

/// Properties of a message that a reader needs before decoding.
struct MessageInfo {
  std::uint32_t id = 0;
  std::string_view name;
  std::uint8_t crc_extra = 0;
  std::size_t size = 0, full_size = 0;  // size of the payload without and with extensions
};
/// Returns the messages that can be read, in the order of their ids.
std::span<const MessageInfo> known_messages();
/// Returns null for messages that cannot be read.
const MessageInfo* find_message(std::uint32_t id);

}  // namespace sonar::mavlink
