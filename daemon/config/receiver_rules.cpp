#include "daemon/config/receiver_rules.hpp"

#include <algorithm>

namespace sonar {
namespace {

bool is_multicast(const Ipv4& ip) { return ip[0] >> 4 == 0xE; }

bool is_broadcast(const Ipv4& ip, const SonarConfig& sonar) {
  constexpr unsigned first_reserved = 240;  // from here on, addresses do not belong to single computers
  if (ip[0] >= first_reserved || ip == Ipv4{127, 255, 255, 255}) return true;
  bool broadcast = sonar.netmask != Ipv4{255, 255, 255, 255};
  for (std::size_t i = 0; i < ip.size(); ++i)
    broadcast = broadcast && ip[i] == static_cast<std::uint8_t>(sonar.bind_ip[i] | static_cast<std::uint8_t>(~sonar.netmask[i]));
  return broadcast;
}

}  // namespace

bool may_receive(const Ipv4& ip, const protocol::Port& port, const SonarConfig& sonar) {
  const bool multicast = is_multicast(ip);
  if (!multicast && !is_broadcast(ip, sonar)) return true;
  if (ip == port.group.ip || (multicast && port.any_group)) return true;
  return std::find(sonar.groups.begin(), sonar.groups.end(), ip) != sonar.groups.end();
}

}  // namespace sonar
