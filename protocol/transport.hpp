// The ports of an emulated device, and requests over HTTP.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/dialogue.hpp"

namespace sonar::protocol {

/// A port of the device. A vendor may have several ports of a kind, but only one beacon.
struct Port {
  enum class Kind {
    tcp_stream,    // listens at `number`; each connection has a Dialogue; observers use the vendor's first such port
    udp_beacon,    // sends Vendor::beacon to `number` of the configured addresses: broadcast, multicast or hosts
    udp_answer,    // passes datagrams that arrive at `number`, including broadcasts, to Vendor::on_datagram
    udp_stream,    // sends Vendor::datagrams of each ping from `number` (0: any; may equal that of a udp_answer) to the receivers
    http,          // serves Vendor::on_http at `number`
    udp_dialogue,  // has one Dialogue at `number`, with the host that sent the last request, which gets Vendor::datagrams
  } kind{};
  std::uint16_t number = 0;
  std::string_view carries = {};        // text for users about the data at this port, such as "settings, pings"
  bool has_pings = true;                // tcp_stream: false = its connections get no pings, only answers to commands
  std::chrono::milliseconds period{0};  // period of a beacon
  bool on_change = false;               // true: the beacon is also sent when a client connects or leaves
  Endpoint group{};                     // receiver of a udp_stream until SetReceivers, often a multicast group; port 0 = none
  bool any_group = false;               // true: receivers of a udp_stream may be groups that are not in the configuration
  /// udp_stream: shortest time between two datagrams of a ping. tcp_stream: pause between the parts of a ping;
  /// Vendor::datagrams returns the parts, Vendor::frame the whole.
  std::chrono::nanoseconds gap{0};
};

/// An address at which a driver connects to a sonar.
struct DriverAddress {
  std::string_view protocol;  // "tcp", "udp", "http", "multicast", "status": status messages, over UDP
  Endpoint at;
  std::string_view carries;         // equals Port::carries
  bool sonar_speaks_first = false;  // false: the driver sends first
};

/// One request for a resource of the device. The server has limited its sizes.
struct ResourceRequest {
  std::string method, path, query, content_type, body;  // path without the query: "/api/v1/speed"
  Ipv4 from{};
};
struct ResourceReply {
  unsigned status = 200;
  std::string body;
  std::string content_type = "application/json";
  std::string allow = {};  // Allow header of status 405
  std::vector<Event> events = {};
};

}  // namespace sonar::protocol
