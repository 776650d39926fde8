// IPv4 addresses as dotted text and as 32-bit numbers. Recordings, the daemon's configuration and sonarctl use them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace sonar::text {

using Ipv4 = std::array<std::uint8_t, 4>;  // 192.168.1.2 = {192, 168, 1, 2}

/// Formats an address as "192.168.1.2".
std::string format_ipv4(const Ipv4& ip);
/// Reads four decimal numbers from 0 to 255 without leading zeros; nullopt for any other text.
std::optional<Ipv4> parse_ipv4(std::string_view text);

/// Converts between addresses and numbers: 192.168.1.2 = 0xC0A80102.
constexpr std::uint32_t number_from_ipv4(const Ipv4& ip) {
  return std::uint32_t{ip[0]} << 24 | std::uint32_t{ip[1]} << 16 | std::uint32_t{ip[2]} << 8 | ip[3];
}
constexpr Ipv4 ipv4_from_number(std::uint32_t number) {
  return {static_cast<std::uint8_t>(number >> 24), static_cast<std::uint8_t>(number >> 16),
          static_cast<std::uint8_t>(number >> 8), static_cast<std::uint8_t>(number)};
}

}  // namespace sonar::text
