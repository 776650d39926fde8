#include "protocol/oculus/fire.hpp"

#include <algorithm>

#include "protocol/oculus/framer.hpp"

namespace sonar::oculus {

std::optional<FireRequest> parse_fire(wire::BytesView message) {
  if (message.size() < fire_v1_size) return std::nullopt;
  FireRequest fire;
  fire.version = header_of(message).version;
  wire::Reader reader(message);
  reader.block("header", header_size);
  fields(reader, fire.settings);
  if (fire.version >= 2) {
    // The message of a client may end early; the missing fields read as 0.
    wire::Bytes tail(wire::wire_size<FireExtension>());
    const auto sent = message.subspan(fire_v1_size, std::min(tail.size(), message.size() - fire_v1_size));
    std::copy(sent.begin(), sent.end(), tail.begin());
    wire::Reader tail_reader(tail);
    fields(tail_reader, fire.extension);
  }
  return fire;
}

// The version in the header determines the length: 89 bytes from version 2 on, else 53.
wire::Bytes make_fire(const FireRequest& fire, std::uint16_t destination, bool payload_size_zero) {
  const std::size_t length = fire.version >= 2 ? fire_v2_size : fire_v1_size;
  MessageHeader header;
  header.destination = destination;
  header.type = MessageType::fire;
  header.version = fire.version;
  header.payload_size = payload_size_zero ? 0 : static_cast<std::uint32_t>(length - header_size);
  if (fire.version >= 2) return wire::bytes_of(FireMessageV2{header, fire.settings, fire.extension});
  return wire::bytes_of(FireMessageV1{header, fire.settings});
}

FireRequest stored_fire() {
  FireRequest fire;  // unknown: settings stored in the real device; assumed: range 10 m
  fire.settings.mode = 2;
  fire.settings.flags = flag::range_in_metres | flag::simple_result | flag::beams_512;
  fire.settings.range = 10;
  fire.settings.gain_percent = 50;
  return fire;
}

// Fire messages are compared as bytes, because every field is visible to a client, even if the device only echoes it.
bool HeldFire::equals(const VendorSettings& other) const {
  const auto* held = dynamic_cast<const HeldFire*>(&other);
  return held != nullptr && make_fire(fire) == make_fire(held->fire);
}

FireRequest fire_of(const VendorSettings* settings) {
  const auto* held = dynamic_cast<const HeldFire*>(settings);
  return held != nullptr ? held->fire : stored_fire();
}

}  // namespace sonar::oculus
