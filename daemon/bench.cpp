#include "daemon/bench.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/paper/paper_engine.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/text/arguments.hpp"
#include "daemon/bench_cases.hpp"
#include "daemon/bench_parts.hpp"
#include "daemon/effective_switches.hpp"
#include "daemon/engine_options.hpp"
#include "daemon/scene_file.hpp"
#include "daemon/start_engine.hpp"

namespace sonar {
namespace {

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct BenchOptions {
  std::vector<std::string> cases, scenes;
  std::vector<int> threads;
  int pings = 100;
  std::vector<std::string> given_parts;
  std::string frequency_sum = "fast";
  EngineOptionsGiven model;
  EngineConfig engine;     // what `model` made of the defaults
  std::uint64_t seed = 1;  // as well
  std::string scene_folder;
  std::string json_file;
};

struct Figures {
  std::string case_name, description, scene, engine;
  Switches switches;
  std::vector<std::string> parts_had;
  int threads = 0, pings = 0;
  double cold_ms = 0, min_ms = 0, median_ms = 0, p90_ms = 0;
  std::array<double, static_cast<std::size_t>(Stage::stages)> stage_ms{};  // mean a ping, summed over threads
  double frame_ms = 0;
  PingStatistics last;
  std::size_t scene_triangles = 0;
  double pings_per_second() const { return 1e3 / median_ms; }
};

std::string processor() {
  std::ifstream cpu("/proc/cpuinfo");
  for (std::string line; std::getline(cpu, line);)
    if (line.rfind("model name", 0) == 0)
      return line.substr(line.find(':') + 2) + ", " + std::to_string(std::thread::hardware_concurrency()) + " processors";
  return "unknown processor";
}

const char* name_of(Mode mode) {
  constexpr const char* names[] = {"canonical", "paper", "raster"};
  return names[static_cast<int>(mode)];
}

Figures measure(const BenchCase& c, const BenchScene& where, const Scene& scene, PingEngine& engine, int threads,
                const BenchOptions& options) {
  const auto model = with_parts(c.profile.model, options.given_parts);
  protocol::DeviceState device;
  device.model = model;
  device.id = 1;
  if (c.profile.vendor)
    if (auto values = protocol::check_options(*c.profile.vendor, {})) device.options = *values;
  const protocol::Bytes request = c.profile.vendor ? c.profile.vendor->initial_settings(device).request : protocol::Bytes{};

  Figures f;
  f.case_name = c.name;
  f.description = c.description;
  f.scene = where.name;
  f.engine = engine.description();
  f.switches = effective_switches(options.engine.switches);
  f.parts_had = parts_had(scene, c.profile.model->modes[static_cast<std::size_t>(c.settings.mode)]);
  f.threads = threads;
  f.pings = options.pings;
  f.scene_triangles = scene.triangle_count();
  std::vector<double> times;
  const int warm_up = std::max(3, options.pings / 10);
  for (int k = 0; k < options.pings + warm_up; ++k) {
    PingRequest r;
    r.model = model;
    r.number = PingNumber{static_cast<std::uint32_t>(k)};
    r.settings = c.settings;
    r.seed = Seed{options.seed};
    r.switches = options.engine.switches;
    r.sonar_in_world = r.vehicle_in_world = bench_pose(c, where, k / 40.0);
    const double begin = now_s();
    const auto pings = engine.run({&r, 1});
    const double done = now_s();
    if (c.profile.vendor) static_cast<void>(c.profile.vendor->frame(pings.front(), device, request));
    const double end = now_s();
    if (k == 0) f.cold_ms = 1e3 * (end - begin);
    if (k < warm_up) continue;
    times.push_back(1e3 * (end - begin));
    f.frame_ms += 1e3 * (end - done) / options.pings;
    f.last = engine.statistics();
    for (std::size_t s = 0; s < f.stage_ms.size(); ++s) f.stage_ms[s] += 1e3 * f.last.seconds[s] / options.pings;
  }
  std::sort(times.begin(), times.end());
  f.min_ms = times.front();
  f.median_ms = times[times.size() / 2];
  f.p90_ms = times[times.size() * 9 / 10];
  return f;
}

void print(const Figures& f) {
  std::printf("%-4s %-34s %-13s %d thread%s  %6.1f pings/s   (ms: median %.2f, min %.2f, p90 %.2f, cold %.1f)\n",
              f.case_name.c_str(), f.description.c_str(), f.scene.c_str(), f.threads, f.threads == 1 ? " " : "s",
              f.pings_per_second(), f.median_ms, f.min_ms, f.p90_ms, f.cold_ms);
  std::printf("     thread ms a ping:");
  for (std::size_t s = 0; s < f.stage_ms.size(); ++s) std::printf(" %s %.2f", stage_names[s], f.stage_ms[s]);
  std::printf(" frame %.2f\n     %zu triangles, %zu rays, %zu cells in %zu tiles (%.1f MB kept), %zu echoes\n", f.frame_ms,
              f.scene_triangles, f.last.rays, f.last.cells, f.last.tiles, static_cast<double>(f.last.cell_bytes) / 1e6,
              f.last.echoes);
  std::fflush(stdout);
}

nlohmann::json json_of(const Figures& f) {
  nlohmann::json stages;
  for (std::size_t s = 0; s < f.stage_ms.size(); ++s) stages[stage_names[s]] = f.stage_ms[s];
  stages["frame"] = f.frame_ms;
  nlohmann::json switches{{"expected_power", f.switches.expected_power}, {"fixed_fan", f.switches.fixed_fan}};
  for (const NamedSwitch& part : named_switches) switches[part.name] = f.switches.*part.is_on;
  return {{"case", f.case_name},
          {"description", f.description},
          {"scene", f.scene},
          {"engine", f.engine},
          {"mode", name_of(f.switches.mode)},
          {"switches", switches},
          {"parts_had", f.parts_had},
          {"threads", f.threads},
          {"pings", f.pings},
          {"cold_ms", f.cold_ms},
          {"min_ms", f.min_ms},
          {"median_ms", f.median_ms},
          {"p90_ms", f.p90_ms},
          {"pings_per_second", f.pings_per_second()},
          {"thread_ms", stages},
          {"triangles", f.scene_triangles},
          {"rays", f.last.rays},
          {"cells", f.last.cells},
          {"tiles", f.last.tiles},
          {"echoes", f.last.echoes},
          {"cell_bytes", f.last.cell_bytes}};
}

template <class T>
bool wanted(const std::vector<std::string>& names, const T& item) {
  return names.empty() || std::find(names.begin(), names.end(), item.name) != names.end();
}

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

int complain(const Error& error) {
  std::fprintf(stderr, "sonard: %s\n", error.text.c_str());
  return exit_code(error.kind);
}

int bench(const BenchOptions& options) {
  const std::string note = note_of_parts_left_out(options.engine.switches);
  if (!note.empty()) std::printf("%s\n", note.c_str());
  nlohmann::json all{{"processor", processor()}, {"results", nlohmann::json::array()}};
  std::printf("%s\n", processor().c_str());
  for (const BenchScene& where : bench_scenes()) {
    if (!wanted(options.scenes, where)) continue;
    const auto file = find_scene(where.name + ".yaml", options.scene_folder);
    if (!file) {
      std::fprintf(stderr, "sonard: no scene %s.yaml; looked in %s\n", where.name.c_str(),
                   scene_folders(options.scene_folder).c_str());
      return exit_code(ErrorKind::missing_file);
    }
    const auto loaded = load_scene(*file);
    if (!loaded) return complain(loaded.error());
    const auto scene = with_parts(*loaded, options.given_parts);
    for (const BenchCase& c : bench_cases()) {
      if (!wanted(options.cases, c)) continue;
      for (const int threads : options.threads) {
        Parallel pool(threads);
        const EngineOptions engine_options{.simd = options.engine.simd, .now_s = now_s};
        const auto sum = options.frequency_sum == "direct" ? paper::FrequencySum::direct : paper::FrequencySum::fast;
        const auto engine = start_engine(
            [&](std::shared_ptr<const Scene> s) { return make_engine(std::move(s), pool, engine_options, sum); }, scene);
        if (!engine) return complain(engine.error());
        const Figures f = measure(c, where, **loaded, **engine, threads, options);
        print(f);
        all["results"].push_back(json_of(f));
      }
    }
  }
  if (options.json_file.empty()) return 0;
  std::ofstream file(options.json_file);
  if (!(file << all.dump(2) << '\n')) {
    std::fprintf(stderr, "sonard: cannot write %s; choose another --json file\n", options.json_file.c_str());
    return exit_code(ErrorKind::io);
  }
  return 0;
}

}  // namespace

int run_bench(int argc, char** argv) {
  BenchOptions options;
  CLI::App cli{
      "Times whole pings, stage by stage, warm: the cells of the scene are made already. The first ping, which makes them, is\n"
      "the figure \"cold\" of every case; it has no case of its own.",
      "sonard bench"};
  cli.footer("examples:\n  sonard bench --case P1 --case P3d --threads 1 --threads 2 --json out.json");
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  cli.add_option("--case", options.cases, "case to run (may repeat; default all)")->check(text::one_of(names_of(bench_cases())));
  cli.add_option("--scene", options.scenes, "scene to run it over (may repeat; default all)")
      ->check(text::one_of(names_of(bench_scenes())));
  cli.add_option("--threads", options.threads, "threads (may repeat; default all processors)")->check(text::whole_number(1, 256));
  cli.add_option("--pings", options.pings, "pings to time")->check(text::whole_number(1, 100000))->capture_default_str();
  cli.add_option("--give", options.given_parts,
                 "give scene and sonar what this part of the model needs, where they lack it (may repeat; default none)")
      ->check(text::one_of(parts_to_give()));
  cli.add_option("--frequency-sum", options.frequency_sum, "of the modes paper and raster: by a transform, or term by term")
      ->check(text::one_of({"fast", "direct"}))
      ->capture_default_str();
  cli.add_option("--scenes-dir", options.scene_folder, "folder to look for the scene files in first; else the shipped ones");
  cli.add_option("--json", options.json_file, "also write the figures to this file");
  add_model_options(cli, options.model);
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (const std::string wrong = text::complaint_about_words(cli, words); !wrong.empty())
    return complain({ErrorKind::usage, wrong});
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return cli.exit(e);  // --help
    return complain({ErrorKind::usage, text::complaint_about(cli, e, words)});
  }
  if (const auto r = override_engine(options.engine, options.seed, options.model); !r) return complain(r.error());
  if (options.threads.empty()) options.threads.push_back(processors);
  return bench(options);
}

}  // namespace sonar
