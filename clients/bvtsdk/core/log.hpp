// The SDK's log: one line per message, filtered by level, to stdout, stderr, a file or nowhere (BVTLogger_*). As in the SDK, the
// process has one log; any thread may write.
#pragma once

#include <string>

namespace sonar::bvt {

enum class LogLevel { none = -1, critical = 0, warning = 1, status = 2 };

void log(LogLevel level, const std::string& line);

/// Sets the level; messages above it are dropped. The initial level is warning.
void set_log_level(LogLevel level);
/// Sets where the log goes: "stdout", "stderr" (the initial value), "null" or the name of a file, to which lines are appended.
/// Returns false if the file cannot be opened; then nothing changes.
bool set_log_target(const std::string& name);

}  // namespace sonar::bvt
