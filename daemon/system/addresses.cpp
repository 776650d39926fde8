#include "daemon/system/addresses.hpp"

#include "core/text/decimal.hpp"

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
