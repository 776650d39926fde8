#include "daemon/commands/options/command_line.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string_view>

#include <CLI/CLI.hpp>

#include "core/base/enum_names.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/text/arguments.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "daemon/config/load_config.hpp"
#include "daemon/config/products.hpp"
#include "daemon/config/sonar_addresses.hpp"
#include "protocol/host.hpp"

namespace sonar {

using text::one_of;
using text::whole_number;

void add_model_options(CLI::App& app, EngineOptionsGiven& given) {
  constexpr const char* parts = "Parts of the model (a configuration may override these defaults)";
  app.add_option("--seed", given.seed, "seed of speckle and noise (default 1)")->check(whole_number())->envname("SONARD_SEED");
  app.add_option("--simd", given.simd, "instruction set of the hot loops (default auto)")
      ->check(one_of({simd_level_names.begin(), simd_level_names.end()}))
      ->envname("SONARD_SIMD");
  app.add_option("--mode", given.mode,
                 "acoustic model: canonical is sonard's own (default); for comparison, paper and raster are Choi 2025 as printed")
      ->check(one_of({mode_names.begin(), mode_names.end()}))
      ->group(parts);
  app.add_option("--fixed-fan", given.fixed_fan,
                 "number of rays per column, each with one scatterer, without surface cells; default 0: the rays of --mode")
      ->check(whole_number(0, most_fixed_rays))
      ->group(parts);
  app.add_flag("--expected-power", given.expected_power, "mean echo power instead of speckle")->group(parts);
  for (std::size_t i = 0; i < named_switches.size(); ++i) {
    const NamedSwitch& part = named_switches[i];
    app.add_option(option_of(part), given.switches[i],
                   std::string(part.meaning) + " (default " + (product_switches.*part.is_on ? "on)" : "off)"))
        ->check(one_of({"on", "off"}))
        ->group(parts);
  }
}

std::string option_of(const NamedSwitch& part) {
  std::string option = std::string("--") + part.name;
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

void add_device_option(CLI::App& app, EngineOptionsGiven& given) {
  app.add_option("--engine", given.device, "device that computes the pings; auto: the CUDA device if there is one (default cpu)")
      ->check(one_of({engine_device_names.begin(), engine_device_names.end()}))
      ->envname("SONARD_ENGINE");
}

void add_engine_options(CLI::App& app, EngineOptionsGiven& given) {
  app.add_option("--threads", given.threads, "compute threads (default 0: all cores)")
      ->check(whole_number(0, 256))
      ->envname("SONARD_THREADS");
  add_device_option(app, given);
  add_model_options(app, given);
}

Result<void> override_engine(EngineConfig& engine, std::uint64_t& seed, const EngineOptionsGiven& given) {
  if (given.threads) engine.threads = *given.threads;
  if (given.seed) seed = *given.seed;
  engine.device = enum_from<EngineDevice>(given.device, engine_device_names).value_or(engine.device);
  engine.simd = enum_from<SimdLevel>(given.simd, simd_level_names).value_or(engine.simd);
  // --simd auto must override SONARD_SIMD, which SimdLevel::automatic would read. So this requests the best level, and
  // kernels_for() uses the best one that the processor has.
  if (given.simd == "auto") engine.simd = SimdLevel::avx512;
  if (given.expected_power) engine.switches.expected_power = true;
  engine.switches.mode = enum_from<Mode>(given.mode, mode_names).value_or(engine.switches.mode);
  if (given.fixed_fan) engine.switches.fixed_fan = *given.fixed_fan;
  for (std::size_t i = 0; i < named_switches.size(); ++i) {
    if (given.switches[i].empty()) continue;
    const NamedSwitch& part = named_switches[i];
    engine.switches.*part.is_on = given.switches[i] == "on";
    const std::string why = why_without_effect(engine.switches, part);
    if (engine.switches.*part.is_on && !why.empty())
      return failure(ErrorKind::usage,
                     option_of(part) + " on has no effect: " + why + "; leave it out, or change --mode or --fixed-fan");
  }
  return {};
}

namespace {

using text::number;
using text::one_of;
using text::whole_number;

constexpr std::uint64_t most_rendered_pings = 999999;  // names of files have six digits

/// Returns the names that --demo accepts, separated by `between`. `first`: include the name of the default demo.
std::string demo_names(std::string_view between, bool first = true) {
  std::string names;
  for (const protocol::Make& make : protocol::makes())
    if (first || &make != &protocol::makes().front()) names.append(names.empty() ? "" : between).append(make.name_in_demo());
  return names;
}

/// Returns null if there is no such demo.
const protocol::Make* find_demo(std::string_view name) {
  for (const protocol::Make& make : protocol::makes())
    if (make.name_in_demo() == name) return &make;
  return nullptr;
}

void add_run_options(CLI::App& app, RunCommand& run) {
  app.add_option("config", run.config, "configuration file; without one sonard looks in the usual places, then runs the demo");
  app.add_option_function<std::string>(
         "--demo", [&run](const std::string& maker) { run.demo = true, run.demo_of = maker; },
         "run the built-in demo, even if there are configuration files; --demo " + demo_names(", ", false) +
             ": with such a sonar instead of " + std::string(protocol::makes().front().title))
      ->expected(0, 1)
      ->type_name("TEXT:" +
                  demo_names("|"));  // conflict_in() checks the name, so that a file name is not reported as an unknown make
  app.add_option("--profile", run.profile, "run the demo with this product (docs/configuration.md)");
  app.add_option(
         "--clock", run.clock,
         "realtime, or stepped (when clients have received the last ping), lockstep (sonarctl step), follow (stamps of poses)")
      ->check(one_of({clock_modes.begin(), clock_modes.end()}))
      ->envname("SONARD_CLOCK");
  add_engine_options(app, run.engine);
  app.add_option("--bind", run.bind, "address of the first sonar instead of its bind_ip and advertise_ip")
      ->envname("SONARD_BIND");
  app.add_option(
         "--offset", run.offset,
         "for another sonard on this computer: sonars move from 127.0.0.x to 127.0.N.x, ports of poses and control up by 10 N")
      ->check(whole_number(0, highest_offset))
      ->envname("SONARD_OFFSET");
  app.add_option("--clients", run.clients, "clients that each sonar serves at a time, instead of its clients.max")
      ->check(whole_number(1, 16));
  app.add_flag("--faults", run.faults, "arm faults on purpose: without it every request for one is refused (docs/faults.md)");
  app.add_option("--fault-journal", run.fault_journal, "file to which the journal of faults is appended, as JSON lines");
  app.add_option("--exit-after-pings", run.exit_after_pings, "stop after this number of served pings")->check(whole_number());
  app.add_flag("--digest", run.digest, "print the SHA-256 of every client's byte stream at the end");
  app.add_option("--log-format", run.log_format, "text or json (default text)")
      ->check(one_of({"text", "json"}))
      ->envname("SONARD_LOG_FORMAT");
  app.add_option("--log-level", run.log_level, "debug, info, warning or error (default info)")
      ->check(one_of({log_levels.begin(), log_levels.end()}))
      ->envname("SONARD_LOG_LEVEL");
}

void add_render_options(CLI::App& app, RenderCommand& render) {
  app.add_option("config", render.config, "configuration or render file (docs/render.md)");
  app.add_option("--out", render.out, "folder for the files; created if it is missing");
  app.add_option("--pings", render.pings, "pings to render (1; with --poses: one for every line)")
      ->check(whole_number(1, most_rendered_pings));
  app.add_option("--first", render.first, "number of the first ping, to make a part of a longer run (1)")
      ->check(whole_number(1, most_rendered_pings));
  app.add_option("--format", render.formats, "npy, png, raw: any of them, comma between (default npy,png)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(one_of({"npy", "png", "raw"}));
  app.add_option("--image-rings", render.image_rings, "range rings in the pictures (default on)")->check(one_of({"on", "off"}));
  app.add_flag("--complex", render.complex, "also the complex beam signal, before magnitude and gain (npy)");
  app.add_flag("--labels", render.labels,
               "also which object's echo each sample holds, with boxes and polygons (docs/datasets.md)");
  app.add_option("--sonar", render.sonar, "sonar of the configuration, if it has several");
  app.add_option("--poses", render.poses, "file of the vehicle's poses: CSV with a header line, TUM, EuRoC, KITTI");
  app.add_option("--pose-frame", render.pose_frame, "frame of that file, if the file does not state it")
      ->check(one_of({"ENU_FLU", "NED_FRD"}));
  app.add_option("--pose-rate", render.pose_rate_hz, "lines per second of that file, for KITTI files, which have no times")
      ->check(number(0.001, 10000.0));
  app.add_option("--rate", render.rate_hz, "pings a second (as the sonar is set; with --poses: at every line)")
      ->check(number(0.001, 10000.0));
  app.add_option("--batch", render.batch,
                 "pings to make before they are written by all threads at once, for data sets (default 1)")
      ->check(whole_number(1, 4096));
  app.add_option("--report", render.report,
                 "coverage: every bin of a plane bed against the closed form; without a configuration "
                 "for every sonar there is")
      ->check(one_of({"coverage"}));
  app.add_flag("--overwrite", render.overwrite, "replace the pings of other inputs in the folder");
  app.add_flag("--quiet", render.quiet, "no progress");
  add_engine_options(app, render.engine);
}

void add_dataset_options(CLI::App& app, DatasetCommand& dataset) {
  app.footer(
      "examples:\n  sonard dataset scenes/datasets/mines.yaml --out mines\n  sonard dataset job.yaml --out set --shards 3/8\n"
      "  sonard dataset job.yaml --out set --export coco --split 80,10,10");
  app.add_option("job", dataset.job, "job file (docs/datasets.md)")->required();
  app.add_option("--out", dataset.out, "folder for the shards; created if it is missing")->required();
  app.add_option("--shards", dataset.shards,
                 "I/N: only shards whose number has remainder I when divided by N, to share a job among machines");
  auto* form = app.add_option("--export", dataset.export_form,
                              "coco or folder: when the set is complete, also as pictures in that form, in train, val and test")
                   ->check(one_of({"coco", "folder"}));
  app.add_option("--split", dataset.split, "shares of train, val and test, by scene (80,10,10)")->needs(form);
  app.add_option("--split-by", dataset.split_by,
                 "names of draws: pings with equal values are in one split, as with bed_seed (default: equal scenes)")
      ->needs(form);
  app.add_option("--threads", dataset.threads, "pings to make side by side (all processors)")->check(whole_number(1, 1024));
  app.add_flag("--quiet", dataset.quiet, "no progress");
}

void add_queue_options(CLI::App& app, farm::QueueOptions& queue) {
  app.add_option("--nats", queue.url, "address of the NATS server (default nats://127.0.0.1:4222)")->envname("NATS_URL");
  app.add_option("--credentials", queue.credentials, "NATS credentials file");
  app.add_option("--token-file", queue.token_file, "file with the server's token");
}

void add_worker_options(CLI::App& app, WorkerCommand& worker) {
  app.footer("examples:\n  sonard worker --nats nats://10.8.0.1:4222 --out /shared/sets");
  add_queue_options(app, worker.queue);
  app.add_option("--out", worker.out, "the farm's folder, with a folder of each job below it")->required();
  app.add_option("--threads", worker.threads, "pings to make side by side (all processors)")->check(whole_number(1, 1024));
  app.add_flag("--until-empty", worker.until_empty, "end when the queue is empty");
  app.add_flag("--quiet", worker.quiet, "no progress");
}

void add_farm_options(CLI::App& app, FarmCommand& farm) {
  app.require_subcommand(1);
  app.footer(
      "examples:\n  sonarctl farm submit mines.yaml --nats nats://10.8.0.1:4222 --out /shared/sets\n"
      "  sonarctl farm status --watch\n  sonarctl farm collect /shared/sets/mines-0123456789ab");
  CLI::App& submit = *app.add_subcommand("submit", "put the shards of a job that are missing into the queue");
  submit.add_option("job", farm.job, "job file (docs/datasets.md)")->required();
  submit.add_option("--out", farm.out, "the farm's folder; the job's folder is made below it")->required();
  submit.add_option("--simd", farm.simd, "instruction set that all workers have (default: the job's, else this processor's)")
      ->check(one_of({simd_level_names.begin(), simd_level_names.end()}));
  submit.add_option("--ack-wait", farm.ack_wait_s, "seconds after which the shard of a silent worker is given to another (60)")
      ->check(number(0.5, 86400));
  add_queue_options(submit, farm.queue);
  submit.callback([&farm] { farm.what = FarmCommand::What::submit; });
  CLI::App& status = *app.add_subcommand("status", "show the state of jobs and workers");
  status.add_flag("--watch", farm.watch, "repeat every two seconds");
  add_queue_options(status, farm.queue);
  status.callback([&farm] { farm.what = FarmCommand::What::status; });
  CLI::App& collect = *app.add_subcommand("collect", "check every shard, then write manifest.json, coco.json and README.md");
  collect.add_option("folder", farm.out, "the job's folder")->required();
  collect.callback([&farm] { farm.what = FarmCommand::What::collect; });
}

/// Returns an error about a missing option or contradictory options; empty = none.
std::string conflict_in(const RenderCommand& render) {
  const bool writes = render.report.empty();
  if (render.config.empty() && render.report.empty()) return "it needs a configuration or render file: sonard render FILE";
  if (writes && render.out.empty()) return "give the folder for the files: --out DIR";
  if (!writes && !render.out.empty()) return "--report writes no files: leave out --out";
  if (render.pose_rate_hz && render.poses.empty()) return "--pose-rate needs --poses FILE";
  if (render.first - 1 + render.pings.value_or(1) > most_rendered_pings)
    return "--first and --pings go beyond ping " + std::to_string(most_rendered_pings) + ", the last possible number";
  if (!render.pose_frame.empty() && render.poses.empty()) return "--pose-frame needs --poses FILE";
  return {};
}

Leave usage_error(const std::string& wrong) {
  std::fprintf(stderr, "sonard: %s\n", text::printable(wrong).c_str());
  return Leave{exit_code(ErrorKind::usage)};
}

bool is_like_a_file(std::string_view word) {
  std::error_code ec;
  return word.find_first_of("./") != std::string_view::npos || std::filesystem::exists(word, ec);
}

/// Returns an error about contradictory options; empty = none.
std::string conflict_in(const RunCommand& run) {
  const bool known = run.demo_of.empty() || find_demo(run.demo_of) != nullptr;
  const std::string file = !known && is_like_a_file(run.demo_of) ? run.demo_of : run.config;
  if (run.demo && !file.empty()) return "--demo runs the built-in demo, not " + file + ": leave out one of the two";
  if (!known)
    return "there is no demo \"" + run.demo_of + "\"; there are " + demo_names(", ") + ", and --profile NAME for any product";
  if (!run.profile.empty() && !file.empty())
    return "--profile chooses the demo's sonar, and " + file + " lists its own sonars: leave out one of the two";
  if (!run.profile.empty() && !run.demo_of.empty())
    return "--demo " + run.demo_of + " and --profile " + run.profile + " both choose the demo's sonar: leave out one of the two";
  return {};
}

/// Returns an error if the first word is neither an option, a command nor a file name; else empty.
std::string unknown_command(std::string_view word) {
  if (word.empty() || word[0] == '-' || is_like_a_file(word)) return {};
  constexpr std::array<std::string_view, 7> commands{"run", "check", "render", "dataset", "worker", "farm", "replay"};
  return "there is no command or file \"" + std::string(word) + "\"" + text::suggestion(word, commands, "the commands are");
}

}  // namespace

/// Parses the command line. Without a command, the options are those of `run`. Unknown words are reported before CLI11 parses the
/// line, because it would read them as a configuration file.
Command parse_command_line(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "bench")
    return usage_error("the benchmark is a program of its own, sonard_bench, which is built with the tests (docs/benchmarks.md)");

  CLI::App app{"sonard: emulates imaging sonars on the network, from a 3D scene", "sonard"};
  app.set_version_flag("--version", [] {  // prints the best level of this processor, independent of SONARD_SIMD
    return std::string("sonard " SONARD_VERSION "\nhot loops: ") + simd::kernels_for(SimdLevel::avx512).name;
  });
  RunCommand run;
  CheckCommand check;
  RenderCommand render;
  DatasetCommand dataset;
  WorkerCommand worker;
  FarmCommand farm;
  ReplayCommand replay;
  // The word `run` may be left out: `sonard CONFIG` is `sonard run CONFIG`.
  constexpr std::array<std::string_view, 7> words{"run", "check", "render", "dataset", "worker", "farm", "replay"};
  const bool bare = argc < 2 || std::find(words.begin(), words.end(), argv[1]) == words.end();
  if (bare) {
    add_run_options(app, run);
    app.footer(
        std::string("examples:\n") +
        "  sonard                           the configuration found in the usual places, else the demo\n"
        "  sonard --demo NAME               the demo with another make: " +
        demo_names(", ", false) +
        "; --profile NAME: with any product\n"
        "  sonard my.yaml --log-level debug\n"
        "Commands: run [CONFIG] (the default), check CONFIG, render CONFIG --out DIR, dataset JOB --out DIR, worker --out DIR, "
        "farm, "
        "replay FILE; each has --help.\n"
        "Sonars are wire-compatible, except for those that sonard opens by a library of its own, as it prints when it starts. "
        "Not "
        "affiliated with any vendor.");
  } else {
    app.require_subcommand(1);
    CLI::App& run_app = *app.add_subcommand("run", "serve the sonars of a configuration");
    run_app.footer("examples:\n  sonard run my.yaml\n  sonard run --demo --clock stepped --exit-after-pings 20 --digest");
    add_run_options(run_app, run);
    CLI::App& check_app = *app.add_subcommand("check", "validate a configuration and its scene, then exit");
    check_app.footer("examples:\n  sonard check my.yaml");
    check_app.add_option("config", check.config, "the configuration file")->required();
    CLI::App& render_app = *app.add_subcommand("render", "render pings into files");
    render_app.footer("examples:\n  sonard render my.yaml --out pings --pings 5 --format npy,png");
    add_render_options(render_app, render);
    add_dataset_options(*app.add_subcommand("dataset", "make a labelled data set from a job"), dataset);
    add_worker_options(*app.add_subcommand("worker", "make the shards of a farm's jobs"), worker);
    add_farm_options(*app.add_subcommand("farm", "the commands of sonarctl farm"), farm);
    add_replay_options(*app.add_subcommand("replay", "serve a recording to a driver, byte for byte"), replay);
  }
  const std::vector<std::string> typed(argv + std::min(argc, 1), argv + argc);
  if (const std::string wrong = bare && argc > 1 ? unknown_command(argv[1]) : ""; !wrong.empty())
    return usage_error(wrong + text::where_help_is(app));
  try {
    text::parse(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    if (const std::string wrong = text::complaint_about(app, e, typed); !wrong.empty()) return usage_error(wrong);
    app.exit(e);  // --help and --version
    return Leave{0};
  }
  if (!bare && app.got_subcommand("check")) return check;
  if (!bare && app.got_subcommand("replay")) return replay;
  if (!bare && app.got_subcommand("dataset")) return dataset;
  if (!bare && app.got_subcommand("worker")) return worker;
  if (!bare && app.got_subcommand("farm")) return farm;
  if (!bare && app.got_subcommand("render")) {
    const std::string wrong = conflict_in(render);
    if (wrong.empty()) return render;
    return usage_error(wrong + text::where_help_is(app));
  }
  if (const std::string wrong = conflict_in(run); !wrong.empty()) return usage_error(wrong + text::where_help_is(app));
  if (const protocol::Make* const make = find_demo(run.demo_of); make != nullptr && make != &protocol::makes().front())
    run.profile = make->demo_profile.empty() ? make->device->models().front()->profile : make->demo_profile;
  run.demo = run.demo || !run.profile.empty();
  return run;
}

/// Applies --profile first, because other options change the sonar of the demo, and checks for conflicts last.
Result<void> override_config(Config& config, const RunCommand& command) {
  if (!command.profile.empty())
    if (const auto r = use_product(config, command.profile); !r) return failure(r.error().kind, "--profile: " + r.error().text);
  if (command.demo)  // in standby the demo would show nothing
    for (const auto& [name, value] : {std::pair("acoustics_at_start", "enabled"), std::pair("udp_at_start", "multicast")})
      if (const auto option = config.sonars.front().options.find(name); option != config.sonars.front().options.end())
        option->second = value;
  if (const auto mode = enum_from<ClockMode>(command.clock, clock_modes)) config.clock = *mode, config.clock_place = "--clock";
  if (const auto r = override_engine(config.engine, config.seed, command.engine); !r) return r;
  if (!command.log_format.empty()) config.log.json = command.log_format == "json";
  config.log.level = enum_from<LogLevel>(command.log_level, log_levels).value_or(config.log.level);
  if (command.clients)
    for (SonarConfig& sonar : config.sonars) sonar.max_clients = *command.clients;
  if (command.offset > 0)
    if (const auto r = move_addresses(config, command.offset, command.bind.empty()); !r)
      return failure(r.error().kind, "--offset: " + r.error().text);
  if (!command.bind.empty())
    if (const auto r = rebind(config, command.bind); !r) return failure(r.error().kind, "--bind: " + r.error().text);
  config.faults.armed = config.faults.armed || command.faults;
  if (!command.fault_journal.empty()) config.faults.journal = command.fault_journal;
  if (!config.faults.plan.empty() && !config.faults.armed)
    return failure(ErrorKind::config, config.faults.plan_place +
                                          ": faults act only when they are armed: add armed: true, or "
                                          "start with sonard run --faults");
  if (const auto r = check_ports_apart(config); !r) return r;
  return check_time_can_pass(config);
}

}  // namespace sonar
