#include "daemon/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <string_view>

namespace sonar {
namespace {

constexpr std::uint64_t most_rendered_pings = 999999;  // six digits in the names of the files

void add_engine_options(CLI::App& app, EngineOptionsGiven& given) {
  app.add_option("--threads", given.threads, "compute threads, 0 = all cores")
      ->check(CLI::Range(0, 256))
      ->envname("SONARD_THREADS");
  app.add_option("--seed", given.seed, "seed of speckle and noise")->envname("SONARD_SEED");
  app.add_option("--simd", given.simd, "instruction set of the hot loops")
      ->check(CLI::IsMember({"auto", "portable", "avx2", "avx512"}))
      ->envname("SONARD_SIMD");
  app.add_flag("--expected-power", given.expected_power, "mean echo power instead of speckle");
  for (std::size_t i = 0; i < named_switches.size(); ++i)
    app.add_option(std::string("--") + named_switches[i].name, given.switches[i],
                   named_switches[i].meaning + std::string(": on or off"))
        ->check(CLI::IsMember({"on", "off"}))
        ->group("Parts of the model");
  app.add_option("--mode", given.mode, "canonical, or paper and raster: Choi 2025 as printed, for comparison")
      ->check(CLI::IsMember({"canonical", "paper", "raster"}))
      ->group("Parts of the model");
  app.add_option("--fixed-fan", given.fixed_fan, "rays a column with one scatterer each, no surface cells; 0 = as usual")
      ->check(CLI::Range(0, most_fixed_rays));
}

void add_run_options(CLI::App& app, RunCommand& run) {
  app.add_option("config", run.config, "configuration file; without one sonard looks in the usual places, then runs the demo");
  app.add_flag("--demo", run.demo, "run the built-in demo, whatever files there are");
  app.add_option("--clock", run.clock, "realtime, or stepped: a tick when every client has taken the last ping")
      ->check(CLI::IsMember({"realtime", "stepped"}))
      ->envname("SONARD_CLOCK");
  add_engine_options(app, run.engine);
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

void add_render_options(CLI::App& app, RenderCommand& render) {
  app.add_option("config", render.config, "configuration or render file (docs/render.md)");
  app.add_option("--out", render.out, "folder for the files; made when it is not there");
  app.add_option("--pings", render.pings, "pings to render (1; with --poses: one for every line)")
      ->check(CLI::Range(std::uint64_t{1}, most_rendered_pings));
  app.add_option("--format", render.formats, "npy, png, raw: any of them, comma between")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"npy", "png", "raw"}));
  app.add_flag("--complex", render.complex, "also the complex beam signal, before magnitude and gain (npy)");
  app.add_option("--sonar", render.sonar, "which sonar of the configuration, when it has several");
  app.add_option("--poses", render.poses, "file of the vehicle's poses: CSV with a header line, or TUM");
  app.add_option("--pose-frame", render.pose_frame, "of that file, when it does not say so itself; default ENU_FLU")
      ->check(CLI::IsMember({"ENU_FLU", "NED_FRD"}));
  app.add_option("--rate", render.rate_hz, "pings a second (as the sonar is set; with --poses: at every line)")
      ->check(CLI::Range(0.001, 10000.0));
  app.add_option("--report", render.report,
                 "coverage: every bin of a plane bed against the closed form; without a configuration "
                 "for every sonar there is")
      ->check(CLI::IsMember({"coverage"}));
  app.add_flag("--check-expectations", render.check_expectations,
               "measure what the render file expects; exit code 1 if it is not so");
  app.add_option("--engine", render.device, "what computes: cpu")->check(CLI::IsMember({"cpu"}));
  app.add_flag("--overwrite", render.overwrite, "replace the pings of other inputs in the folder");
  app.add_flag("--quiet", render.quiet, "no progress");
  add_engine_options(app, render.engine);
}

/// What is missing or makes no sense together; empty = nothing.
std::string complaint(const RenderCommand& render) {
  const bool writes = render.report.empty() && !render.check_expectations;
  if (render.config.empty() && render.report.empty()) return "sonard render needs a configuration or render file";
  if (writes && render.out.empty()) return "say where the files go: --out DIR";
  if (!writes && !render.out.empty()) return "--report and --check-expectations write no files: leave --out away";
  if (!render.pose_frame.empty() && render.poses.empty()) return "--pose-frame is about --poses FILE, which is not given";
  return {};
}

}  // namespace

Command parse_command_line(int argc, char** argv) {
  // The benchmark has its own arguments; they are handed over untouched.
  if (argc > 1 && std::string_view(argv[1]) == "bench") return BenchCommand{{argv + 1, argv + argc}};

  CLI::App app{"sonard: emulates imaging sonars on the network, from a 3D scene"};
  app.set_version_flag("--version", std::string("sonard " SONARD_VERSION));
  RunCommand run;
  CheckCommand check;
  RenderCommand render;
  // `sonard CONFIG` is `sonard run CONFIG`: the word may be left out.
  constexpr std::array<std::string_view, 3> words{"run", "check", "render"};
  const bool bare = argc < 2 || std::find(words.begin(), words.end(), argv[1]) == words.end();
  if (bare) {
    add_run_options(app, run);
    app.footer("Commands: run [CONFIG] (the default), check CONFIG, render CONFIG --out DIR, bench; each has --help.");
  } else {
    app.require_subcommand(1);
    add_run_options(*app.add_subcommand("run", "serve the sonars of a configuration"), run);
    app.add_subcommand("check", "validate a configuration and its scene, then exit")
        ->add_option("config", check.config, "configuration file")
        ->required();
    add_render_options(*app.add_subcommand("render", "render pings into files, or check what they should hold"), render);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return Leave{app.exit(e) == 0 ? 0 : exit_code(ErrorKind::usage)};
  }
  if (!bare && app.got_subcommand("check")) return check;
  if (!bare && app.got_subcommand("render")) {
    const std::string wrong = complaint(render);
    if (wrong.empty()) return render;
    std::fprintf(stderr, "%s; see sonard render --help\n", wrong.c_str());
    return Leave{exit_code(ErrorKind::usage)};
  }
  return run;
}

void override_engine(EngineConfig& engine, std::uint64_t& seed, const EngineOptionsGiven& given) {
  if (given.threads) engine.threads = *given.threads;
  if (given.seed) seed = *given.seed;
  if (given.simd == "auto") engine.simd = SimdLevel::automatic;
  if (given.simd == "portable") engine.simd = SimdLevel::portable;
  if (given.simd == "avx2") engine.simd = SimdLevel::avx2;
  if (given.simd == "avx512") engine.simd = SimdLevel::avx512;
  if (given.expected_power) engine.switches.expected_power = true;
  for (std::size_t i = 0; i < named_switches.size(); ++i)
    if (!given.switches[i].empty()) engine.switches.*named_switches[i].is_on = given.switches[i] == "on";
  if (given.mode == "canonical") engine.switches.mode = Mode::canonical;
  if (given.mode == "paper") engine.switches.mode = Mode::paper;
  if (given.mode == "raster") engine.switches.mode = Mode::raster;
  if (given.fixed_fan) engine.switches.fixed_fan = *given.fixed_fan;
}

Result<void> override_config(Config& config, const RunCommand& command) {
  if (!command.clock.empty()) config.clock = command.clock == "stepped" ? ClockMode::stepped : ClockMode::realtime;
  override_engine(config.engine, config.seed, command.engine);
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
