#include "daemon/commands/run/prepare_run.hpp"

#include <algorithm>
#include <cstdio>
#include <thread>
#include <utility>

#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/connections/token.hpp"
#include "daemon/server/engine/choose_engine.hpp"
#include "daemon/server/faults/journal_file.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/system/real_time.hpp"

namespace sonar {
namespace {

int compute_threads(const EngineConfig& engine) {
  if (engine.threads > 0) return engine.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

Result<FoundConfig> read_config(const RunCommand& command, bool& json) {
  // `json` is the format of an error at this point: that of the command line while the file is read, and that of the
  // configuration afterwards.
  json = command.log_format == "json";
  auto found = find_config(command.config, command.demo);
  if (!found) return found;
  json = false;  // mistakes in the command line are plain text
  if (const auto r = override_config(found->config, command); !r) return tl::make_unexpected(r.error());
  json = found->config.log.json;
  return found;
}

/// The server opens them again. This check finds errors before the scene is loaded.
Result<void> check_files(const Config& config, std::string& token_warning) {
  if (!config.control.token_file.empty())
    if (const auto token = Token::read(config.control.token_file, token_warning); !token)
      return tl::make_unexpected(token.error());
  if (!config.faults.journal.empty()) return JournalFile::check(config.faults.journal);
  return {};
}

/// Engines log from their own threads, so each has a log of its own.
EngineFactory engine_factory(const Config& config, Parallel& pool) {
  return [&pool, engine = config.engine, log_options = config.log](ScenePointer scene) {
    const auto own_log = std::make_shared<Log>(log_options);
    return choose_engine(engine.device, std::move(scene), pool, {engine.simd},
                         [own_log](const std::string& what) { own_log->warning(what); });
  };
}

}  // namespace

Result<PreparedRun> prepare_run(const RunCommand& command, bool& json,
                                const std::function<LoadProgress::Say(const Config&)>& say_with) {
  auto found = read_config(command, json);
  if (!found) return tl::make_unexpected(found.error());
  PreparedRun run;
  run.found = *std::move(found);
  const Config& config = run.found.config;
  if (const auto r = check_files(config, run.token_warning); !r) return tl::make_unexpected(r.error());
  // The checks above are fast. Loading the scene may take minutes, so progress is logged from here.
  const LoadProgress loading(say_with(config));
  const auto scene = load_scene(config.scene, config.origin);
  if (!scene) return tl::make_unexpected(scene.error());
  if (std::string why = why_not_movable(**scene, config); !why.empty()) return failure(ErrorKind::config, std::move(why));
  run.scene = *scene;
  run.pool = std::make_unique<Parallel>(compute_threads(config.engine), compute_niceness);
  run.make_engine = engine_factory(config, *run.pool);
  Result<std::unique_ptr<PingEngine>> engine;
  // The engine is started here, so that sonard ends before it opens a port if the device cannot compute.
  compute_apart([&] { engine = start_engine(run.make_engine, run.scene); });
  if (!engine) return tl::make_unexpected(engine.error());
  run.engine = *std::move(engine);
  return run;
}

}  // namespace sonar
