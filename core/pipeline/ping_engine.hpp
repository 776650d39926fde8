// The seam between the daemon and whatever computes pings: CPU here, CUDA in cuda/.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Instruction sets the hot loops are compiled for; chosen at run time.
enum class SimdLevel { automatic, portable, avx2, avx512 };

struct EngineOptions {
  SimdLevel simd = SimdLevel::automatic;
  std::size_t cell_cache_bytes = 160u << 20;
};

/// Wall time of each stage of the last ping [s], in the order they run.
struct StageTime {
  const char* stage = "";
  double seconds = 0;
};

class PingEngine {
 public:
  virtual ~PingEngine() = default;
  /// Requests must be valid (see validate_request). One caller at a time.
  virtual std::vector<Ping> run(std::span<const PingRequest> requests) = 0;
  virtual std::string description() const = 0;  // "cpu, AVX-512, 2 threads, Embree 3.13.5"
  virtual std::vector<StageTime> last_stage_times() const { return {}; }
};

/// Builds the acceleration structures; the pool must outlive the engine.
std::unique_ptr<PingEngine> make_cpu_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options = {});

}  // namespace sonar
