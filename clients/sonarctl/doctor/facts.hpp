// The observations of doctor, which gather.cpp collects from sockets and /proc and checks.cpp interprets.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/control_client.hpp"
#include "clients/sonarctl/net.hpp"
#include "protocol/control/control.hpp"
#include "protocol/host.hpp"

namespace sonar::v1 {  // from control.pb.h
class DaemonStatus;
class SonarStatus;
}  // namespace sonar::v1

namespace sonar::clients::doctor {

/// A socket of this computer and its owner. pid 0: a process of another user or in another container.
struct PortHolder {
  std::string at;  // "127.0.0.2:52100"
  int pid = 0;
  std::string program;
};

struct ReceivedStatus {
  std::string from;        // source of the datagram
  std::string advertised;  // the address in the message, to which drivers connect
  std::string client;      // connected client according to the message; empty = none
  std::uint32_t device_id = 0;
  std::size_t size = 0;
  std::vector<std::string> complaints;  // faults because of which real drivers reject the message
};
struct StatusFacts {
  Endpoint on{"0.0.0.0", 52102};
  std::string error;                     // reason if listening failed; empty = it succeeded
  std::vector<PortHolder> holders;       // programs that use the port, if listening failed
  std::vector<ReceivedStatus> received;  // one per pair of `from` and `advertised`
  double waited_s = 0;
};

struct StreamFacts {
  enum class Outcome { not_tried, refused, unreachable, closed_without_a_byte, no_ping, pings } outcome = Outcome::not_tried;
  std::string error;                         // reason if the connection or the greeting failed
  bool refuses = false;                      // true: `error` is the sonar's answer to a request
  std::string own;                           // our end of the connection; empty = there was none
  bool asked = false;                        // settings were sent, because no other client was connected
  std::uint64_t junk_bytes = 0, others = 0;  // others: messages that are not pings
  double first_ping_ms = 0, waited_s = 0;
  unsigned beams = 0, rows = 0, bits = 0;
  std::uint64_t pings = 0, missing = 0, broken = 0;
  std::string first_complaint;  // complaint about the first broken ping
  double asked_hz = 0, rate_hz = 0;
  // Delay of pings relative to the ping with the smallest delay, from their time stamps.
  std::optional<double> spread_p99_ms;
  // Time from transmission to the last received byte, from events of the control stream.
  std::optional<double> latency_p50_ms, latency_p99_ms;
  std::optional<double> computing_ms;  // median time to compute a ping, from the same events
};
struct SonarFacts {
  Endpoint at;
  const protocol::Make* make = &protocol::makes().front();
  std::string name;        // from the control stream; empty = not known
  std::string unresolved;  // reason if its host name has no address
  bool on_this_host = false;
  bool in_our_network = true;                       // an interface reaches its address without a router
  bool out_of_time = false;                         // not examined, because time ran out
  std::vector<std::string> clients;                 // clients that were connected before us
  std::vector<PortHolder> listeners;                // programs on this computer that listen on its port
  std::shared_ptr<const v1::SonarStatus> reported;  // status after the pings; null = the daemon has no such sonar
  StreamFacts stream;
};

struct ControlFacts {
  Endpoint at;
  bool given = false;                              // the user gave the address; then a missing answer is an error
  std::string error;                               // reason if there is no status
  bool token_required = false;                     // there is no status, because the daemon requires a token
  std::shared_ptr<const v1::DaemonStatus> status;  // null = there is none
  std::shared_ptr<const v1::DaemonStatus> latest;  // status after the pings; null = not requested again
  std::optional<double> clock_ahead_s;             // daemon's clock minus ours; only for another computer
};
struct HttpFacts {
  enum class Place {
    asked,
    not_served,      // according to the daemon
    only_over_there  // on the loopback of another computer
  } place = Place::asked;
  Endpoint at;
  bool given = false;
  int code = 0;  // 0 = no answer
  std::string text;
};
/// True for `sonard replay`: a recording has its own rate, and no control stream.
inline bool is_replay(const HttpFacts& http) { return http.text.starts_with(control::health_of_replay); }
/// A sonar that answered a search.
struct FoundSonar {
  const protocol::Make* make = nullptr;
  std::string at, about;  // about: "BlueView head P900-90 (7001)"
};
/// True if drivers control the sonar over HTTP and receive its images over UDP. Such a sonar has no client connections.
inline bool is_by_http(const SonarFacts& sonar) { return sonar.make->ports.front().kind == protocol::HostPort::Kind::http; }
/// True if drivers find the sonar by status messages to the port of `status`.
inline bool sends_status(const SonarFacts& sonar, const StatusFacts& status) {
  const protocol::Port* const beacon = sonar.make->device->port(protocol::Port::Kind::udp_beacon);
  return beacon != nullptr && beacon->number == status.on.port;
}

/// sysctl values of this computer.
struct KernelPorts {
  bool known = false;
  int low = 0, high = 0;  // ports of outgoing connections
  std::string reserved;   // "52100,52102" or with ranges
};

/// The kind of this machine. Broadcasts do not reach WSL2 and containers.
enum class Machine { ordinary, wsl2, container };

struct Facts {
  bool address_given = false;
  Machine machine = Machine::ordinary;
  std::vector<SonarFacts> sonars;
  StatusFacts status;
  ControlFacts control;
  HttpFacts http;
  KernelPorts kernel_ports;
  std::vector<FoundSonar> found;
  std::vector<PortHolder> daemons;  // sonard processes of this computer, one element per data port
};

struct Questions {
  std::string address;                   // HOST or HOST:PORT; empty = all sonars found, else the demo's address
  Endpoint status_on{"0.0.0.0", 52102};  // address of the status messages
  std::string control, http;             // HOST:PORT; empty = the defaults
  std::filesystem::path token_file;
  bool take = false;  // also connect to sonars that have a client
  double within_s = 8;
};

/// Gathers the facts from the network and the kernel without disturbing clients: it first lists the connected clients, then
/// connects to sonars without clients. Returns within about `within_s`. Error usage: an invalid address.
Result<Facts> gather(const Questions& questions);

}  // namespace sonar::clients::doctor
