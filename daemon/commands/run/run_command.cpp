#include "daemon/commands/options/commands.hpp"

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "daemon/commands/run/prepare_run.hpp"
#include "daemon/config/load_config.hpp"
#include "daemon/config/products.hpp"
#include "daemon/server/app.hpp"

extern "C" void __lsan_do_leak_check() __attribute__((weak));  // in builds with the address sanitizer

namespace sonar {
namespace {

using Steady = std::chrono::steady_clock;

double seconds_since(Steady::time_point begin) { return std::chrono::duration<double>(Steady::now() - begin).count(); }

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
  raise_descriptor_limit();
}

AppOptions app_options(const RunCommand& command, const FoundConfig& found) {
  AppOptions options;
  options.exit_after_pings = command.exit_after_pings;
  options.digest = command.digest;
  options.handle_signals = true;
  options.load_scene = [origin = found.config.origin](const SceneFile& scene) { return load_scene(scene, origin); };
  if (!found.file.empty())
    options.read_config = [file = found.file, command]() -> Result<Config> {
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
  for (const std::string& note : notes_of_config(config)) log.info(note);
  if (const std::string note = note_of_parts_left_out(config.engine.switches); !note.empty()) log.info(note);
}

}  // namespace

Result<int> run_daemon(const RunCommand& command, Steady::time_point begin, bool& json) {
  // Signals are set before any thread is created, because threads inherit the mask.
  prepare_process();
  const auto prepare_begin = Steady::now();
  auto prepared = prepare_run(command, json, [](const Config& config) -> LoadProgress::Say {
    return [own = std::make_shared<Log>(config.log)](const std::string& line) { own->info(line); };
  });
  if (!prepared) return tl::make_unexpected(prepared.error());
  FoundConfig& found = prepared->found;
  Log log(found.config.log);
  log_notes(found.config, *prepared->scene, log);
  const auto make_engine_for = [&](ScenePointer s) {
    if (prepared->engine) return std::move(prepared->engine);  // the first call gets the engine of prepare_run()
    return prepared->make_engine(std::move(s));
  };
  const AppOptions options = app_options(command, found);
  App app(std::move(found.config), std::move(prepared->scene), make_engine_for, options, log);
  const double scene_ms = 1e3 * seconds_since(prepare_begin);
  // Ports are open before the ready line is printed, so a script that waits for that line can connect.
  if (const auto r = app.open(); !r) return tl::make_unexpected(r.error());
  log.announce(banner(app, {found.how, scene_ms}) + ready_line(app, seconds_since(begin)));

  let_hangups_through(true);
  const int code = app.run();
  let_hangups_through(false);
  log.announce(summary(app));
  std::fputs(digest_lines(app).c_str(), stdout);
  // All files are written and all clients are disconnected. The destructors would wait for threads of low priority, which take
  // seconds to end on a busy computer, and for a scene or a ping that is no longer needed.
  if (__lsan_do_leak_check != nullptr) __lsan_do_leak_check();
  std::fflush(nullptr);
  std::_Exit(code);
}

}  // namespace sonar
