// sonarctl record: the vendor's bytes of a sonar into files, as its client, or out of one recording into others.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/control/control_client.hpp"

namespace sonar::clients {

struct RecordOptions {
  SourceOptions source;  // a device; or source.recording, a recording of any kind
  bool triggered = false;
  std::filesystem::path pcap, mcap, oculus, raw;  // at least one
  double seconds = 0;                             // 0 = no limit
  std::uint64_t pings = 0;                        // 0 = no limit
  bool status = true;                             // listen for the device's status datagrams, too
  Endpoint status_on{"0.0.0.0", 52102};           // where
  std::string sonar;                              // which of a recording's
  std::optional<ControlOptions> control;          // ask this sonard for the sonar's name and poses, for the MCAP file
};
/// Ends well by the limits, by Ctrl-C, or at the end of a recording. However it ends, what was recorded is in the files.
Result<void> record(const RecordOptions& options);

}  // namespace sonar::clients
