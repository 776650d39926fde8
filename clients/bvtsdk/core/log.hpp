// The SDK's log: one line a message, filtered by level, to stdout, stderr, a file or nowhere (BVTLogger_*). As in the SDK, the
// process has one log; any thread may write.
#pragma once

#include <string>

namespace sonar::bvt {

enum class LogLevel { none = -1, critical = 0, warning = 1, status = 2 };

void log(LogLevel level, const std::string& line);

/// Messages above this level are dropped; warning at first.
void set_log_level(LogLevel level);
/// "stdout", "stderr" (at first), "null" or the name of a file, which is appended to. False when it cannot be opened; the log
/// then stays where it was.
bool set_log_target(const std::string& name);

}  // namespace sonar::bvt
