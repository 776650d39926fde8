// The CPU's ping engine: owns the rays' scene, the surface cells and the buffers, and runs simulate() for each request.
#include <stdexcept>

#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/simulate.hpp"

namespace sonar {
namespace {

class CpuEngine final : public PingEngine {
 public:
  CpuEngine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options)
      : rays_(scene, pool.threads()),
        scene_(std::move(scene)),
        pool_(pool),
        options_(options),
        kernels_(simd::kernels_for(options.simd)) {
    work_.now_s = options.now_s;
  }

  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    std::vector<Ping> pings;
    pings.reserve(requests.size());
    for (const PingRequest& request : requests) {
      if (const std::string why = why_invalid(request); !why.empty()) throw std::invalid_argument(why);
      if (!cells_ || !cells_->serves(request.seed, request.switches.texture))
        cells_ = std::make_unique<SurfaceCells>(scene_, request.seed, options_.cell_cache_bytes, request.switches.texture);
      if (!scene_->bodies_in_world.empty())
        rays_.place(request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world);
      pings.push_back(simulate(rays_, *cells_, request, kernels_, work_, pool_));
    }
    return pings;
  }

  std::string description() const override {
    return std::string("cpu, ") + kernels_.name + ", " + std::to_string(pool_.threads()) +
           (pool_.threads() == 1 ? " thread, " : " threads, ") + RayScene::version();
  }

  PingStatistics statistics() const override { return work_.statistics; }

 private:
  RayScene rays_;
  std::shared_ptr<const Scene> scene_;
  Parallel& pool_;
  EngineOptions options_;
  const simd::Kernels& kernels_;
  std::unique_ptr<SurfaceCells> cells_;
  Workspace work_;
};

}  // namespace

std::unique_ptr<PingEngine> make_cpu_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options) {
  return std::make_unique<CpuEngine>(std::move(scene), pool, options);
}

}  // namespace sonar
