// Opens a recording for a viewer; reading stops when the viewer leaves.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/result.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar {

/// The recording that is played.
struct PlayedRecording {
  std::filesystem::path file;
  std::string sonar = {};             // selects one of several sonars, like --sonar of `sonard replay`
  double rate_hz = 10;                // rate of files that store no times
  std::filesystem::path within = {};  // folder that must contain the file, after following symbolic links; empty = any
};

/// Set when the viewer has left; another thread reads the recording.
using ViewerLeft = std::shared_ptr<std::atomic<bool>>;

/// Opens a recording. Errors: those of open_recording(), with the file's name; missing_file for a symbolic link out of the
/// folder. After `left` is set, this call and the pings throw, because the search for the next ping could read gigabytes, such as
/// zeros that a power cut left at the end.
Result<recording::RecordedPings> open_pings(const PlayedRecording& wanted, const ViewerLeft& left);

}  // namespace sonar
