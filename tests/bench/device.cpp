// P10 and P11: the performance of a device with batches of pings, as in `sonard render --batch` and data sets.
#include <algorithm>
#include <cstdio>
#include <initializer_list>

#include "cuda/cuda_engine.hpp"
#include "cuda/cuda_status.hpp"
#include "tests/bench/findings.hpp"

namespace sonar::bench {
namespace {

using nlohmann::json;

constexpr double published_reference_ms = 36;            // a frame of P1's size, on the author's device: IOES-Lab/dave, issue 44
constexpr double most_warm_up_s = 1, most_rounds_s = 3;  // limits for one size of a batch; less for few pings
constexpr std::size_t rounds = 5;

Result<std::unique_ptr<PingEngine>> engine_of(const ScenePointer& scene, Parallel& pool, const BenchOptions& options, int batch,
                                              bool steps) {
  cuda::DeviceEngineOptions device;
  device.batch = batch;
  device.cpu_after_failure = false;  // otherwise the CPU's rate would be reported as the device's
  return make_cuda_engine(scene, pool, {.simd = options.engine.simd, .now_s = steps ? now_s : nullptr}, device);
}

struct BatchRate {
  double pings_per_second = 0;  // as in normal use
  // Means for each ping, from a separate run with timed steps: finding tiles and points in one thread, and the device's steps.
  double processor_ms = 0, device_ms = 0;
};

/// First warms up, because an idle device runs at a fraction of its clock and needs about a second to rise. Returns the median of
/// several rounds.
double rate(PingEngine& engine, Parallel& pool, Pinger& pinger, const std::vector<PingRequest>& requests, std::size_t batch) {
  const auto round = [&] {
    if (batch > 1) return pinger.fire(engine, pool, requests, batch);
    double seconds = 0;  // one ping at a time, as a driver requests them
    for (const PingRequest& request : requests) seconds += pinger.fire(engine, request);
    return seconds;
  };
  const double share = std::min(1.0, static_cast<double>(requests.size()) / 100);
  for (const double begin = now_s(); round(), now_s() - begin < share * most_warm_up_s;) {
  }
  std::vector<double> seconds;
  for (const double begin = now_s(); seconds.empty() || (seconds.size() < rounds && now_s() - begin < share * most_rounds_s);)
    seconds.push_back(round());
  return static_cast<double>(requests.size()) / Times(std::move(seconds)).median;
}

Result<BatchRate> rate_of(const ScenePointer& scene, Parallel& pool, Pinger& pinger, const std::vector<PingRequest>& requests,
                          int batch, const BenchOptions& options) {
  const auto a_call = static_cast<std::size_t>(batch);
  auto engine = engine_of(scene, pool, options, batch, false);
  if (!engine) return tl::make_unexpected(engine.error());
  BatchRate found;
  found.pings_per_second = rate(**engine, pool, pinger, requests, a_call);
  engine->reset();  // frees its memory for the next engine
  engine = engine_of(scene, pool, options, batch, true);
  if (!engine) return tl::make_unexpected(engine.error());
  const auto few = std::span(requests).first(std::min(requests.size(), 8 * a_call));
  pinger.fire(**engine, pool, few, few.size());
  pinger.fire(**engine, pool, few, few.size());
  const std::vector<PingStatistics> each = (*engine)->statistics_of_each();
  const auto mean_ms = [&](std::initializer_list<Stage> stages) {
    double seconds = 0;
    for (const PingStatistics& of : each)
      for (const Stage s : stages) seconds += of.seconds[static_cast<std::size_t>(s)];
    return 1e3 * seconds / static_cast<double>(each.size());
  };
  found.processor_ms = mean_ms({Stage::specular, Stage::multipath, Stage::cull, Stage::build_cells});
  found.device_ms = mean_ms({Stage::trace, Stage::scatter, Stage::synthesize, Stage::noise, Stage::form_beams, Stage::receive});
  return found;
}

/// Prints the row of the table; returns that of the report.
json row_of(const BatchRate& found, const BenchCase& c, int threads, int batch) {
  std::printf(
      "P10  %-4s %2d thread%s %2d pings per launch: %7.1f pings/s  (ms per ping: %.3f; tiles and points by the CPU %.3f, the "
      "device's steps %.3f)\n",
      c.name.c_str(), threads, threads == 1 ? " " : "s", batch, found.pings_per_second, 1e3 / found.pings_per_second,
      found.processor_ms, found.device_ms);
  std::fflush(stdout);
  return {{"case", c.name},
          {"threads", threads},
          {"batch", batch},
          {"pings_per_second", found.pings_per_second},
          {"processor_ms", found.processor_ms},
          {"device_ms", found.device_ms}};
}

}  // namespace

Result<json> find_device_rates(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options) {
  json rates = json::array();
  double best_of_p1 = 0;
  for (const char* name : {"P1", "P3a"}) {
    const BenchCase c = *find_case(name);
    Pinger pinger(c, options);
    std::vector<PingRequest> requests;
    for (int k = 0; k < std::max(options.pings, 2); ++k) requests.push_back(pinger.request(k, bench_pose(c, where, k / 40.0)));
    for (const int threads : options.threads) {
      Parallel pool(threads);
      for (const int batch : {1, 2, 4, 8, 16, 32}) {
        if (static_cast<std::size_t>(batch) > requests.size()) continue;  // no such batch would be full
        const auto found = rate_of(scene, pool, pinger, requests, batch, options);
        if (!found) return tl::make_unexpected(found.error());
        rates.push_back(row_of(*found, c, threads, batch));
        if (c.name == "P1") best_of_p1 = std::max(best_of_p1, found->pings_per_second);
      }
    }
  }
  const bool given = options.reference_ms > 0;
  const double reference_ms = given ? options.reference_ms : published_reference_ms, ratio = best_of_p1 * reference_ms / 1e3;
  std::printf("P11  %.0f times the public reference code (%.1f ms per frame, %s)\n", ratio, reference_ms,
              given ? "as given for this device" : "as published, on another device");
  std::fflush(stdout);
  return json{{"name", cuda_status()},
              {"rates", rates},
              {"reference", {{"ms", reference_ms}, {"on_this_device", given}, {"ratio", ratio}}}};
}

}  // namespace sonar::bench
