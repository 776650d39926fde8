#include "clients/bvtsdk/core/log.hpp"

#include <cstdio>
#include <mutex>

namespace sonar::bvt {
namespace {

struct Log {
  std::mutex mutex;
  LogLevel level = LogLevel::warning;
  std::FILE* target = stderr;
  bool owned = false;

  void set_target(std::FILE* file, bool own) {
    if (owned) std::fclose(target);
    target = file;
    owned = own;
  }
};

// The log is never destroyed, because other threads of the program may still log while the process ends.
Log& the_log() {
  static Log& log = *new Log;
  return log;
}

}  // namespace

void log(LogLevel level, const std::string& line) {
  Log& out = the_log();
  const std::lock_guard lock(out.mutex);
  if (level == LogLevel::none || level > out.level || !out.target) return;
  std::fprintf(out.target, "bvtsdk: %s\n", line.c_str());
  std::fflush(out.target);
}

void set_log_level(LogLevel level) {
  const std::lock_guard lock(the_log().mutex);
  the_log().level = level;
}

bool set_log_target(const std::string& name) {
  Log& out = the_log();
  const std::lock_guard lock(out.mutex);
  if (name == "stdout" || name == "stderr" || name == "null") {
    out.set_target(name == "stdout" ? stdout : name == "stderr" ? stderr : nullptr, false);
    return true;
  }
  std::FILE* file = name.empty() ? nullptr : std::fopen(name.c_str(), "ae");
  if (!file) return false;
  out.set_target(file, true);
  return true;
}

}  // namespace sonar::bvt
