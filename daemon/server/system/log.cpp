#include "daemon/server/system/log.hpp"

#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/program_start.hpp"

namespace sonar {
namespace {

constexpr std::size_t longest_line = 3900;  // writes to a pipe are atomic up to 4096 bytes

/// Returns a JSON string. Bytes that are not UTF-8, which file names may contain, are replaced.
std::string json_string(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Replaces control characters with '?' and quotes values with spaces, so that text from outside cannot forge lines.
std::string plain(std::string_view text, bool quote_spaces) {
  std::string out(text);
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  const bool quote = quote_spaces && (out.empty() || out.find_first_of(" \"=") != std::string::npos);
  return quote ? json_string(out) : out;
}

std::string text_line(std::string_view phrase, const std::vector<LogField>& fields) {
  std::string line = plain(phrase, false);
  for (const LogField& f : fields) line.append("  ").append(f.key).append("=").append(plain(f.value, true));
  return line;
}
std::string json_members(std::string_view phrase, const std::vector<LogField>& fields) {
  std::string line = "\"message\":";
  line.append(json_string(phrase));
  for (const LogField& f : fields) line.append(",").append(json_string(f.key)).append(":").append(json_string(f.value));
  return line;
}

spdlog::level::level_enum spdlog_level(LogLevel level) {
  switch (level) {
    case LogLevel::debug:
      return spdlog::level::debug;
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    default:
      return spdlog::level::err;
  }
}

}  // namespace

struct Log::Sink {
  spdlog::logger logger{"sonard", std::make_shared<spdlog::sinks::stderr_color_sink_st>()};
  std::uint64_t lost = 0;  // lines dropped because the output was blocked; the next written line reports their number
};

Log::Log(LogOptions options) : options_(std::move(options)) {
  if (options_.sink) return;
  sink_ = std::make_unique<Sink>();
  sink_->logger.set_level(spdlog::level::debug);  // write() drops the lines below options_.level
  sink_->logger.set_pattern(options_.json ? R"({"time":"%Y-%m-%dT%H:%M:%S.%f%z","level":"%l",%v})"
                                          : "%Y-%m-%d %H:%M:%S.%e %^%l%$  %v");
}
Log::~Log() = default;

void Log::write(LogLevel level, std::string_view phrase, const std::vector<LogField>& fields) {
  if (level >= options_.level) emit(level, phrase, fields);
  if (listener_ && level >= LogLevel::info) listener_(level, text_line(phrase, fields), fields);
}

void Log::announce(std::string_view lines) {
  if (!options_.json && !options_.sink) {
    std::fwrite(lines.data(), 1, lines.size(), stderr);
    return;
  }
  while (!lines.empty()) {
    const std::string_view line = lines.substr(0, lines.find('\n'));
    lines.remove_prefix(std::min(lines.size(), line.size() + 1));
    const std::size_t first = line.find_first_not_of(' ');  // continuation lines are indented
    if (first != std::string_view::npos) emit(LogLevel::info, line.substr(first), {});
  }
}

void Log::emit(LogLevel level, std::string_view phrase, const std::vector<LogField>& fields) {
  if (options_.sink) {
    options_.sink(level, text_line(phrase, fields));
    return;
  }
  // A slow reader of the log must not delay clients.
  if (sink_->lost > 0 && !standard_error_is_blocked()) {
    const std::uint64_t lost = std::exchange(sink_->lost, 0);
    emit(LogLevel::warning, "log lines dropped: output blocked", {{"lines", lost}});
  }
  if (standard_error_is_blocked()) {
    ++sink_->lost;
    return;
  }
  // A text line is truncated, so that the write to a pipe is atomic. A JSON line is not truncated, because the result would not
  // be JSON.
  std::string line = options_.json ? json_members(phrase, fields) : text_line(phrase, fields);
  if (!options_.json && line.size() > longest_line) line.replace(longest_line, std::string::npos, "...");
  sink_->logger.log(spdlog_level(level), spdlog::string_view_t(line));
}

bool LogLimiter::allows(Clock::time_point now, std::uint64_t& suppressed) {
  // A token bucket: one token per second, at most five; each line needs one.
  if (last_ != Clock::time_point{}) tokens_ = std::min(5.0, tokens_ + std::chrono::duration<double>(now - last_).count());
  last_ = now;
  if (tokens_ < 1) {
    ++suppressed_;
    return false;
  }
  tokens_ -= 1;
  suppressed = std::exchange(suppressed_, 0);
  return true;
}

void log_limited(Log& log, LogLimiter& limiter, LogLevel level, std::string_view phrase, std::vector<LogField> fields) {
  std::uint64_t suppressed = 0;
  if (!limiter.allows(LogLimiter::Clock::now(), suppressed)) return;
  if (suppressed > 0) fields.emplace_back("suppressed", suppressed);
  log.write(level, phrase, fields);
}

void log_fault(Log& log, LogLimiter& limiter, const std::string& what, const LogField& where) {
  log_limited(log, limiter, LogLevel::error, "internal fault: " + what + " (please report it)", {where});
}

}  // namespace sonar
