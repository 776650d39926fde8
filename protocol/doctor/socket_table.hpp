// Parses the text of the kernel's tables of TCP and UDP sockets: /proc/net/tcp, /proc/net/snmp (Linux, proc(5)).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace sonar::doctor {

struct SocketLine {
  std::string local_host, remote_host;  // such as "127.0.0.2", also if mapped to IPv6, or "[fe80::1]"
  std::uint16_t local_port = 0, remote_port = 0;
  int state = 0;  // the kernel's number of the state
  std::uint64_t inode = 0;
};
inline constexpr int established = 1, syn_sent = 2, listening = 10;

/// Reads the lines of /proc/net/tcp, tcp6, udp or udp6; skips the header and unreadable lines.
std::vector<SocketLine> parse_proc_net(std::string_view text);

/// Returns AttemptFails of /proc/net/snmp: the number of outgoing TCP connections since the computer started that were refused or
/// never answered.
std::uint64_t failed_attempts(std::string_view text);

}  // namespace sonar::doctor
