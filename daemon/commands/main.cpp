// sonard: reads the configuration, loads the scene, builds the engine and runs the App. The only place that knows all of them.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <thread>

#include "daemon/commands/banner.hpp"
#include "daemon/commands/command_line.hpp"
#include "daemon/commands/render/render_command.hpp"
#include "daemon/config/effective_switches.hpp"
#include "daemon/config/products.hpp"
#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/app.hpp"
#include "daemon/server/connections/token.hpp"
#include "daemon/server/engine/choose_engine.hpp"
#include "daemon/server/system/real_time.hpp"
#include "daemon/server/system/standard_streams.hpp"

namespace sonar {
namespace {

using Steady = std::chrono::steady_clock;

double seconds_since(Steady::time_point begin) { return std::chrono::duration<double>(Steady::now() - begin).count(); }

/// On the log stream, and in its format as far as that is known by then.
int complain(const Error& error, bool json = false) {
  LogOptions options;
  options.json = true;
  if (json)
    Log(options).error(error.text);
  else
    std::fprintf(stderr, "sonard: %s\n", error.text.c_str());
  return exit_code(error.kind);
}

struct Found {
  Config config;
  std::string how;             // for the banner
  std::filesystem::path file;  // empty = none
};
Result<Found> find_config(const RunCommand& command) {
  const auto found = [](Result<Config> config, std::string how, std::filesystem::path file = {}) -> Result<Found> {
    if (!config) return tl::make_unexpected(config.error());
    return Found{*std::move(config), std::move(how), std::move(file)};
  };
  if (command.demo) return found(demo_config(), "built-in demo");
  if (!command.config.empty()) return found(load_config(command.config), command.config, command.config);
  std::string looked;
  for (const auto& place : config_search_path()) {
    std::error_code ec;
    if (std::filesystem::exists(place, ec)) return found(load_config(place), place.string(), place);
    looked += (looked.empty() ? "" : ", ") + place.string();
  }
  return found(demo_config(), "none found (looked in " + looked + ") -> demo");
}

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

/// `json` = how the log is written, for complaints of the caller.
int run(const RunCommand& command, Steady::time_point begin, bool& json) {
  json = command.log_format == "json";
  let_hangups_through(false);     // a hangup that arrives while the scene loads stays pending until it is handled
  std::signal(SIGPIPE, SIG_IGN);  // a closed log pipe (sonard 2>&1 | head) must not end the daemon
  std::signal(SIGXFSZ, SIG_IGN);  // a recording that may not grow any more ends; clients stay
  raise_descriptor_limit();
  auto found = find_config(command);
  if (!found) return complain(found.error(), json);
  Config config = std::move(found->config);
  if (command.log_format.empty()) json = config.log.json;
  if (const auto r = override_config(config, command); !r) return complain(r.error());  // of the command line
  const auto scene_begin = Steady::now();
  const auto scene = load_scene(config.scene);
  if (!scene) return complain(scene.error(), json);
  if (const std::string why = why_not_movable(**scene, config); !why.empty()) return complain({ErrorKind::config, why}, json);

  Log log(config.log);
  for (const std::string& note : (*scene)->notes) log.info(note);
  for (const std::string& note : notes_of_options(config)) log.info(note);
  if (const std::string note = note_of_parts_left_out(config.engine.switches); !note.empty()) log.info(note);
  Parallel pool(compute_threads(config.engine), compute_niceness);  // outlives the engine inside App
  // Engines speak on threads of their own, so each has a log of its own.
  const auto make = [&pool, engine = config.engine, log_options = config.log](ScenePointer s) {
    const auto own_log = std::make_shared<Log>(log_options);
    return choose_engine(engine.device, std::move(s), pool, {engine.simd},
                         [own_log](const std::string& what) { own_log->warning(what); });
  };
  Result<std::unique_ptr<PingEngine>> engine;
  compute_apart([&] { engine = start_engine(make, *scene); });
  if (!engine) return complain(engine.error(), json);
  const auto make_engine_for = [&](ScenePointer s) -> std::unique_ptr<PingEngine> {
    if (*engine) return *std::move(engine);  // the first
    return make(std::move(s));
  };
  AppOptions options;
  options.exit_after_pings = command.exit_after_pings;
  options.digest = command.digest;
  options.handle_signals = true;
  options.load_scene = [](const SceneFile& file) { return load_scene(file); };
  if (!found->file.empty())
    options.read_config = [file = found->file, command]() -> Result<Config> {
      auto again = load_config(file);
      if (again)
        if (const auto r = override_config(*again, command); !r) return tl::make_unexpected(r.error());
      return again;
    };
  options.service_manager = notify_place_from_environment();
  App app(std::move(config), *scene, make_engine_for, options, log);
  const double scene_ms = 1e3 * seconds_since(scene_begin);
  if (const auto r = app.open(); !r) return complain(r.error(), json);
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

int check(const CheckCommand& command) {
  const auto config = load_config(command.config);
  if (!config) return complain(config.error());
  if (const auto passes = check_time_can_pass(*config); !passes) return complain(passes.error());
  if (!config->control.token_file.empty()) {
    std::string warning;
    if (const auto token = Token::read(config->control.token_file, warning); !token) return complain(token.error());
    if (!warning.empty()) std::fprintf(stderr, "sonard: %s\n", warning.c_str());
  }
  const auto scene = load_scene(config->scene);
  if (!scene) return complain(scene.error());
  if (const std::string why = why_not_movable(**scene, *config); !why.empty()) return complain({ErrorKind::config, why});
  std::printf("%s: ok, %zu sonar%s; scene %s: ok, %zu triangles\n", command.config.c_str(), config->sonars.size(),
              config->sonars.size() == 1 ? "" : "s", config->scene.name().c_str(), (*scene)->triangle_count());
  for (const std::string& note : notes_of_options(*config)) std::printf("%s\n", note.c_str());
  for (const VehicleConfig& v : config->vehicles)
    if (v.plan) std::printf("vehicle %s follows %s\n", v.name.c_str(), v.plan.about.c_str());
  for (const ObjectConfig& o : config->objects)
    if (o.plan) std::printf("object %s follows %s\n", o.name.c_str(), o.plan.about.c_str());
  for (const Note& note : notes_on(*config, **scene, surroundings_of(*config, **scene)))
    std::printf("note: %s\n", text_of(note).c_str());
  return 0;
}

}  // namespace
}  // namespace sonar

int main(int argc, char** argv) {
  sonar::open_closed_standard_streams();
  const auto begin = std::chrono::steady_clock::now();
  bool json = false;
  try {
    const sonar::Command command = sonar::parse_command_line(argc, argv);
    if (const auto* leave = std::get_if<sonar::Leave>(&command)) return leave->exit_code;
    if (const auto* check = std::get_if<sonar::CheckCommand>(&command)) return sonar::check(*check);
    if (const auto* render = std::get_if<sonar::RenderCommand>(&command)) return sonar::render::run_render(*render);
    if (const auto* replay = std::get_if<sonar::ReplayCommand>(&command)) {
      json = replay->json;
      const auto served = sonar::run_replay(*replay);
      return served ? 0 : sonar::complain(served.error(), json);
    }
    return sonar::run(std::get<sonar::RunCommand>(command), begin, json);
  } catch (const std::bad_alloc&) {
    return sonar::complain({sonar::ErrorKind::unavailable, "not enough memory; use a smaller scene or free some"}, json);
  } catch (const std::exception& e) {
    return sonar::complain({sonar::ErrorKind::bug, std::string(e.what()) + " (this is a bug, please report it)"}, json);
  }
}
