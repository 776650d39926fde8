// The protobuf messages of a Sonar 3D-15 as structs, serialised in their packet (waterlinked.proto).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/units.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::waterlinked {

using wire::Bytes;
using wire::BytesView;

/// The fields that both images of a shot have.
struct Shot {
  Time at{};
  std::uint32_t sequence = 0;
  float speed_of_sound_mps = 0, range_m = 0;
  std::uint32_t frequency = 0;  // shots per second
  std::uint32_t width = 0, height = 0;
  float horizontal_deg = 0, vertical_deg = 0;
};
struct RangeMessage {
  Shot shot;
  float pixel_scale_m = 0;
  std::vector<std::uint32_t> pixels;  // row by row, the lowest first
};
struct StrengthMessage {
  Shot shot;
  std::vector<std::uint8_t> pixels;
};
struct ImuMessage {
  std::uint32_t sequence = 0;
  struct Sample {
    Time at{};
    std::array<float, 3> specific_force_mps2{}, rate_radps{};  // forward, right, down
  };
  std::vector<Sample> samples;
};

Bytes packet_of(const RangeMessage& message);
Bytes packet_of(const StrengthMessage& message);
Bytes packet_of(const ImuMessage& message);

/// The content of a packet: at most one is set; none if the packet is of another kind or unreadable.
struct Decoded {
  std::optional<RangeMessage> ranges;
  std::optional<StrengthMessage> strengths;
  std::optional<ImuMessage> imu;
};
Decoded decode(BytesView packet);

}  // namespace sonar::waterlinked
