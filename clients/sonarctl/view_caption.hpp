// The line under a picture: ping number, geometry, rate and number of missed pings. No I/O.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

#include "clients/sonarctl/ping_log.hpp"

namespace sonar::clients {

class ViewCaption {
 public:
  /// `rate_unit`: that of the sonar's make.
  explicit ViewCaption(std::string_view rate_unit) : rate_unit_(rate_unit) {}
  /// `of_wire`: counts of the host after the ping, if it has any.
  void add(const HostPing& ping, const std::optional<protocol::Host::Counts>& of_wire, Seconds at);
  std::uint64_t pings() const { return pings_; }
  /// "ping 123 10.00 m 2.1 MHz 512 beams x 437 rows 10.0 Hz no gaps"; with the rate from the second ping on.
  std::string text() const;

 private:
  static constexpr std::size_t remembered = 20;  // arrivals that determine the rate
  std::string rate_unit_;
  std::optional<std::uint64_t> missed_;
  std::deque<Seconds> arrivals_;
  std::uint64_t pings_ = 0;
  std::string ping_text_;
};

}  // namespace sonar::clients
