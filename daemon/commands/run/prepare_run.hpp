// The steps of a run before the first socket is opened. `sonard run` begins with these steps and `sonard check` does nothing
// else, so both commands report the same errors.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/base/parallel.hpp"
#include "daemon/commands/options/command_line.hpp"
#include "daemon/commands/options/load_progress.hpp"
#include "daemon/config/load_config.hpp"
#include "daemon/server/app.hpp"
#include "daemon/server/engine/start_engine.hpp"

namespace sonar {

struct PreparedRun {
  FoundConfig found;
  std::shared_ptr<const Scene> scene;
  std::unique_ptr<Parallel> pool;  // pool of the engines
  EngineFactory make_engine;
  std::unique_ptr<PingEngine> engine;  // engine of the scene
  std::string token_warning;           // warning of Token::read(); empty = the file is safe
};

/// Loads the configuration, applies the command line, checks token and journal, loads the scene and makes the engine. Sets `json`
/// if later errors must be JSON. `say_with` returns the function that reports a long load.
Result<PreparedRun> prepare_run(const RunCommand& command, bool& json,
                                const std::function<LoadProgress::Say(const Config&)>& say_with);

// Lines that sonard prints on stderr when it is ready and when it ends.

struct BannerFacts {
  std::string config_line;  // the source of the configuration
  double scene_ms = 0;      // time to load the scene and build the engine
};
std::string banner(const App& app, const BannerFacts& facts);
std::string ready_line(const App& app, double seconds);
/// Returns one line per sonar, such as "sonar front  20 pings, 20 served, ...", and lines about poses, if any came, and memory.
std::string summary(const App& app);
/// Returns one line per client stream.
std::string digest_lines(const App& app);

}  // namespace sonar
