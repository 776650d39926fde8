// Measures whole pings, from pose to framed bytes: median and best of many, in wall time and in processor time, which depends
// less on other programs.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/pipeline/ping_engine.hpp"
#include "daemon/config/config.hpp"
#include "tests/bench/cases.hpp"

namespace sonar::bench {

double now_s();           // on the steady clock
double processor_s();     // processor time of all threads of this process
double this_thread_s();   // processor time of the calling thread
std::string processor();  // name and number of the processors

/// Minimum, median, percentiles and maximum of times.
struct Times {
  explicit Times(std::vector<double> ms);
  double min = 0, median = 0, p90 = 0, p95 = 0, p99 = 0, max = 0;
};
void to_json(nlohmann::json& j, const Times& t);

struct BenchOptions {
  std::vector<std::string> cases, scenes;
  std::vector<int> threads;
  int pings = 100;
  bool curves = false;
  std::vector<std::string> given_parts;
  std::string frequency_sum = "fast";
  EngineConfig engine;
  std::uint64_t seed = 1;
  std::string scene_folder;
  std::string json_file;
  double reference_ms = 0;  // for P11: time of a frame of the public reference code on this device; 0 = not measured
};

/// An engine with its thread pool.
struct Bench {
  Parallel pool;
  std::unique_ptr<PingEngine> engine;

  /// Measuring the steps of a device is optional, because it takes time itself.
  Bench(std::shared_ptr<const Scene> scene, int threads, const BenchOptions& options, bool device_steps = false);
};

/// Computes the pings of one case, and frames them if its model has a vendor.
class Pinger {
 public:
  Pinger(const BenchCase& c, const BenchOptions& options);

  PingRequest request(int number, const Pose& sonar) const;
  /// Computes a ping and returns the seconds. `ping` receives it if not null.
  double fire(PingEngine& engine, const PingRequest& request, Ping* ping = nullptr);
  double last_frame_s() const { return frame_s_; }
  /// Computes all pings and returns the seconds. `a_call` pings are submitted at a time, and framed in parallel while the
  /// engine computes the next ones.
  double fire(PingEngine& engine, Parallel& pool, std::span<const PingRequest> requests, std::size_t a_call);
  const Switches& switches() const { return config_.engine.switches; }
  const SonarModel& model() const { return *model_; }

 private:
  BenchCase case_;
  Config config_;
  std::shared_ptr<const SonarModel> model_;
  protocol::DeviceState device_;
  double frame_s_ = 0;
};

/// Figures of a row of the table.
struct Figures {
  std::string case_name, description, scene, engine;
  Switches switches;
  std::vector<std::string> parts_had;
  int threads = 0, pings = 0;
  double cold_ms = 0, processor_ms = 0;  // time of the first ping; median processor time of the others, all threads together
  Times wall{{}};
  std::array<double, static_cast<std::size_t>(Stage::stages)> stage_ms{};  // mean per ping, summed over threads
  double frame_ms = 0;
  PingStatistics last;
  std::size_t scene_triangles = 0;
  double pings_per_second() const { return wall.median > 0 ? 1e3 / wall.median : 0; }
};

/// Measures `options.pings` pings, after a tenth as many for warming up; the sonar moves as in the case.
Figures measure(const BenchCase& c, const BenchScene& where, const Scene& scene, PingEngine& engine, int threads,
                const BenchOptions& options);
void print(const Figures& figures);
nlohmann::json json_of(const Figures& figures);

}  // namespace sonar::bench
