// Calls the stages of a ping, which compute samples from a request and a scene. The result depends only on the arguments. The
// state that is kept between calls (Workspace, SurfaceCells) only saves time.
#pragma once

#include <memory>

#include "core/base/parallel.hpp"
#include "core/pipeline/interleaved_pings.hpp"
#include "core/pipeline/labels.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/scene/cells/surface_cells.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// Values that are kept from ping to ping: tables of the settings, and buffers. A Workspace computes one ping at a time.
class Workspace {
 public:
  explicit Workspace(double (*now_s)() = nullptr);  // now_s: a clock for the statistics
  ~Workspace();

  /// Sets the interruption that is called between groups of columns; null = none. Do not call this function during a ping.
  void set_between(Interruption* between);
  const PingStatistics& statistics() const;  // statistics of the last ping
  /// Call it if the next ping has another scene.
  void change_scene();

 private:
  friend class PingSimulation;
  struct Buffers;
  std::unique_ptr<Buffers> buffers_;
};

/// Computes one ping. `cells` must belong to the scene of `scene` and to the request's seed; RayScene::place() must have been
/// called. If `labels` is not null, the labels are stored there; they do not change the ping. If `beams` does not contain all
/// beams, samples and truth of the others are undefined, and `labels` must be null.
Ping simulate(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
              Workspace& work, Parallel& pool, PingLabels* labels = nullptr, BeamChoice beams = {});

}  // namespace sonar
