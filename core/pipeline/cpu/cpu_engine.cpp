// The ping engine of the CPU. It owns the scene for rays, the surface cells and the buffers, and calls simulate() for each
// request.
#include <array>
#include <stdexcept>

#include "core/pipeline/cpu/simulate.hpp"
#include "core/pipeline/interleaved_pings.hpp"
#include "core/pipeline/labels.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/water_line.hpp"

namespace sonar {
namespace {

/// Runs pings between the parts of another ping, with buffers of their own. The poses of bodies and the cells are set before
/// each ping.
class CpuEngine final : public ChangingEngine, private Interruption {
 public:
  CpuEngine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options)
      : rays_(scene, pool.threads()),
        scene_(std::move(scene)),
        pool_(pool),
        options_(options),
        kernels_(simd::kernels_for(options.simd)),
        work_{Workspace(options.now_s), Workspace(options.now_s)} {}

  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    std::vector<Ping> pings;
    pings.reserve(requests.size());
    const bool is_nested = under_way_.request != nullptr;
    if (!is_nested) each_.clear();
    for (const PingRequest& picture : requests) {
      if (const std::string why = why_invalid(picture); !why.empty()) throw std::invalid_argument(why);
      PingStatistics statistics;
      pings.push_back(run_picture(picture, statistics));
      if (!is_nested) each_.push_back(statistics);
    }
    return pings;
  }

  void change_scene(const std::shared_ptr<const Scene>& scene) override {
    rays_.change(scene);
    scene_ = scene;
    if (cells_) cells_->change(scene);
    for (Workspace& work : work_) work.change_scene();
  }

  void set_interruption(Interruption* interruption) override { interruption_ = interruption; }

  std::string description() const override {
    return std::string("cpu, ") + kernels_.name + ", " + std::to_string(pool_.threads()) +
           (pool_.threads() == 1 ? " thread, " : " threads, ") + RayScene::version();
  }

  PingStatistics statistics() const override { return each_.empty() ? PingStatistics{} : each_.back(); }
  std::vector<PingStatistics> statistics_of_each() const override { return each_; }

 private:
  Ping run_picture(const PingRequest& picture, PingStatistics& statistics) {
    const std::vector<PingRequest> wanted = pings_of(picture);
    std::vector<Ping> pings;
    std::vector<PingRequest> changed;
    for (const PingRequest& request : in_water(wanted, *scene_, changed)) {
      pings.push_back(run(request, beams_of(picture, pings.size())));
      add(statistics, work_[0].statistics());
    }
    return interleaved(picture, pings);
  }
  Ping run(const PingRequest& request, BeamChoice beams) {
    const CellFields fields{request.switches.texture, request.switches.grain};
    if (!cells_ || !cells_->serves(request.seed, fields))
      cells_ = std::make_shared<SurfaceCells>(scene_, request.seed, options_.cell_cache_bytes, fields);
    place_bodies(request);
    std::shared_ptr<PingLabels> labels;
    if (request.switches.keep_labels && why_unlabelled(request, *scene_).empty())
      labels = std::make_shared<PingLabels>(no_labels(request, *scene_));
    if (labels) beams = {};
    Ping ping = under_way_.request != nullptr ? simulate(rays_, *cells_, request, kernels_, work_[1], pool_, labels.get(), beams)
                                              : run_outer(request, labels.get(), beams);
    ping.labels = std::move(labels);
    return ping;
  }
  /// Computes a ping that other pings may interrupt.
  Ping run_outer(const PingRequest& request, PingLabels* labels, BeamChoice beams) {
    under_way_ = {&request, cells_, 0};
    struct Finish {
      UnderWay& ping;
      ~Finish() { ping = {}; }
    } finish{under_way_};
    work_[0].set_between(interruption_ ? this : nullptr);
    return simulate(rays_, *under_way_.cells, request, kernels_, work_[0], pool_, labels, beams);
  }
  void place_bodies(const PingRequest& request) {
    if (!scene_->bodies_in_world.empty())
      rays_.place(request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world);
  }
  bool expected() const override { return interruption_->expected(); }
  void run_other() override {
    if (under_way_.view == 0) under_way_.view = under_way_.cells->views();
    under_way_.cells->keep_since(under_way_.view);
    interruption_->run_other();
    under_way_.cells->keep_since(0);
    place_bodies(*under_way_.request);  // the poses of the ping under way
  }

  RayScene rays_;
  std::shared_ptr<const Scene> scene_;
  Parallel& pool_;
  EngineOptions options_;
  const simd::Kernels& kernels_;
  std::shared_ptr<SurfaceCells> cells_;
  std::array<Workspace, 2> work_;     // workspaces of the ping under way and of pings that interrupt it
  std::vector<PingStatistics> each_;  // statistics of the last run
  Interruption* interruption_ = nullptr;
  struct UnderWay {
    const PingRequest* request = nullptr;
    std::shared_ptr<SurfaceCells> cells;  // an interrupting ping may need other cells
    std::uint64_t view = 0;               // the view whose tiles the ping uses
  } under_way_;
};

}  // namespace

std::unique_ptr<PingEngine> make_cpu_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options) {
  return make_changing_engine(std::move(scene), pool, options);
}

std::unique_ptr<ChangingEngine> make_changing_engine(std::shared_ptr<const Scene> scene, Parallel& pool,
                                                     const EngineOptions& options) {
  return std::make_unique<CpuEngine>(std::move(scene), pool, options);
}

}  // namespace sonar
