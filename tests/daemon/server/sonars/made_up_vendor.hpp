// A made-up make of sonar with a port of every kind, to test the transports of protocol/vendor.hpp end to end.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::testing_daemon {

// Commands are lines of text, answered with "ok" or "no: WHY":
//   range METRES | receivers [ADDRESS:PORT ...] | ping | quit | quiet
//   who, answered by the sonar's name and range
//   silence SECONDS | listens SECONDS, which set the longest silence of this client; after `listens`, an answer of the client's
//   computer to a probe also counts as a message
constexpr std::uint16_t command_port = 15000;  // TCP
constexpr std::uint16_t data_port = 15001;     // TCP: "PING number bytes\n" and the samples; UDP: a dialogue of lines, and parts
constexpr std::uint16_t beacon_port = 15002;   // UDP: "NAME free" or "NAME busy", every 10 s and when that changes
constexpr std::uint16_t udp_port = 15003;      // UDP: commands; pings are sent from this port, too
constexpr std::uint16_t group_port = 15004;    // UDP: the ping's number alone, to group_ip
constexpr std::uint16_t http_port = 15080;     // GET and PUT /range; PUT /receivers
constexpr protocol::Ipv4 group_ip{239, 255, 42, 1};
constexpr std::size_t part_bytes = 1000;  // bytes of samples in a datagram, after "PING number part parts\n"

/// The sonar of this make pings at 20 Hz while it has a client or a receiver.
const protocol::Vendor& made_up_vendor();

}  // namespace sonar::testing_daemon
