// Calls the stages of a ping, which make samples of a request and a scene. The result depends only on the arguments; values kept
// between calls (Workspace, SurfaceCells) only save work.
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

/// Values kept from ping to ping: tables of the settings and buffers. One ping at a time.
class Workspace {
 public:
  explicit Workspace(double (*now_s)() = nullptr);  // a clock for the statistics
  ~Workspace();

  /// Sets the interruption that is tried between groups of columns; null = none. Must not be called during a ping.
  void set_between(Interruption* between);
  const PingStatistics& statistics() const;  // statistics of the last ping
  /// To be called when the next ping has another scene.
  void change_scene();

 private:
  friend class PingSimulation;
  struct Buffers;
  std::unique_ptr<Buffers> buffers_;
};

/// `cells` must belong to the scene of `scene` and to the request's seed; bodies must have been placed. If `labels` is not
/// null, it is filled; the ping does not depend on it. If `beams` are not all, the samples and the truth of the others are
/// undefined, and labels must be null.
Ping simulate(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
              Workspace& work, Parallel& pool, PingLabels* labels = nullptr, BeamChoice beams = {});

}  // namespace sonar
