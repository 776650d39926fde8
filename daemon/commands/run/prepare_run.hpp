// The steps of a run before its first socket is opened. `sonard run` begins with them and `sonard check` does nothing else, so
// that both report the same errors.
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

/// Loads the configuration, applies the command line, checks token and journal, loads the scene and makes the engine. `json`: the
/// format of errors from then on. `say_with` returns the function for sentences about a long load.
Result<PreparedRun> prepare_run(const RunCommand& command, bool& json,
                                const std::function<LoadProgress::Say(const Config&)>& say_with);

// Lines that sonard prints on stderr when it is ready and when it ends.

struct BannerFacts {
  std::string config_line;  // where the configuration came from
  double scene_ms = 0;      // time to load the scene and build the engine
};
std::string banner(const App& app, const BannerFacts& facts);
std::string ready_line(const App& app, double seconds);
/// One line per sonar, and the memory: "sonar front  20 pings  0 dropped  0 late ticks ...".
std::string summary(const App& app);
/// One line per client stream.
std::string digest_lines(const App& app);

}  // namespace sonar
