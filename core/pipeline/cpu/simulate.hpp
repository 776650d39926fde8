// The table of contents of a ping: from a request and the scene to samples, stage by stage. A pure function of its arguments;
// what it keeps between calls (Workspace, SurfaceCells) only saves work.
#pragma once

#include <memory>

#include "core/base/parallel.hpp"
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

  /// Asked between groups of columns; null = never. Not while a ping is under way.
  void set_between(Interruption* between);
  const PingStatistics& statistics() const;  // statistics of the last ping
  /// The next ping is of another scene.
  void change_scene();

 private:
  friend class PingSimulation;
  struct Buffers;
  std::unique_ptr<Buffers> buffers_;
};

/// `cells` must belong to the scene of `scene` and to the request's seed; bodies must have been placed. `labels`, when given, are
/// filled; the ping is the same without.
Ping simulate(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
              Workspace& work, Parallel& pool, PingLabels* labels = nullptr);

}  // namespace sonar
