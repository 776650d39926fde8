// Settings of the log (daemon/server/system/log.hpp).
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>

namespace sonar {

enum class LogLevel { debug, info, warning, error };
inline constexpr std::array<std::string_view, 4> log_levels = {"debug", "info", "warning", "error"};

struct LogOptions {
  LogLevel level = LogLevel::info;
  bool json = false;
  std::function<void(LogLevel, const std::string&)> sink;  // instead of stderr: tests
};

}  // namespace sonar
