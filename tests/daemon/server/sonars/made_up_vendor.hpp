// A made-up make of sonar with a port of every kind, to test the transports of protocol/transport.hpp end to end.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::testing_daemon {

// Commands are lines of text, answered by "ok" or "no: WHY":
//   range METRES | receivers [ADDRESS:PORT ...] | ping | quit
//   silence SECONDS | listens SECONDS     longest silence of this client from now on; with `listens` a sign of its computer will
//   do
// and over UDP also who, answered by the sonar's name and range.
constexpr std::uint16_t command_port = 15000;  // TCP
constexpr std::uint16_t data_port = 15001;     // TCP: "PING number bytes\n" and the samples; UDP: a dialogue of lines, and parts
constexpr std::uint16_t beacon_port = 15002;   // UDP: "NAME free" or "NAME busy", every 10 s and when that changes
constexpr std::uint16_t udp_port = 15003;      // UDP: commands; datagrams of pings come from it too
constexpr std::uint16_t group_port = 15004;    // UDP: the ping's number alone, to group_ip
constexpr std::uint16_t http_port = 15080;     // GET and PUT /range; PUT /receivers
constexpr protocol::Ipv4 group_ip{239, 255, 42, 1};
constexpr std::size_t part_bytes = 1000;  // bytes of samples in a datagram, behind "PING number part parts\n"

/// Starts to ping at 20 Hz when a client or a receiver is there.
const protocol::Vendor& made_up_vendor();

}  // namespace sonar::testing_daemon
