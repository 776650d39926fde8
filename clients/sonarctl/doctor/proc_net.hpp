// Sockets of this computer by /proc/net, and their programs as far as /proc is readable. Used by doctor to name the program that
// holds a port.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "clients/sonarctl/doctor/facts.hpp"

namespace sonar::clients::doctor {

struct SocketLine {
  std::string local_host, remote_host;  // "127.0.0.2"; IPv6 in brackets, but addresses of IPv4 as such
  std::uint16_t local_port = 0, remote_port = 0;
  int state = 0;  // as the kernel numbers them: 1 established, 10 listening
  std::uint64_t inode = 0;
};
inline constexpr int established = 1, listening = 10;

/// Lines of /proc/net/tcp, tcp6, udp or udp6; the header and unreadable lines are skipped.
std::vector<SocketLine> parse_proc_net(std::string_view text);

/// Of all sockets, IPv4 and IPv6. Empty where there is no /proc.
std::vector<SocketLine> tcp_sockets();
std::vector<SocketLine> udp_sockets();

/// Program by socket inode, without those of other users.
struct Program {
  int pid = 0;
  std::string name;
};
std::map<std::uint64_t, Program> programs_by_socket();

PortHolder holder_of(const SocketLine& socket, const std::map<std::uint64_t, Program>& programs);

}  // namespace sonar::clients::doctor
