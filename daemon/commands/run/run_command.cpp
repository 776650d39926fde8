#include "daemon/commands/run/run_command.hpp"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <thread>

#include "daemon/commands/load_progress.hpp"
#include "daemon/commands/run/banner.hpp"
#include "daemon/config/effective_switches.hpp"
#include "daemon/config/find_config.hpp"
#include "daemon/config/products.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/app.hpp"
#include "daemon/server/engine/choose_engine.hpp"
#include "daemon/server/system/real_time.hpp"

namespace sonar {
namespace {

using Steady = std::chrono::steady_clock;

double seconds_since(Steady::time_point begin) { return std::chrono::duration<double>(Steady::now() - begin).count(); }

int compute_threads(const EngineConfig& engine) {
  if (engine.threads > 0) return engine.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Blocks or unblocks SIGHUP in this thread and threads created later; unhandled, it would terminate the process.
void let_hangups_through(bool let) {
  sigset_t hangup;
  sigemptyset(&hangup);
  sigaddset(&hangup, SIGHUP);
  pthread_sigmask(let ? SIG_UNBLOCK : SIG_BLOCK, &hangup, nullptr);
}

void prepare_process() {
  let_hangups_through(false);     // a hangup that arrives while the scene loads stays pending until it is handled
  std::signal(SIGPIPE, SIG_IGN);  // a closed log pipe (sonard 2>&1 | head) must not end the daemon
  std::signal(SIGXFSZ, SIG_IGN);  // a recording that may not grow any more ends; clients stay
  raise_descriptor_limit();
}

Result<FoundConfig> read_config(const RunCommand& command, bool& json) {
  json = command.log_format == "json";
  auto found = find_config(command.config, command.demo);
  if (!found) return found;
  json = false;  // mistakes in the command line are plain text
  if (const auto r = override_config(found->config, command); !r) return tl::make_unexpected(r.error());
  json = found->config.log.json;
  return found;
}

/// Engines log from their own threads, so each has a log of its own.
EngineFactory engine_factory(const Config& config, Parallel& pool) {
  return [&pool, engine = config.engine, log_options = config.log](ScenePointer scene) {
    const auto own_log = std::make_shared<Log>(log_options);
    return choose_engine(engine.device, std::move(scene), pool, {engine.simd},
                         [own_log](const std::string& what) { own_log->warning(what); });
  };
}

AppOptions app_options(const RunCommand& command, const std::filesystem::path& file) {
  AppOptions options;
  options.exit_after_pings = command.exit_after_pings;
  options.digest = command.digest;
  options.handle_signals = true;
  options.load_scene = [](const SceneFile& scene) { return load_scene(scene); };
  if (!file.empty())
    options.read_config = [file, command]() -> Result<Config> {
      auto again = load_config(file);
      if (again)
        if (const auto r = override_config(*again, command); !r) return tl::make_unexpected(r.error());
      return again;
    };
  options.service_manager = notify_target_from_environment();
  return options;
}

void log_notes(const Config& config, const Scene& scene, Log& log) {
  for (const std::string& note : scene.notes) log.info(note);
  for (const std::string& note : notes_of_options(config)) log.info(note);
  if (const std::string note = note_of_parts_left_out(config.engine.switches); !note.empty()) log.info(note);
}

}  // namespace

Result<int> run_daemon(const RunCommand& command, Steady::time_point begin, bool& json) {
  prepare_process();
  auto found = read_config(command, json);
  if (!found) return tl::make_unexpected(found.error());
  Config& config = found->config;
  const auto scene_begin = Steady::now();
  std::optional<LoadProgress> loading(std::in_place,
                                      [own = std::make_shared<Log>(config.log)](const std::string& line) { own->info(line); });
  const auto scene = load_scene(config.scene);
  if (!scene) return tl::make_unexpected(scene.error());
  if (std::string why = why_not_movable(**scene, config); !why.empty()) return failure(ErrorKind::config, std::move(why));

  Log log(config.log);
  log_notes(config, **scene, log);
  Parallel pool(compute_threads(config.engine), compute_niceness);  // outlives the engine inside App
  const EngineFactory make = engine_factory(config, pool);
  Result<std::unique_ptr<PingEngine>> engine;
  compute_apart([&] { engine = start_engine(make, *scene); });
  loading.reset();
  if (!engine) return tl::make_unexpected(engine.error());
  const auto make_engine_for = [&](ScenePointer s) -> std::unique_ptr<PingEngine> {
    if (*engine) return *std::move(engine);  // the first
    return make(std::move(s));
  };
  App app(std::move(config), *scene, make_engine_for, app_options(command, found->file), log);
  const double scene_ms = 1e3 * seconds_since(scene_begin);
  if (const auto r = app.open(); !r) return tl::make_unexpected(r.error());
  log.announce(banner(app, {found->how, scene_ms}) + ready_line(app, seconds_since(begin)));

  let_hangups_through(true);
  const int code = app.run();
  let_hangups_through(false);
  log.announce(summary(app));
  std::fputs(digest_lines(app).c_str(), stdout);
  if (app.is_at_work()) {  // a scene or ping that is not needed any more
    std::fflush(nullptr);
    std::_Exit(code);
  }
  return code;
}

}  // namespace sonar
