// The table of contents of a ping: from a request and the scene to samples, stage by stage. A pure function of its arguments;
// what it keeps between calls (Workspace, SurfaceCells) only saves work.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/couple.hpp"
#include "core/pipeline/disturbances.hpp"
#include "core/pipeline/multipath/multipath.hpp"
#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/pulses/spectral_columns.hpp"
#include "core/pipeline/receive.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/pipeline/specular/specular.hpp"
#include "core/pipeline/synthesize.hpp"
#include "core/pipeline/trace_fan.hpp"
#include "core/pipeline/truth.hpp"
#include "core/pipeline/volume.hpp"
#include "core/scene/cells/surface_cells.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// What one model with one set of settings needs from ping to ping.
struct PreparedSettings {
  std::shared_ptr<const SonarModel> model;
  PingPlan plan;
  NoiseTable noise;
  std::uint64_t last_used = 0;
};

/// Buffers reused from ping to ping.
struct Workspace {
  std::vector<std::unique_ptr<PreparedSettings>> prepared;  // several sonars may take turns
  std::uint64_t pings = 0;
  MirrorEchoes mirror_echoes;
  std::vector<LawTable> laws;  // the tiles point into it
  std::vector<TileToSound> tiles;
  std::vector<std::vector<std::uint32_t>> tiles_by_group;
  MultipathWork multipath;
  ColumnSignals columns;
  std::vector<BeamTruth> first_hits;  // by column, when switches.keep_truth
  struct PerWorker {
    FanScratch fan;
    DepthMap seen;
    std::vector<FanHit> hits;
    Echoes echoes;
    VolumeScratch volume;
    SpectralScratch spectral;
    CoupleScratch couple;
    BeamSignals beams;
    ReceiveScratch receive;
    PingStatistics statistics;
  };
  std::vector<PerWorker> workers;
  PingStatistics statistics;
  double (*now_s)() = nullptr;
  Interruption* between = nullptr;  // is asked between the groups of columns; null = nobody
};

/// `cells` must belong to the scene of `scene` and to the request's seed; bodies must have been placed.
Ping simulate(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
              Workspace& work, Parallel& pool);

}  // namespace sonar
