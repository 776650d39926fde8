#include "daemon/config/addresses.hpp"

#include "core/text/ipv4.hpp"

namespace sonar {

std::string text_of(Ipv4 ip) { return text::format_ipv4(ip); }
std::string text_of(Endpoint endpoint) { return text_of(endpoint.ip) + ":" + std::to_string(endpoint.port); }
bool is_loopback(Ipv4 ip) { return ip[0] == 127; }

std::string why_not_of_a_computer(Ipv4 ip) {
  if (ip[0] < 224 && ip != Ipv4{127, 255, 255, 255}) return {};
  return text_of(ip) + " is a multicast, broadcast or reserved address; give an address of this computer";
}

bool AddressRange::contains(Ipv4 address) const {
  for (int bit = 0; bit < prefix_bits; ++bit) {
    const auto byte = static_cast<std::size_t>(bit / 8);
    const int mask = 0x80 >> (bit % 8);
    if ((address[byte] & mask) != (ip[byte] & mask)) return false;
  }
  return true;
}

Result<Ipv4> parse_ipv4(std::string_view text) {
  if (const auto ip = text::parse_ipv4(text)) return *ip;
  return failure(ErrorKind::config, std::string("\"").append(text).append("\" is not an IPv4 address such as 127.0.0.2"));
}

}  // namespace sonar
