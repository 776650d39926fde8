// The options of `sonarctl record`: source, files and limits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/control_client.hpp"

namespace sonar::clients {

struct RecordOptions {
  SourceOptions source;                                     // a device; or source.recording, a recording of any kind
  std::filesystem::path pcap, mcap, raw;                    // at least one of these or of `files`
  std::map<std::string_view, std::filesystem::path> files;  // files of a make's own kinds, by FileKind::ending
  double seconds = 0;                                       // 0 = no limit
  std::uint64_t pings = 0;                                  // 0 = no limit
  bool status = true;                                       // also record the status datagrams of the device
  std::string status_on;                  // address for receiving status: HOST:PORT; empty = 0.0.0.0 and the make's port
  std::optional<ControlOptions> control;  // the sonard that reports the sonar's name and poses, for the MCAP file
};

}  // namespace sonar::clients
