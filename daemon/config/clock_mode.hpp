// The modes of the daemon's time, and their names in configurations, on command lines and in the status.
#pragma once

#include <array>
#include <string_view>

namespace sonar {

enum class ClockMode {
  realtime,  // UNIX time that never jumps
  stepped,   // simulated: advances to the next tick when every client has received the last ping
  lockstep,  // like stepped, but only as far as control requests (Step) allow
  follow,    // like stepped, but only as far as the stamps of the vehicles' poses allow
};
inline constexpr std::array<std::string_view, 4> clock_modes = {"realtime", "stepped", "lockstep", "follow"};
inline constexpr std::string_view name_of(ClockMode mode) { return clock_modes[static_cast<std::size_t>(mode)]; }

}  // namespace sonar
