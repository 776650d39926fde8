// All steps of a run before its first socket. `sonard run` starts with them and `sonard check` does only them, so that both
// refuse the same with the same sentence.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/base/parallel.hpp"
#include "daemon/commands/options/command_line.hpp"
#include "daemon/commands/options/load_progress.hpp"
#include "daemon/config/find_config.hpp"
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

/// The configuration as the command line changes it, its token, journal, scene and engine. `json`: how errors are to be written
/// from then on. `say_with` gives the sentences about a long load their place.
Result<PreparedRun> prepare_run(const RunCommand& command, bool& json,
                                const std::function<LoadProgress::Say(const Config&)>& say_with);

}  // namespace sonar
