// A Ping as the payload of PING_DATA: beam-major 16-bit samples, near to far, left to right, and where the vehicle was.
#pragma once

#include "protocol/blueview/head_settings.hpp"
#include "protocol/vendor.hpp"

namespace sonar::blueview {

/// Which fields of the navigation data follow the bitmap, in this order.
enum NavField : std::uint16_t {
  nav_time = 1 << 0,              // f64, seconds since 1970 UTC
  nav_latitude = 1 << 1,          // f64, degrees
  nav_longitude = 1 << 2,         // f64, degrees
  nav_depth = 1 << 3,             // f32, metres
  nav_altitude = 1 << 4,          // f32, metres
  nav_pitch = 1 << 5,             // f32, degrees, bow up
  nav_roll = 1 << 6,              // f32, degrees, port up
  nav_heading = 1 << 7,           // f32, degrees from true north, clockwise
  nav_heading_velocity = 1 << 8,  // f32, m/s ahead
  nav_course = 1 << 9,            // f32, degrees
  nav_text = 1 << 10,             // text
};

/// `settings`: those the ping was made with.
wire::Bytes encode_ping(const Ping& ping, const protocol::DeviceState& device, const SonarSettings& settings);

}  // namespace sonar::blueview
