// Converts a ping to a packet, and splits a packet into its parts.
#pragma once

#include <optional>

#include "protocol/m3/messages.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/vendor.hpp"

namespace sonar::m3 {

/// Finds packets in a stream. It checks that the numbers of beams and samples in the data header agree with the size.
extern const recording::Framing framing;

Bytes encode_packet(const Ping& ping, const protocol::DeviceState& device);

struct Packet {
  DataHeader header;
  BytesView samples;  // I and Q, beam by beam from the smallest angle on, each beam from near to far

  double start_m() const;
  double spacing_m() const;
};
/// Reads a packet. nullopt: `whole` is not exactly one packet of complex samples.
std::optional<Packet> read_packet(BytesView whole);

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView packet);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView packet);

}  // namespace sonar::m3
