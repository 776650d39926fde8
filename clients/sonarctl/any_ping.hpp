// A ping of any kind of sonar, and the facts that listen, view and stats print. Facts of one kind only are read from its type.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "clients/bvtsdk/core/polar_ping.hpp"
#include "core/image/polar_image.hpp"
#include "protocol/aris/encode_frame.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::clients {

struct BlueViewPing {
  bvt::PolarPing polar;
  double frequency_hz = 0;       // of the head, from the greeting of its sonar
  std::size_t message_size = 0;  // bytes
};
struct ArisPing {
  aris::DecodedFrame frame;         // beam 0 is the right-most
  std::vector<double> azimuth_rad;  // most to port first
  double frequency_hz = 0;
  std::size_t message_size = 0;  // bytes of all its datagrams
};
struct PingFacts {
  std::uint32_t number = 0;
  unsigned beams = 0, rows = 0, bits = 0;
  double row_m = 0, range_m = 0;  // range_m: far end of the last row
  double frequency_hz = 0;
  std::size_t message_size = 0;  // bytes
  std::string note = {};         // more for the line of a ping
};
/// Of a sonar of the ping protocol, or a Sonar 3D-15: drawn as it arrives.
struct PicturePing {
  PolarImage image;  // of a Ping360: the sector as scanned so far
  PingFacts facts;
  bool is_whole = true;  // the sector was scanned once
};
using AnyPing = std::variant<oculus::DecodedPing, BlueViewPing, ArisPing, PicturePing>;
PingFacts facts_of(const AnyPing& ping);

}  // namespace sonar::clients
