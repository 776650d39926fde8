#include "core/pipeline/labelling_engine.hpp"

#include <stdexcept>

#include "core/pipeline/check_request.hpp"
#include "core/pipeline/simulate.hpp"
#include "core/pipeline/water_line.hpp"
#include "core/sonar/range_image.hpp"

namespace sonar {

std::string why_unlabelled(const PingRequest& request, const Scene& scene) {
  if (request.switches.mode != Mode::canonical || request.switches.fixed_fan > 0)
    return "labels need the canonical model: its surface cells belong to objects; leave out the mode and the fixed fan";
  if (range_image_of(request) != nullptr)
    return "range images have no labels: they are made without surface cells; keep_truth tells what each column sees";
  if (scene.objects.size() + scene.point_targets.size() > PingLabels::most_instances)
    return "labels are numbers of 16 bits: the scene has more than 65535 objects and point targets";
  return why_invalid(request);
}

PingLabels no_labels(const PingRequest& request, const Scene& scene) {
  const PingSettings& s = request.settings;
  const auto size = static_cast<std::size_t>(s.range_bin_count) * static_cast<std::size_t>(s.beam_count);
  PingLabels labels{s.range_bin_count, s.beam_count, {}, {}, {}, {}};
  labels.instance.resize(size), labels.share.resize(size), labels.caster.resize(size);
  for (const Object& o : scene.objects) labels.visible.push_back(o.label.empty() ? -1.0f : 0.0f);
  labels.visible.resize(scene.objects.size() + scene.point_targets.size());
  return labels;
}

struct LabellingEngine::Impl {
  Impl(std::shared_ptr<const Scene> s, Parallel& p, const EngineOptions& o)
      : rays(s, p.threads()), scene(std::move(s)), pool(p), options(o), kernels(simd::kernels_for(o.simd)), work(o.now_s) {}

  RayScene rays;
  std::shared_ptr<const Scene> scene;
  Parallel& pool;
  EngineOptions options;
  const simd::Kernels& kernels;
  std::unique_ptr<SurfaceCells> cells;
  Workspace work;
  std::vector<PingLabels> labels;
  std::vector<PingStatistics> each;
};

LabellingEngine::LabellingEngine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options)
    : impl_(std::make_unique<Impl>(std::move(scene), pool, options)) {}
LabellingEngine::~LabellingEngine() = default;

std::vector<Ping> LabellingEngine::run(std::span<const PingRequest> requests) {
  Impl& my = *impl_;
  my.labels.clear();
  my.each.clear();
  std::vector<Ping> pings;
  std::vector<PingRequest> room;
  for (const PingRequest& request : in_water(requests, *my.scene, room)) {
    if (const std::string why = why_unlabelled(request, *my.scene); !why.empty()) throw std::invalid_argument(why);
    const CellFields fields{request.switches.texture, request.switches.grain};
    if (!my.cells || !my.cells->serves(request.seed, fields))
      my.cells = std::make_unique<SurfaceCells>(my.scene, request.seed, my.options.cell_cache_bytes, fields);
    if (!my.scene->bodies_in_world.empty())
      my.rays.place(request.bodies_in_world.empty() ? my.scene->bodies_in_world : request.bodies_in_world);
    my.labels.push_back(no_labels(request, *my.scene));
    pings.push_back(simulate(my.rays, *my.cells, request, my.kernels, my.work, my.pool, &my.labels.back()));
    my.each.push_back(my.work.statistics());
  }
  tell_as_asked(requests, pings);
  return pings;
}

std::string LabellingEngine::description() const {
  return std::string("cpu, ") + impl_->kernels.name + ", " + std::to_string(impl_->pool.threads()) +
         (impl_->pool.threads() == 1 ? " thread, " : " threads, ") + RayScene::version();
}
PingStatistics LabellingEngine::statistics() const { return impl_->work.statistics(); }
std::vector<PingStatistics> LabellingEngine::statistics_of_each() const { return impl_->each; }
const std::vector<PingLabels>& LabellingEngine::labels() const { return impl_->labels; }

}  // namespace sonar
