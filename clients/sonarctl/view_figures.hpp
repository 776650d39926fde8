// The line under a picture: which ping, what of it, how often they come and how many were missed. Fed by view, pure.
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "clients/sonarctl/ping_log.hpp"

namespace sonar::clients {

class ViewFigures {
 public:
  void add(const AnyPing& ping, Seconds at);
  std::uint64_t pings() const { return pings_; }
  /// "ping 123  10.00 m  2.1 MHz  512 beams x 437 rows  10.0 Hz  no gaps"; the rate from the second ping on.
  std::string text() const;

 private:
  static constexpr std::size_t remembered = 20;  // arrivals the rate is taken from
  oculus::PingSequence sequence_;
  bool has_sequence_ = false;  // not of heads, whose numbers may skip
  std::deque<Seconds> arrivals_;
  std::uint64_t pings_ = 0;
  std::string ping_text_;
};

}  // namespace sonar::clients
