// Lists the sockets of this computer from /proc/net, and their programs as far as /proc is readable.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "clients/sonarctl/doctor/facts.hpp"
#include "protocol/doctor/socket_table.hpp"

namespace sonar::clients::doctor {

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
