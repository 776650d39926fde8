// Reads and prints IPv4 addresses, endpoints and ranges in configurations, command lines and log lines.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

using protocol::Endpoint;
using protocol::Ipv4;

struct AddressRange {  // such as 10.0.0.0/8
  Ipv4 ip{};
  int prefix_bits = 32;
  bool contains(Ipv4 address) const;
};
std::string text_of(Ipv4 ip);
std::string text_of(Endpoint endpoint);
bool is_loopback(Ipv4 ip);
/// Returns an error if no computer can have this address, because it is multicast, broadcast or reserved; else empty.
std::string why_not_of_a_computer(Ipv4 ip);
/// Parses an address. Error config: a sentence that shows a valid address.
Result<Ipv4> parse_ipv4(std::string_view text);

}  // namespace sonar
