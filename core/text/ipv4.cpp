#include "core/text/ipv4.hpp"

#include "core/text/decimal.hpp"

namespace sonar::text {

std::string format_ipv4(const Ipv4& ip) {
  return std::to_string(ip[0]) + "." + std::to_string(ip[1]) + "." + std::to_string(ip[2]) + "." + std::to_string(ip[3]);
}

std::optional<Ipv4> parse_ipv4(std::string_view text) {
  Ipv4 ip{};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t end = i < 3 ? text.find('.') : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto number = parse_unsigned(text.substr(0, end));
    if (!number || *number > 255 || text.starts_with('+')) return std::nullopt;
    ip[i] = static_cast<std::uint8_t>(*number);
    text.remove_prefix(i < 3 ? end + 1 : end);
  }
  return ip;
}

}  // namespace sonar::text
