// The interface between the daemon and the engines that compute pings: the CPU engine here, the CUDA engine in cuda/.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/simd/simd_level.hpp"
#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

struct EngineOptions {
  SimdLevel simd = SimdLevel::automatic;
  std::size_t cell_cache_bytes = 160u << 20;
  double (*now_s)() = nullptr;  // a clock for PingStatistics; core/ has none of its own
};

enum class Stage { specular, multipath, cull, build_cells, trace, scatter, synthesize, noise, form_beams, receive, stages };
inline constexpr std::array<const char*, static_cast<std::size_t>(Stage::stages)> stage_names{
    "specular", "multipath", "cull", "build cells", "trace", "scatter", "synthesize", "noise", "form beams", "receive"};

/// Counts and times of one ping, for the benchmark. Times stay 0 without a clock.
struct PingStatistics {
  std::array<double, static_cast<std::size_t>(Stage::stages)> seconds{};  // summed over workers
  std::size_t rays = 0, tiles = 0, tiles_built = 0, cells = 0, echoes = 0, cell_bytes = 0;
};

inline void add(PingStatistics& to, const PingStatistics& more) {
  for (std::size_t s = 0; s < to.seconds.size(); ++s) to.seconds[s] += more.seconds[s];
  to.rays += more.rays, to.tiles += more.tiles, to.tiles_built += more.tiles_built, to.cells += more.cells;
  to.echoes += more.echoes;
  to.cell_bytes = more.cell_bytes;
}

/// Runs short pings of other sonars between the parts of a long one.
class Interruption {
 public:
  virtual ~Interruption() = default;
  /// True if another ping is likely to be requested. The present ping is then computed in smaller parts.
  virtual bool expected() const = 0;
  /// The engine calls it between two parts, on the thread of run(). An implementation may call run() of the same engine; this
  /// inner run() does not call run_other().
  virtual void run_other() = 0;
};

/// This is thrown if the device that an engine needs has failed and the options allow no other device.
class EngineUnavailable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class PingEngine {
 public:
  virtual ~PingEngine() = default;
  /// Computes the pings. Throws std::invalid_argument with the reason if a request cannot be simulated (why_invalid()). Only
  /// one thread may call it at a time.
  virtual std::vector<Ping> run(std::span<const PingRequest> requests) = 0;
  /// submit() and collect() are the two halves of run(). An engine with a device works on the requests while the caller uses
  /// the pings of an earlier submit(). Requests are copied. collect() throws the exceptions that run() would throw.
  virtual void submit(std::span<const PingRequest> requests) { submitted_.emplace_back(requests.begin(), requests.end()); }
  /// Returns the pings of the oldest submit() that has not been collected. There must be one.
  virtual std::vector<Ping> collect() {
    const std::vector<PingRequest> requests = std::move(submitted_.front());
    submitted_.pop_front();
    return run(requests);
  }
  /// Largest number of requests like these two that one run() computes faster than several runs. 1: a common run is not faster,
  /// or delays one of the two too much.
  virtual std::size_t most_together(const PingRequest& /*a*/, const PingRequest& /*b*/) const { return 1; }
  /// Sets the interruption; null = none. Engines that cannot be interrupted ignore it. It must not be called during a ping.
  virtual void set_interruption(Interruption* /*interruption*/) {}
  virtual std::string description() const = 0;  // "cpu, AVX-512, 2 threads, Embree 3.13.5"
  /// Statistics of the last ping.
  virtual PingStatistics statistics() const { return {}; }
  /// Statistics of each ping of the last run() or collect(), in their order.
  virtual std::vector<PingStatistics> statistics_of_each() const { return {statistics()}; }

 private:
  std::deque<std::vector<PingRequest>> submitted_;  // requests to engines that compute only when their results are collected
};

/// Builds the acceleration structures; the pool must outlive the engine.
std::unique_ptr<PingEngine> make_cpu_engine(std::shared_ptr<const Scene> scene, Parallel& pool,
                                            const EngineOptions& options = {});

// The CPU engine for pings of many similar scenes, such as data sets.

class ChangingEngine : public PingEngine {
 public:
  /// Replaces the scene. It keeps the tables of the settings, and the trees and cells of meshes that both scenes share (the
  /// same object in memory, not only an equal one). The next pings equal those of a new engine.
  virtual void change_scene(const std::shared_ptr<const Scene>& scene) = 0;
};

/// Like make_cpu_engine().
std::unique_ptr<ChangingEngine> make_changing_engine(std::shared_ptr<const Scene> scene, Parallel& pool,
                                                     const EngineOptions& options = {});

// Checks whether a request can be simulated. Every engine makes this check before a ping.

/// Returns the reason, one sentence, why a request cannot be simulated; empty if it can be simulated.
std::string why_invalid(const PingRequest& request);

}  // namespace sonar
