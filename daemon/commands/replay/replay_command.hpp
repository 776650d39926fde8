// The options of `sonard replay`, and the command.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.hpp"

namespace CLI {
class App;
}

namespace sonar {

struct ReplayCommand {
  static constexpr const char* default_page = "127.0.0.1:8088";
  std::string file, ip = "127.0.0.2", sonar, http = default_page;
  std::uint16_t port = 0, part_number = 1042;
  std::vector<std::string> status_to;
  double speed = 1, rate_hz = 10;
  bool stepped = false, loop = false, json = false;
};

void add_replay_options(CLI::App& app, ReplayCommand& replay);
/// Serves until a driver has received the whole recording, or until SIGINT or SIGTERM. With `loop`, and for recordings of scans,
/// only a signal ends the replay.
Result<void> run_replay(const ReplayCommand& command);

}  // namespace sonar
