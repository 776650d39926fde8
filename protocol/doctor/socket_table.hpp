// The kernel's tables of TCP and UDP sockets as text: /proc/net/tcp, /proc/net/snmp (Linux, proc(5)). Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace sonar::doctor {

struct SocketLine {
  std::string local_host, remote_host;  // "127.0.0.2"; IPv6 in brackets; mapped IPv4 addresses as IPv4
  std::uint16_t local_port = 0, remote_port = 0;
  int state = 0;  // the kernel's number
  std::uint64_t inode = 0;
};
inline constexpr int established = 1, syn_sent = 2, listening = 10;

/// Lines of /proc/net/tcp, tcp6, udp or udp6; the header and unreadable lines are skipped.
std::vector<SocketLine> parse_proc_net(std::string_view text);

/// AttemptFails of /proc/net/snmp: outgoing TCP connections that were refused or never answered, since the computer started.
std::uint64_t failed_attempts(std::string_view text);

}  // namespace sonar::doctor
