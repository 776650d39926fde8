// A small ping of a made-up Oculus.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/oculus/encode_ping.hpp"

namespace sonar::clients {

/// Returns a ping of 20 rows and 16 beams of zeros, which repeats the settings `echo`.
inline wire::Bytes ping_bytes(std::uint32_t id, const oculus::FireSettings& echo) {
  oculus::PingHead head;
  head.fixed.header.source = 7001;
  head.fixed.header.type = oculus::MessageType::ping_result;
  head.fixed.fire = echo;
  head.fixed.ping_id = id;
  head.fixed.frequency_hz = 2.1e6;
  head.fixed.sound_speed_mps = 1500;
  head.fixed.range_resolution_m = 0.1;
  head.fixed.row_count = 20;
  head.fixed.beam_count = 16;
  std::array<std::int16_t, 16> bearings{};
  for (std::size_t i = 0; i < bearings.size(); ++i) bearings[i] = static_cast<std::int16_t>(200 * static_cast<int>(i) - 1500);
  const std::array<std::byte, 320> samples{};
  return oculus::encode_ping(head, {bearings, {}, samples});
}

}  // namespace sonar::clients
