// Opens a recording for a viewer. Reading it ends when the viewer leaves.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/result.hpp"
#include "protocol/recording/recorded_pings.hpp"

namespace sonar {

/// The recording that is played.
struct PlayedRecording {
  std::filesystem::path file;
  std::string sonar = {};             // one of several in it, as --sonar of `sonard replay`
  double rate_hz = 10;                // rate of files that store no times
  std::filesystem::path within = {};  // folder that the file must be in, wherever symbolic links lead; empty = any
};

/// Set when the viewer has left; another thread reads the recording.
using ViewerLeft = std::shared_ptr<std::atomic<bool>>;

/// Errors as of open_recording(), with the file's name; missing_file for a symbolic link out of the folder. After `left` is set,
/// this call and the pings throw: the search for the next ping may read gigabytes, such as the zeros behind the last one that a
/// power cut leaves.
Result<recording::RecordedPings> open_pings(const PlayedRecording& wanted, const ViewerLeft& left);

}  // namespace sonar
