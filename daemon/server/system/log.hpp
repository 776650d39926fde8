// One line per event: a short phrase, then key=value, or an object of JSON. The daemon reports only through it; it uses spdlog.
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
  /// Banner and summary, which no level holds back. As they stand in the text format; in JSON a message each line.
  void announce(std::string_view lines);
  /// Gets the text of each line from info on, whatever the log's own level; empty = none.
  using Listener = std::function<void(LogLevel level, const std::string& line, const std::vector<LogField>& fields)>;
  void listen(Listener listener) { listener_ = std::move(listener); }

 private:
  void emit(LogLevel level, std::string_view phrase, const std::vector<LogField>& fields);
  LogOptions options_;
  Listener listener_;
  struct Sink;
  std::unique_ptr<Sink> sink_;
};

/// For what an outsider can provoke: five lines at once, then one a second.
class LogLimiter {
 public:
  using Clock = std::chrono::steady_clock;
  /// True: say it. `unsaid` receives how many were swallowed since the last line.
  bool allows(Clock::time_point now, std::uint64_t& unsaid);

 private:
  double tokens_ = 5;
  Clock::time_point last_{};
  std::uint64_t swallowed_ = 0;
};

/// Says a line as often as its limiter allows; one after others that were swallowed says how many.
void log_limited(Log& log, LogLimiter& limiter, LogLevel level, std::string_view phrase, std::vector<LogField> fields = {});
/// Reports a mistake in sonard; `where`: the sonar, listener or connection.
void log_fault(Log& log, LogLimiter& limiter, const std::string& what, const LogField& where);

}  // namespace sonar
