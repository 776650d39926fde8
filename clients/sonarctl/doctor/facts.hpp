// What doctor found out, before anybody says what it means. Gathered by gather.cpp from sockets and /proc, judged by judge.cpp.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/net.hpp"
#include "protocol/control/operations.hpp"

namespace sonar::clients::doctor {

/// A socket of this computer and whose it is. pid 0: of another user, or in another container.
struct PortHolder {
  std::string at;  // "127.0.0.2:52100"
  int pid = 0;
  std::string program;
};

struct HeardStatus {
  std::string from;        // source of the datagram
  std::string advertised;  // the address inside, where drivers connect
  std::string client;      // who is connected, says it; empty = nobody
  std::uint32_t device_id = 0;
  std::size_t size = 0;
  std::vector<std::string> complaints;  // what real drivers would object to
};
struct StatusFacts {
  Endpoint on{"0.0.0.0", 52102};
  std::string error;                // why it could not be listened for; empty = it could
  std::vector<PortHolder> holders;  // of the port, when it could not
  std::vector<HeardStatus> heard;   // one for each pair of addresses
  double waited_s = 0;
};

struct StreamFacts {
  enum class Outcome { not_tried, refused, unreachable, closed_without_a_byte, no_ping, pings } outcome = Outcome::not_tried;
  std::string error;   // of the connection, or of the greeting
  bool asked = false;  // settings were sent: nobody else was connected
  std::uint64_t junk_bytes = 0, dummies = 0;
  double first_ping_ms = 0, waited_s = 0;
  unsigned beams = 0, rows = 0, bits = 0;
  std::uint64_t pings = 0, missing = 0, broken = 0;
  std::string first_complaint;  // of the broken ones
  double asked_hz = 0, rate_hz = 0;
  // The spread of the delays, from the pings' own stamps: how much later than the promptest.
  std::optional<double> spread_p99_ms;
  // From the transmit instant to the last byte here, and how far the clocks differ, both from the control stream's events.
  std::optional<double> latency_p50_ms, latency_p99_ms;
  std::optional<double> computing_ms;  // of one ping, the median, from the same events
};
struct SonarFacts {
  Endpoint at;
  bool blueview = false;   // a BlueView head, no Oculus
  std::string name;        // from the control stream; empty = not known
  std::string unresolved;  // why its name has no address
  bool on_this_host = false;
  bool time_was_over = false;                // not looked at for that
  std::vector<std::string> clients;          // connected already, before us
  std::vector<PortHolder> listeners;         // of its port, on this computer
  std::optional<control::SonarStatus> says;  // after the pings
  StreamFacts stream;
};

struct ControlFacts {
  Endpoint at;
  bool given = false;        // by the user: then it should answer
  std::string error;         // why there is no status
  bool wants_token = false;  // that is why, and none was given
  std::optional<control::DaemonStatus> status;
  std::optional<double> clock_ahead_s;  // the daemon's clock against ours, other computers only
};
struct HttpFacts {
  enum class Place {
    asked,
    not_served,      // the daemon says so
    only_over_there  // on loopback of another computer
  } place = Place::asked;
  Endpoint at;
  bool given = false;
  int code = 0;  // 0 = no answer
  std::string text;
};
struct BlueViewHead {
  std::string at, model, serial;
};
/// sysctl values of the computer doctor runs on.
struct KernelPorts {
  bool known = false;
  int low = 0, high = 0;  // ports of outgoing connections
  std::string reserved;   // "52100,52102" or with ranges
};

struct Facts {
  bool address_given = false;
  std::vector<SonarFacts> sonars;
  StatusFacts status;
  ControlFacts control;
  HttpFacts http;
  KernelPorts kernel_ports;
  std::vector<BlueViewHead> heads;
  std::vector<PortHolder> daemons;  // sonards of this computer, a line for each data port
};

}  // namespace sonar::clients::doctor
