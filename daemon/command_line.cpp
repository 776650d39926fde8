#include "daemon/command_line.hpp"

#include <CLI/CLI.hpp>

namespace sonar {
namespace {

void add_run_options(CLI::App& app, RunCommand& run) {
  app.add_option("config", run.config, "configuration file; without one sonard looks in the usual places, then runs the demo");
  app.add_flag("--demo", run.demo, "run the built-in demo, whatever files there are");
  app.add_option("--clock", run.clock, "realtime, or stepped: a tick when every client has taken the last ping")
      ->check(CLI::IsMember({"realtime", "stepped"}))
      ->envname("SONARD_CLOCK");
  app.add_option("--threads", run.threads, "compute threads, 0 = all cores")
      ->check(CLI::Range(0, 256))
      ->envname("SONARD_THREADS");
  app.add_option("--seed", run.seed, "seed of speckle and noise")->envname("SONARD_SEED");
  app.add_option("--simd", run.simd, "instruction set of the hot loops")
      ->check(CLI::IsMember({"auto", "portable", "avx2", "avx512"}))
      ->envname("SONARD_SIMD");
  app.add_flag("--expected-power", run.expected_power, "mean echo power instead of speckle");
  for (std::size_t i = 0; i < named_switches.size(); ++i)
    app.add_option(std::string("--") + named_switches[i].name, run.switches[i],
                   named_switches[i].meaning + std::string(": on or off"))
        ->check(CLI::IsMember({"on", "off"}))
        ->group("Parts of the model");
  app.add_option("--mode", run.mode, "canonical, or paper and raster: Choi 2025 as printed, for comparison")
      ->check(CLI::IsMember({"canonical", "paper", "raster"}))
      ->group("Parts of the model");
  app.add_option("--fixed-fan", run.fixed_fan, "rays a column with one scatterer each, no surface cells; 0 = as usual")
      ->check(CLI::Range(0, most_fixed_rays));
  app.add_option("--bind", run.bind, "address of the first sonar instead of its bind_ip and advertise_ip")
      ->envname("SONARD_BIND");
  app.add_option("--exit-after-pings", run.exit_after_pings, "stop after so many served pings");
  app.add_flag("--digest", run.digest, "print the SHA-256 of every client's byte stream at the end");
  app.add_option("--log-format", run.log_format, "text or json")
      ->check(CLI::IsMember({"text", "json"}))
      ->envname("SONARD_LOG_FORMAT");
  app.add_option("--log-level", run.log_level, "debug, info, warning or error")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}))
      ->envname("SONARD_LOG_LEVEL");
}

}  // namespace

Command parse_command_line(int argc, char** argv) {
  // The benchmark has its own arguments; they are handed over untouched.
  if (argc > 1 && std::string_view(argv[1]) == "bench") return BenchCommand{{argv + 1, argv + argc}};

  CLI::App app{"sonard: emulates imaging sonars on the network, from a 3D scene"};
  app.set_version_flag("--version", std::string("sonard " SONARD_VERSION));
  RunCommand run;
  CheckCommand check;
  // `sonard CONFIG` is `sonard run CONFIG`: the word may be left out.
  const bool bare = argc < 2 || (std::string_view(argv[1]) != "run" && std::string_view(argv[1]) != "check");
  if (bare) {
    add_run_options(app, run);
    app.footer("Commands: run [CONFIG] (the default), check CONFIG, bench; each has --help.");
  } else {
    app.require_subcommand(1);
    add_run_options(*app.add_subcommand("run", "serve the sonars of a configuration"), run);
    app.add_subcommand("check", "validate a configuration and its scene, then exit")
        ->add_option("config", check.config, "configuration file")
        ->required();
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return Leave{app.exit(e) == 0 ? 0 : exit_code(ErrorKind::usage)};
  }
  if (!bare && app.got_subcommand("check")) return check;
  return run;
}

Result<void> override_config(Config& config, const RunCommand& command) {
  if (!command.clock.empty()) config.clock = command.clock == "stepped" ? ClockMode::stepped : ClockMode::realtime;
  if (command.threads) config.engine.threads = *command.threads;
  if (command.seed) config.seed = *command.seed;
  if (command.simd == "auto") config.engine.simd = SimdLevel::automatic;
  if (command.simd == "portable") config.engine.simd = SimdLevel::portable;
  if (command.simd == "avx2") config.engine.simd = SimdLevel::avx2;
  if (command.simd == "avx512") config.engine.simd = SimdLevel::avx512;
  if (command.expected_power) config.engine.switches.expected_power = true;
  for (std::size_t i = 0; i < named_switches.size(); ++i)
    if (!command.switches[i].empty()) config.engine.switches.*named_switches[i].is_on = command.switches[i] == "on";
  if (command.mode == "canonical") config.engine.switches.mode = Mode::canonical;
  if (command.mode == "paper") config.engine.switches.mode = Mode::paper;
  if (command.mode == "raster") config.engine.switches.mode = Mode::raster;
  if (command.fixed_fan) config.engine.switches.fixed_fan = *command.fixed_fan;
  if (!command.log_format.empty()) config.log.json = command.log_format == "json";
  if (command.log_level == "debug") config.log.level = LogLevel::debug;
  if (command.log_level == "info") config.log.level = LogLevel::info;
  if (command.log_level == "warning") config.log.level = LogLevel::warning;
  if (command.log_level == "error") config.log.level = LogLevel::error;
  if (!command.bind.empty())
    if (const auto r = rebind(config, command.bind); !r) return failure(r.error().kind, "--bind: " + r.error().text);
  return {};
}

}  // namespace sonar
