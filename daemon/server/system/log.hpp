// The daemon's log, which uses spdlog: one line per event, either a short phrase and key=value pairs, or a JSON object.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/emulator/log_line.hpp"

namespace sonar {

class Log {
 public:
  explicit Log(LogOptions options = {});
  ~Log();
  void debug(std::string_view phrase, const std::vector<LogField>& fields = {}) { write(LogLevel::debug, phrase, fields); }
  void info(std::string_view phrase, const std::vector<LogField>& fields = {}) { write(LogLevel::info, phrase, fields); }
  void warning(std::string_view phrase, const std::vector<LogField>& fields = {}) { write(LogLevel::warning, phrase, fields); }
  void error(std::string_view phrase, const std::vector<LogField>& fields = {}) { write(LogLevel::error, phrase, fields); }
  void write(LogLevel level, std::string_view phrase, const std::vector<LogField>& fields);
  /// Writes banner or summary at any log level; in JSON, each line is a message.
  void announce(std::string_view lines);
  /// Sets a function that is called with each line of level info or above, at any log level; empty = none.
  using Listener = std::function<void(LogLevel level, const std::string& line, const std::vector<LogField>& fields)>;
  void listen(Listener listener) { listener_ = std::move(listener); }

 private:
  void emit(LogLevel level, std::string_view phrase, const std::vector<LogField>& fields);
  LogOptions options_;
  Listener listener_;
  struct Sink;
  std::unique_ptr<Sink> sink_;
};

/// Limits lines that clients can cause: five at once, then one per second.
class LogLimiter {
 public:
  using Clock = std::chrono::steady_clock;
  /// Returns true if the line should be written. Then `suppressed` is the number of lines
  /// suppressed since the last written line.
  bool allows(Clock::time_point now, std::uint64_t& suppressed);

 private:
  double tokens_ = 5;
  Clock::time_point last_{};
  std::uint64_t suppressed_ = 0;
};

/// Writes a line if the limiter allows it. The first line after suppressed lines states their number.
void log_limited(Log& log, LogLimiter& limiter, LogLevel level, std::string_view phrase, std::vector<LogField> fields = {});
/// Reports a bug of sonard; `where`: the sonar, listener or connection.
void log_fault(Log& log, LogLimiter& limiter, const std::string& what, const LogField& where);

}  // namespace sonar
