// What follows from a sonar's own address, and moving it to another one.
#include "daemon/config/config.hpp"

namespace sonar {

void derive_addresses(SonarConfig& sonar) {
  if (!sonar.has_own_netmask) sonar.netmask = is_loopback(sonar.advertise_ip) ? Ipv4{255, 0, 0, 0} : Ipv4{255, 255, 255, 0};
  if (sonar.has_own_status_to) return;
  Endpoint broadcast;
  for (std::size_t i = 0; i < 4; ++i)
    broadcast.ip[i] = static_cast<std::uint8_t>(sonar.advertise_ip[i] | (~sonar.netmask[i] & 0xff));
  sonar.status_to = {broadcast};
}

Result<void> rebind(Config& config, std::string_view address) {
  const auto ip = parse_ipv4(address);
  if (!ip) return failure(ErrorKind::usage, ip.error().text);
  if (*ip == Ipv4{})
    return failure(
        ErrorKind::usage,
        "0.0.0.0 is no address that drivers can connect to; give one of this computer's, or write bind_ip: 0.0.0.0 and "
        "advertise_ip in a configuration file");
  SonarConfig& first = config.sonars.front();
  for (const SonarConfig& other : config.sonars)
    if (&other != &first && (other.bind_ip == *ip || other.bind_ip == Ipv4{}))
      return failure(ErrorKind::usage,
                     text_of(*ip) + " is already used by sonar \"" + other.name + "\"; each sonar needs its own address");
  first.bind_ip = first.advertise_ip = *ip;
  derive_addresses(first);
  return {};
}

}  // namespace sonar
