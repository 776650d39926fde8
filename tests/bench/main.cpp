// sonard_bench times whole pings, from pose to framed bytes, and their stages, and measures the other figures of
// docs/benchmarks.md. It prints a table and can write JSON. Figures depend on the machine, so the output names its processor.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "core/text/arguments.hpp"
#include "cuda/cuda_status.hpp"
#include "cuda/device_engine.hpp"
#include "daemon/commands/options/command_line.hpp"
#include "daemon/config/products.hpp"
#include "daemon/config/scene_file.hpp"
#include "daemon/server/engine/start_engine.hpp"
#include "daemon/server/system/shortage.hpp"
#include "tests/bench/findings.hpp"
#include "tests/bench/parts.hpp"
#include "tests/bench/ratios.hpp"

namespace sonar::bench {
namespace {

using nlohmann::json;

constexpr const char* other_cases[] = {"P0", "P3e", "P5",  "P6",  "P7",  "P8",
                                       "P9", "P10", "P12", "P13", "P14", "P15"};  // in addition to bench_cases()
constexpr int ratios_missed = 1;

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}
std::vector<std::string> all_cases() {
  std::vector<std::string> names = names_of(bench_cases());
  names.insert(names.end(), std::begin(other_cases), std::end(other_cases));
  return names;
}

bool wanted(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

int complain(const Error& error) {
  std::fprintf(stderr, "sonard_bench: %s\n", error.text.c_str());
  return exit_code(error.kind);
}

Result<ScenePointer> scene_of(const BenchScene& where, const BenchOptions& options) {
  const auto file = find_scene(where.name + ".yaml", options.scene_folder);
  if (!file)
    return failure(ErrorKind::missing_file, "no scene " + where.name + ".yaml; looked in " + scene_folders(options.scene_folder));
  const auto loaded = load_scene(*file);
  if (!loaded) return tl::make_unexpected(loaded.error());
  return *loaded;
}

/// Returns the options of the case. If the device cannot compute the case, they select the CPU.
BenchOptions options_for(const BenchCase& c, const BenchOptions& options) {
  BenchOptions own = options;
  if (options.engine.device == EngineDevice::cpu) return own;
  const std::string why = cuda::why_not_on_device(Pinger(c, options).request(0, {}));
  if (why.empty()) return own;
  own.engine.device = EngineDevice::cpu;
  std::printf("%-4s on the CPU: the device does not compute %s\n", c.name.c_str(), why.c_str());
  return own;
}

/// Measures warm pings of every case over one scene.
Result<void> time_pings(const BenchScene& where, const ScenePointer& loaded, const BenchOptions& options, json& report) {
  const auto scene = with_parts(loaded, options.given_parts);
  for (const BenchCase& c : bench_cases()) {
    if (!wanted(options.cases, c.name)) continue;
    const BenchOptions own = options_for(c, options);
    for (const int threads : options.threads) {
      std::unique_ptr<Bench> bench;
      const auto engine = start_engine(
          [&](ScenePointer s) {
            bench = std::make_unique<Bench>(std::move(s), threads, own);
            return std::move(bench->engine);
          },
          scene);
      if (!engine) return tl::make_unexpected(engine.error());
      Figures f = measure(c, where, *loaded, **engine, threads, own);
      if (own.engine.device != EngineDevice::cpu) {  // the device's steps, measured separately from the rate
        BenchOptions few = own;
        few.pings = std::min(own.pings, 20);
        f.stage_ms = measure(c, where, *loaded, *Bench(scene, threads, own, true).engine, threads, few).stage_ms;
      }
      print(f);
      report["results"].push_back(json_of(f));
    }
  }
  return {};
}

/// Makes all other measurements, over the first scene. Returns false if a bound is exceeded.
Result<bool> find_the_rest(const BenchScene& where, const ScenePointer& scene, const BenchOptions& options, json& report) {
  bool all_hold = true;
  const auto asked = [&](const char* name) { return wanted(options.cases, name); };
  if (asked("P0")) {
    auto demos = find_demos(options);
    if (!demos) return tl::make_unexpected(demos.error());
    report["demos"] = *std::move(demos);
  }
  if (asked("P3e")) report["cold"] = find_cold_pings(scene, where, options);
  if (asked("P5")) {
    auto latency = find_latency(scene, options);
    if (!latency) return tl::make_unexpected(latency.error());
    report["latency"] = *std::move(latency);
  }
  if (asked("P6"))
    for (const auto& ratios :
         {measure_sums(options), measure_beam_weights(options), measure_rays(scene, where, options), measure_detection(options)})
      for (const Ratio& r : ratios) {
        print(r);
        all_hold &= r.holds();
        report["ratios"].push_back(json_of(r));
      }
  if (asked("P7")) report["objects"] = find_cost_of_objects(scene, where, options);
  if (asked("P8")) {
    report["clients"] = json::array();
    for (const int clients : options.curves ? std::vector{1, 4, 10} : std::vector{10}) {
      auto cost = find_cost_of_clients(scene, clients, 5, options);
      if (!cost) return tl::make_unexpected(cost.error());
      report["clients"].push_back(*std::move(cost));
    }
  }
  if (asked("P15")) report["side_lobes"] = find_cost_of_side_lobes(scene, where, options);
  if (asked("P9")) report["hashes"] = find_hashes(scene, where, options);
  if (asked("P10") && options.engine.device != EngineDevice::cpu) {
    auto rates = find_device_rates(scene, where, options);
    if (!rates) return tl::make_unexpected(rates.error());
    report["device"] = *std::move(rates);
  }
  if (asked("P12")) {
    auto empty = find_empty_bins(options);
    if (!empty) return tl::make_unexpected(empty.error());
    report["empty_bins"] = *std::move(empty);
  }
  if (asked("P13")) {
    report["threads"] = find_rates_of_threads(scene, where, options);
    report["sonars"] = json::array();
    for (const int sonars : {1, 4, 8, 16}) {
      auto rates = find_rates_of_sonars(scene, sonars, 0.025 * options.pings, options);
      if (!rates) return tl::make_unexpected(rates.error());
      report["sonars"].push_back(*std::move(rates));
    }
  }
  if (asked("P14")) {
    bool holds = true;
    auto first = find_first_pings(scene, options, holds);
    if (!first) return tl::make_unexpected(first.error());
    report["first_pings"] = *std::move(first);
    all_hold &= holds;
  }
  if (options.curves) report["curves"] = find_curves(scene, where, options);
  return all_hold;
}

/// Reports a missing device before anything is measured; `automatic` becomes the engine that is used.
Result<void> find_device(BenchOptions& options) {
  if (options.engine.device == EngineDevice::cpu) {
    if (!options.cases.empty() && wanted(options.cases, "P10"))
      return failure(ErrorKind::usage, "case P10 needs a device: add --engine cuda");
    return {};
  }
  const auto machine = cuda::open_cuda_machine();
  if (machine) {
    options.engine.device = EngineDevice::cuda;
    return {};
  }
  const std::string why = "no CUDA engine (CUDA: " + machine.error().text + ")";
  if (options.engine.device == EngineDevice::cuda) return failure(ErrorKind::unavailable, why + "; use --engine cpu or auto");
  std::fprintf(stderr, "sonard_bench: engine auto: %s\n", why.c_str());
  options.engine.device = EngineDevice::cpu;
  return {};
}

int run(BenchOptions options) {
  if (const auto found = find_device(options); !found) return complain(found.error());
  const std::string note = note_of_parts_left_out(options.engine.switches);
  if (!note.empty()) std::printf("%s\n", note.c_str());
  json report{{"processor", processor()}, {"results", json::array()}};
  // The load of other programs, which increases wall times.
  if (double load[1]; ::getloadavg(load, 1) == 1) report["load_average"] = load[0];
  std::printf("%s\n", processor().c_str());
  if (options.engine.device != EngineDevice::cpu) std::printf("%s\n", cuda_status().c_str());
  bool first = true, all_hold = true;
  for (const BenchScene& where : bench_scenes()) {
    if (!wanted(options.scenes, where.name)) continue;
    const auto scene = scene_of(where, options);
    if (!scene) return complain(scene.error());
    if (const auto timed = time_pings(where, *scene, options, report); !timed) return complain(timed.error());
    if (!std::exchange(first, false)) continue;
    const auto rest = find_the_rest(where, *scene, options, report);
    if (!rest) return complain(rest.error());
    all_hold = *rest;
  }
  if (!options.json_file.empty()) {
    std::ofstream file(options.json_file);
    if (!(file << report.dump(2) << '\n'))
      return complain({ErrorKind::io, "cannot write " + options.json_file + "; choose another --json file"});
  }
  return all_hold ? 0 : ratios_missed;
}

int parse_and_run(int argc, char** argv) {
  BenchOptions options;
  EngineOptionsGiven model;
  CLI::App cli{
      "Times whole pings and their stages. Pings are warm: the cells of the scene exist already. The first ping, which makes\n"
      "them, is the figure \"cold\" of every case; P3e measures jumps. P0, P5, P8, P13 and P14 run a daemon on loopback. P6\n"
      "compares the hot loops with plain implementations, and P14 the first ping after a change of settings with a warm one;\n"
      "the exit code is 1 if a ratio is missed. P15 compares pings with and without side lobes.",
      "sonard_bench"};
  cli.footer("examples:\n  sonard_bench --case P1 --case P3d --threads 1 --threads 2 --json out.json\n  sonard_bench --case P6");
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  cli.add_option("--case", options.cases, "case to run (may repeat; default all)")->check(text::one_of(all_cases()));
  cli.add_option("--scene", options.scenes, "scene to run it over (may repeat; default all)")
      ->check(text::one_of(names_of(bench_scenes())));
  cli.add_option("--threads", options.threads, "threads (may repeat; default all processors)")->check(text::whole_number(1, 256));
  cli.add_option("--pings", options.pings, "pings to time")->check(text::whole_number(1, 100000))->capture_default_str();
  cli.add_flag("--curves", options.curves, "also how times grow with rays, rows, beams, triangles, sonars and clients");
  cli.add_option("--give", options.given_parts,
                 "give scene and sonar what this part of the model needs, where they lack it (may repeat; default none)")
      ->check(text::one_of(parts_to_give()));
  cli.add_option("--frequency-sum", options.frequency_sum, "sums of the modes paper and raster: by transform, or term by term")
      ->check(text::one_of({"fast", "direct"}))
      ->capture_default_str();
  cli.add_option("--scenes-dir", options.scene_folder, "folder to look for the scene files in first; else the shipped ones");
  cli.add_option("--json", options.json_file, "also write the figures to this file");
  cli.add_option("--reference-ms", options.reference_ms,
                 "milliseconds a frame of the public reference CUDA code on this device, for the ratio P11 (default: the 36 that "
                 "were published for another device)")
      ->check(CLI::PositiveNumber);
  add_device_option(cli, model);
  add_model_options(cli, model);
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const std::string wrong = text::complaint_about(cli, e, words);
    return wrong.empty() ? cli.exit(e) : complain({ErrorKind::usage, wrong});  // empty: --help
  }
  if (const auto r = override_engine(options.engine, options.seed, model); !r) return complain(r.error());
  if (options.threads.empty()) options.threads.push_back(processors);
  return run(options);
}

}  // namespace
}  // namespace sonar::bench

int main(int argc, char** argv) {
  using sonar::ErrorKind;
  try {
    return sonar::bench::parse_and_run(argc, argv);
  } catch (const std::runtime_error& e) {  // the device was lost, or the ray tracer cannot start
    return sonar::bench::complain({ErrorKind::unavailable, sonar::is_short_of_threads(e) ? sonar::not_enough_threads : e.what()});
  } catch (const std::bad_alloc&) {
    return sonar::bench::complain({ErrorKind::unavailable, sonar::not_enough_memory});
  } catch (const std::exception& e) {
    return sonar::bench::complain({ErrorKind::bug, std::string(e.what()) + " (this is a bug, please report it)"});
  }
}
