// IPv4 addresses, endpoints and ranges as they stand in a configuration.
#include "core/text/decimal.hpp"
#include "daemon/config.hpp"

namespace sonar {

std::string text_of(Ipv4 ip) {
  return std::to_string(ip[0]) + "." + std::to_string(ip[1]) + "." + std::to_string(ip[2]) + "." + std::to_string(ip[3]);
}
std::string text_of(Endpoint endpoint) { return text_of(endpoint.ip) + ":" + std::to_string(endpoint.port); }
bool is_loopback(Ipv4 ip) { return ip[0] == 127; }

bool AddressRange::contains(Ipv4 address) const {
  for (int bit = 0; bit < prefix_bits; ++bit) {
    const auto byte = static_cast<std::size_t>(bit / 8);
    const int mask = 0x80 >> (bit % 8);
    if ((address[byte] & mask) != (ip[byte] & mask)) return false;
  }
  return true;
}

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

Result<Ipv4> parse_ipv4(std::string_view text) {
  const auto wrong = [&] {
    return failure(ErrorKind::config, std::string("\"").append(text).append("\" is not an IPv4 address such as 127.0.0.2"));
  };
  Ipv4 ip{};
  std::string_view rest = text;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t dot = i < 3 ? rest.find('.') : rest.size();
    if (dot == std::string_view::npos) return wrong();
    const auto number = text::parse_integer(rest.substr(0, dot));
    if (!number || *number < 0 || *number > 255) return wrong();
    ip[i] = static_cast<std::uint8_t>(*number);
    rest.remove_prefix(i < 3 ? dot + 1 : dot);
  }
  return ip;
}

}  // namespace sonar
