// Finds the strongest echo in a ping of one beam, and derives from it the range and gain of the next ping, for the family's range
// finders. unknown: the algorithms of real devices; all of this is assumed (docs/protocols/ping1d.md).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/sonar/ping.hpp"
#include "protocol/held_settings.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::ping {

inline constexpr double nearest_echo_m = 0.3;
inline constexpr std::uint32_t shortest_range_mm = 1000;

/// The messages to be made from a ping, as bits.
using Results = unsigned;
inline constexpr Results no_result = 0;
/// Returns the messages for the results `wanted`, in order, made from a recorded message of the result `own`; for no_result, only
/// the recorded message. `make` makes the message of another result.
template <class Make>
std::vector<wire::Bytes> messages_for(Results wanted, wire::BytesView recorded, Results own, Make make) {
  if (wanted == no_result) wanted = own;
  std::vector<wire::Bytes> messages;
  for (Results one = 1; one <= wanted; one <<= 1)
    if ((wanted & one) != 0) messages.push_back(one == own ? wire::Bytes(recorded.begin(), recorded.end()) : make(one));
  return messages;
}

struct Echo {
  double range_m = 0;  // range that the device computes
  double peak = 0;     // the highest amplitude; 255 is full scale
  int confidence = 0;  // per cent
};
/// Finds the strongest echo of a profile. Its range is that of the front of the echo, plus half a pulse.
Echo find_echo(const Ping& ping);
/// Returns the echo among the findings of the ping; computes it if there is none.
inline Echo echo_in(const Ping& ping) { return protocol::found_in(ping, find_echo); }

/// The range of a ping, counted from the sonar, and its gain.
struct Reach {
  std::uint32_t length_mm = 0;
  int gain = 0;  // index of a gain
};
struct ReachLimits {
  std::span<const double> gains;  // amplification factors in increasing order
  std::uint32_t most_mm = 0;
};
/// Returns range and gain of the next ping, after a ping with `made_with` in which `echo` was found.
Reach adjusted(const Reach& made_with, const Echo& echo, const ReachLimits& limits);

}  // namespace sonar::ping
