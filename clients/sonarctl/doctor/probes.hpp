// Single queries to the network, each with a time limit.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/sonarctl/control_client.hpp"
#include "clients/sonarctl/doctor/facts.hpp"
#include "core/base/result.hpp"
#include "protocol/doctor/socket_table.hpp"

namespace sonar::clients::doctor {

using Steady = std::chrono::steady_clock;
std::chrono::milliseconds left_until(Steady::time_point deadline);

/// Resolves a host name to text such as "127.0.0.2". Errors: usage if it has no address.
Result<std::string> ipv4_of(const std::string& host);
/// Returns whether an address belongs to this computer: 127.0.0.0/8, or an address of an interface.
bool is_on_this_host(const std::string& ipv4);
/// Returns whether an interface reaches the address without a router.
bool is_in_our_network(const std::string& ipv4);
Machine this_machine();

/// True if connections to this TCP port are refused because no program listens there.
bool refuses(const Endpoint& at);

/// Receives and sorts status messages, including those that arrive during other queries.
class StatusListener {
 public:
  explicit StatusListener(const Endpoint& on);
  /// Processes received messages; waits for one from `host` (any host when it is empty) until `deadline`.
  void listen(const std::string& host, Steady::time_point deadline);
  bool has_received(const std::string& host) const;
  const StatusFacts& facts() const { return facts_; }
  void finish();

 private:
  void add(const std::string& from, std::span<const std::byte> datagram);

  std::optional<Socket> socket_;
  Steady::time_point since_ = Steady::now();
  StatusFacts facts_;
};

/// Searches for sonars of all makes that have a search message, on this computer and its networks, or only at `hosts` (IPv4).
/// receive_answers() reads the answers.
class DiscoveryQuestion {
 public:
  explicit DiscoveryQuestion(const std::vector<std::string>& hosts);
  /// Adds new sonars; waits for the first answer until `deadline`.
  void receive_answers(std::vector<FoundSonar>& found, Steady::time_point deadline) const;

 private:
  std::optional<Socket> socket_;
};

/// Requests GET /healthz.
HttpFacts ask_health(const Endpoint& at, bool given, std::chrono::milliseconds patience);

KernelPorts kernel_ports();

/// Measures delay, size, rate and latency of a sonar's pings as a driver would: connects, requests pings unless another client is
/// connected, reads at most 15 of them and disconnects. `control`: a client subscribed to pings, for transmission times; may be
/// null. `clocks` is set to the difference of the clocks.
void watch_pings(SonarFacts& sonar, ControlClient* control, Steady::time_point deadline, ControlFacts& clocks);
/// Sets the latency if it is 0 to 2 s, and the difference of the clocks. `delays_s`: times of receipt by this computer's clock
/// minus the stamps. The daemon's time, by which pings are stamped, may differ from the clock of its computer.
void set_latency(SonarFacts& sonar, std::vector<double> delays_s, ControlFacts& clocks);

// Lists the sockets of this computer from /proc/net, and their programs as far as /proc is readable.

using sonar::doctor::established;
using sonar::doctor::listening;
using sonar::doctor::parse_proc_net;
using sonar::doctor::SocketLine;

/// Returns all sockets of the computer, IPv4 and IPv6; none if there is no /proc.
std::vector<SocketLine> tcp_sockets();
std::vector<SocketLine> udp_sockets();

struct Program {
  int pid = 0;
  std::string name;
};
/// Returns the program of each socket inode. Programs of other users are missing if /proc is not readable for them.
std::map<std::uint64_t, Program> programs_by_socket();

PortHolder holder_of(const SocketLine& socket, const std::map<std::uint64_t, Program>& programs);

}  // namespace sonar::clients::doctor
