#include "tests/bench/measure.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <thread>

#include "core/paper/paper_engine.hpp"
#include "daemon/config/products.hpp"
#include "daemon/emulator/sonar/ping_request.hpp"
#include "daemon/server/engine/choose_engine.hpp"
#include "tests/bench/parts.hpp"

namespace sonar::bench {
namespace {

double read_clock(clockid_t clock) {
  timespec t{};
  ::clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Returns the configuration of a case, whose values override those of the command line.
Config config_of(const BenchCase& c, const BenchOptions& options) {
  Config config;
  config.seed = options.seed;
  config.engine = options.engine;
  if (c.mode != Mode::canonical) config.engine.switches.mode = c.mode;
  if (c.fixed_fan > 0) config.engine.switches.fixed_fan = c.fixed_fan;
  return config;
}

}  // namespace

double now_s() { return read_clock(CLOCK_MONOTONIC); }
double processor_s() { return read_clock(CLOCK_PROCESS_CPUTIME_ID); }
double this_thread_s() { return read_clock(CLOCK_THREAD_CPUTIME_ID); }

std::string processor() {
  std::ifstream cpu("/proc/cpuinfo");
  for (std::string line; std::getline(cpu, line);)
    if (line.rfind("model name", 0) == 0)
      return line.substr(line.find(':') + 2) + ", " + std::to_string(std::thread::hardware_concurrency()) + " processors";
  return "unknown processor";
}

Times::Times(std::vector<double> ms) {
  if (ms.empty()) return;
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double part) { return ms[static_cast<std::size_t>(part * static_cast<double>(ms.size() - 1) + 0.5)]; };
  min = ms.front(), median = at(0.5), p90 = at(0.9), p95 = at(0.95), p99 = at(0.99), max = ms.back();
}

void to_json(nlohmann::json& j, const Times& t) {
  j = {{"min_ms", t.min}, {"median_ms", t.median}, {"p90_ms", t.p90}, {"p95_ms", t.p95}, {"p99_ms", t.p99}, {"max_ms", t.max}};
}

Bench::Bench(std::shared_ptr<const Scene> scene, int threads, const BenchOptions& options, bool device_steps) : pool(threads) {
  if (options.engine.device != EngineDevice::cpu) {
    engine = choose_engine(options.engine.device, std::move(scene), pool,
                           {.simd = options.engine.simd, .now_s = device_steps ? now_s : nullptr},
                           [](const std::string& what) { std::fprintf(stderr, "sonard_bench: %s\n", what.c_str()); });
    return;
  }
  // The processor time of one thread is the time of a stage, and other programs do not increase it.
  const auto clock = threads == 1 ? this_thread_s : now_s;
  const auto sum = options.frequency_sum == "direct" ? paper::FrequencySum::direct : paper::FrequencySum::fast;
  engine = make_engine(std::move(scene), pool, {.simd = options.engine.simd, .now_s = clock}, sum);
}

Pinger::Pinger(const BenchCase& c, const BenchOptions& options)
    : case_(c), config_(config_of(c, options)), model_(with_parts(c.profile.model, options.given_parts)) {
  device_.model = model_;
  device_.id = 1;
  if (!c.profile.vendor) return;
  if (auto values = protocol::check_options(*c.profile.vendor, {})) device_.options = *values;
  device_.settings = c.profile.vendor->initial_settings(device_).vendor_settings;
}

PingRequest Pinger::request(int number, const Pose& sonar) const {
  const World at_rest({}, {{{}, sonar}}, {}, Time{});
  PingRequest r = ping_request(config_, at_rest, 0, {}, Time{});
  r.model = model_;
  r.number = PingNumber{static_cast<std::uint32_t>(number)};
  r.settings = case_.settings;
  r.vendor_settings = device_.settings;
  return r;
}

double Pinger::fire(PingEngine& engine, const PingRequest& request, Ping* ping) {
  const double begin = now_s();
  auto pings = engine.run({&request, 1});
  const double done = now_s();
  if (case_.profile.vendor) static_cast<void>(case_.profile.vendor->frame(pings.front(), device_));
  const double end = now_s();
  frame_s_ = end - done;
  if (ping) *ping = std::move(pings.front());
  return end - begin;
}

double Pinger::fire(PingEngine& engine, Parallel& pool, std::span<const PingRequest> requests, std::size_t a_call) {
  const double begin = now_s();
  const auto collect = [&] {
    const std::vector<Ping> pings = engine.collect();
    if (!case_.profile.vendor) return;
    pool.for_each(pings.size(), [&](std::size_t i, int) { static_cast<void>(case_.profile.vendor->frame(pings[i], device_)); });
  };
  for (std::size_t i = 0; i < requests.size(); i += a_call) {
    engine.submit(requests.subspan(i, std::min(a_call, requests.size() - i)));
    if (i > 0) collect();
  }
  collect();
  return now_s() - begin;
}

Figures measure(const BenchCase& c, const BenchScene& where, const Scene& scene, PingEngine& engine, int threads,
                const BenchOptions& options) {
  Pinger pinger(c, options);
  Figures f;
  f.case_name = c.name;
  f.description = c.description;
  f.scene = where.name;
  f.engine = engine.description();
  f.switches = effective_switches(pinger.switches());
  f.parts_had = parts_had(scene, c.profile.model->modes[static_cast<std::size_t>(c.settings.mode)]);
  f.threads = threads;
  f.pings = options.pings;
  f.scene_triangles = scene.triangle_count();
  std::vector<double> wall, processors;
  const int warm_up = std::max(3, options.pings / 10);
  for (int k = 0; k < options.pings + warm_up; ++k) {
    const PingRequest request = pinger.request(k, bench_pose(c, where, k / 40.0));
    const double used = processor_s(), ms = 1e3 * pinger.fire(engine, request);
    if (k == 0) f.cold_ms = ms;
    if (k < warm_up) continue;
    processors.push_back(1e3 * (processor_s() - used));
    wall.push_back(ms);
    f.frame_ms += 1e3 * pinger.last_frame_s() / options.pings;
    f.last = engine.statistics();
    for (std::size_t s = 0; s < f.stage_ms.size(); ++s) f.stage_ms[s] += 1e3 * f.last.seconds[s] / options.pings;
  }
  f.wall = Times(std::move(wall));
  f.processor_ms = Times(std::move(processors)).median;
  return f;
}

void print(const Figures& f) {
  std::printf("%-4s %-34s %-13s %d thread%s  %6.1f pings/s   (ms: median %.2f, min %.2f, p90 %.2f, cold %.1f, processors %.2f)\n",
              f.case_name.c_str(), f.description.c_str(), f.scene.c_str(), f.threads, f.threads == 1 ? " " : "s",
              f.pings_per_second(), f.wall.median, f.wall.min, f.wall.p90, f.cold_ms, f.processor_ms);
  std::printf("     thread ms per ping:");
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
          {"min_ms", f.wall.min},
          {"median_ms", f.wall.median},
          {"p90_ms", f.wall.p90},
          {"processor_ms", f.processor_ms},
          {"pings_per_second", f.pings_per_second()},
          {"thread_ms", stages},
          {"triangles", f.scene_triangles},
          {"rays", f.last.rays},
          {"cells", f.last.cells},
          {"tiles", f.last.tiles},
          {"echoes", f.last.echoes},
          {"cell_bytes", f.last.cell_bytes}};
}

}  // namespace sonar::bench
