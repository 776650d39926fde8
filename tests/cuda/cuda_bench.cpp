// Pings per second of the device engine against the size of a batch, and beside it the CPU's: a table in Markdown on stdout.
// Sizes are those of the benchmark's cases P1 and P3a, over rough relief of 200,000 triangles, the sonar moving at 0.9 m/s.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "cuda/cuda_engine.hpp"
#include "cuda/cuda_status.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Case {
  const char* name;
  FrequencyMode mode;
  int rows;
};

std::vector<PingRequest> flight(const Case& c, int pings) {
  SonarModel model;
  model.name = c.name;
  model.modes = {c.mode};
  PingRequest r;
  r.model = std::make_shared<const SonarModel>(std::move(model));
  r.settings = default_rows(10, c.rows);
  r.settings.format = {.bits = 8, .max_code = 254, .gamma = 0.5f, .row_gains = false};
  r.water = {.temperature_c = 10, .salinity_psu = 0, .ph = 8, .sound_speed_mps = 1480};
  r.seed = Seed{3};
  std::vector<PingRequest> all;
  for (int i = 0; i < pings; ++i) {
    const double t = 0.025 * i;
    r.number = PingNumber{static_cast<std::uint32_t>(i)};
    r.sonar_in_world = {{std::fmod(0.9 * t, 4.0), 0, 0}, quat_from_rpy({0, 0.25, 0.35 * std::sin(t)})};
    all.push_back(r);
  }
  return all;
}

/// Once to make and send the cells, then timed.
double pings_a_second(PingEngine& engine, const std::vector<PingRequest>& requests, std::size_t at_once) {
  double from = 0;
  for (int round = 0; round < 2; ++round) {
    from = now_s();
    for (std::size_t i = 0; i < requests.size(); i += at_once)
      engine.run(std::span(requests).subspan(i, std::min(at_once, requests.size() - i)));
  }
  return static_cast<double>(requests.size()) / (now_s() - from);
}

int run(int pings, bool host_loops) {
  SceneMaker maker;
  maker.add(height_field(-2, 18, -20, 20, 0.09, rough_relief(0.1, 30)), -25, {0, 0, -2});
  const auto scene = maker.make();
  std::printf("Relief of %zu triangles, %d pings a figure, cells warm.\n\n", scene->triangle_count(), pings);
  std::printf("| case | engine | pings in one call | pings a launch | pings/s |\n|---|---|---|---|---|\n");
  const Case cases[] = {{"P1", p900(), 394}, {"P3a", oculus_high(), 437}};
  const int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (const Case& c : cases) {
    const auto requests = flight(c, pings);
    Parallel pool(threads);
    {
      const auto cpu = make_cpu_engine(scene, pool);
      std::printf("| %s | %s | 1 | | %.0f |\n", c.name, cpu->description().c_str(), pings_a_second(*cpu, requests, 1));
    }
    for (const int batch : {1, 4, 8, 16, 32}) {
      cuda::DeviceEngineOptions options;
      options.batch = batch;
      options.say = [](const std::string& what) { std::fprintf(stderr, "%s\n", what.c_str()); };
      auto engine =
          host_loops
              ? Result<std::unique_ptr<PingEngine>>(cuda::make_device_engine(scene, pool, {}, cuda::make_host_loops(), options))
              : make_cuda_engine(scene, pool, {}, options);
      if (!engine) {
        std::fprintf(stderr, "%s\n", engine.error().text.c_str());
        return 77;
      }
      const std::size_t at_once = batch == 1 ? 1 : 4 * static_cast<std::size_t>(batch);
      const double rate = pings_a_second(**engine, requests, at_once);
      std::printf("| %s | %s | %zu | %d | %.0f |\n", c.name, (*engine)->description().c_str(), at_once, batch, rate);
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace
}  // namespace sonar::test

int main(int argc, char** argv) {
  const bool host_loops = argc > 2 && std::strcmp(argv[2], "host-loops") == 0;
  return sonar::test::run(argc > 1 ? std::atoi(argv[1]) : 256, host_loops);
}
