// The Kongsberg Mesotech M3: device, driver, and codec for recordings. The device sends the stream of beam-formed data that the
// maker's program sends to its clients.
#pragma once

#include <optional>

#include "protocol/host.hpp"
#include "protocol/m3/messages.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/vendor.hpp"

namespace sonar::m3 {

const protocol::Vendor& vendor();

inline constexpr protocol::HostPort host_ports[]{{protocol::HostPort::Kind::tcp, tcp_port}};

/// Assumed: samples are amplitudes, which the maker's program shows in decibels. A square root looks similar and needs no lower
/// limit.
inline constexpr Shades shades{.gamma = 0.5f};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

// Converts a ping to a packet, and splits a packet into its parts.

/// Finds packets in a stream. It checks that the numbers of beams and samples in the data header agree with the size.
extern const recording::Framing framing;

Bytes encode_packet(const Ping& ping, const protocol::DeviceState& device);

struct Packet {
  DataHeader header;
  BytesView samples;  // I and Q, beam by beam from the smallest angle on, each beam from near to far

  double start_m() const;
  double spacing_m() const;
};
/// Reads a packet. Returns nullopt if `whole` is not exactly one packet of complex samples.
std::optional<Packet> read_packet(BytesView whole);

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView packet);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView packet);

}  // namespace sonar::m3
