// Options of the clock, the log and the queues of pings, and their names in configurations, on command lines and in the status.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>

namespace sonar {

/// The modes of the daemon's time.
enum class ClockMode {
  realtime,  // UNIX time that never jumps
  stepped,   // simulated: advances to the next tick when every client has received the last ping
  lockstep,  // like stepped, but only as far as control requests (Step) allow
  follow,    // like stepped, but only as far as the stamps of the vehicles' poses allow
};
inline constexpr std::array<std::string_view, 4> clock_modes = {"realtime", "stepped", "lockstep", "follow"};
inline constexpr std::string_view name_of(ClockMode mode) { return clock_modes[static_cast<std::size_t>(mode)]; }

enum class LogLevel { debug, info, warning, error };
inline constexpr std::array<std::string_view, 4> log_levels = {"debug", "info", "warning", "error"};

/// Settings of the log (daemon/server/system/log.hpp).
struct LogOptions {
  LogLevel level = LogLevel::info;
  bool json = false;
  std::function<void(LogLevel, const std::string&)> sink;  // replaces stderr, for tests
};

enum class WhenFull { replace_oldest, drop_newest };
inline constexpr std::array<std::string_view, 2> when_full_names = {"replace_oldest", "drop_newest"};

/// Limits of the pings queued for a client (daemon/emulator/connections/outbox.hpp).
struct OutboxRules {
  static constexpr int deepest = 3;
  int depth = 1;  // waiting pings besides the current message, 1..deepest
  WhenFull when_full = WhenFull::replace_oldest;
  bool operator==(const OutboxRules&) const = default;
};

}  // namespace sonar
