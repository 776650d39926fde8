// A vehicle that sends MAVLink, for tests: frames of either version, joined into datagrams.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocol/mavlink/mavlink_poses.hpp"

namespace sonar::mavlink {

struct Sender {
  Identity who{1, 1, 0};

  template <class M>
  Bytes operator()(const M& message) {
    return framed(message, who);
  }
  /// Returns a frame of version 1, with all base fields and no extension fields.
  template <class M>
  Bytes version_1(const M& message) {
    Bytes out{std::byte{0xFE},
              static_cast<std::byte>(wire::wire_size<M>()),
              static_cast<std::byte>(who.sequence++),
              static_cast<std::byte>(who.system),
              static_cast<std::byte>(who.component),
              static_cast<std::byte>(M::id & 0xFF)};
    wire::append(out, message);
    const std::uint16_t crc = checksum(std::array{std::byte{M::crc_extra}}, checksum(BytesView(out).subspan(1)));
    out.push_back(static_cast<std::byte>(crc & 0xFF));
    out.push_back(static_cast<std::byte>(crc >> 8));
    return out;
  }
};

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
inline Bytes bytes(std::initializer_list<int> values) {
  Bytes out;
  for (const int v : values) out.push_back(static_cast<std::byte>(v));
  return out;
}
inline Bytes bytes_of_hex(std::string_view hex) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    out.push_back(static_cast<std::byte>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  return out;
}
inline Time at_s(double s) { return Time(nanoseconds_from(s)); }

inline Heartbeat autopilot_heartbeat() {
  Heartbeat beat;
  beat.type = 12;      // submarine
  beat.autopilot = 3;  // ArduPilot
  beat.system_status = 4;
  return beat;
}
inline Attitude attitude(std::uint32_t boot_ms, float yaw_rad) {
  Attitude m;
  m.boot_ms = boot_ms;
  m.yaw_rad = yaw_rad;
  return m;
}
inline LocalPositionNed local(std::uint32_t boot_ms, float north_m, float east_m, float down_m) {
  LocalPositionNed m;
  m.boot_ms = boot_ms;
  m.north_m = north_m, m.east_m = east_m, m.down_m = down_m;
  return m;
}
inline Odometry odometry(std::uint64_t time_us, float north_m) {
  Odometry m;
  m.time_us = time_us;
  m.x_m = north_m;
  m.frame_id = 1, m.child_frame_id = 12;
  return m;
}

inline void expect_near(Vec3d is, Vec3d wanted, double tolerance) {
  EXPECT_NEAR(is.x, wanted.x, tolerance);
  EXPECT_NEAR(is.y, wanted.y, tolerance);
  EXPECT_NEAR(is.z, wanted.z, tolerance);
}
/// Expects these directions of the body's axes, given as east, north, up.
inline void expect_axes(const Pose& pose, Vec3d ahead, Vec3d port, double tolerance = 1e-6) {
  expect_near(rotate(pose.orientation, {1, 0, 0}), ahead, tolerance);
  expect_near(rotate(pose.orientation, {0, 1, 0}), port, tolerance);
}

}  // namespace sonar::mavlink
