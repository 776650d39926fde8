// Multipath, opt-in (Switches::multipath): everything that comes back by way of flat mirrors, as signals of their own columns
// that are added to the direct ones. Runs once per ping before the columns are sounded (docs/acoustics.md, section 3).
#pragma once

#include <vector>

#include "core/pipeline/multipath/multipath_scatter.hpp"
#include "core/pipeline/pulses/spectral_columns.hpp"
#include "core/pipeline/synthesize.hpp"

namespace sonar {

/// Kept from ping to ping; belongs to one scene.
struct MultipathWork {
  bool faces_found = false;
  FlatFaces faces;
  Ways ways;
  ColumnSignals columns;                     // echoes by way of mirrors
  bool heard = false;                        // whether there are any
  std::vector<std::vector<Echoes>> batches;  // echoes waiting, per batch of tiles and group of columns
  std::vector<SpectralScratch> spectral;     // per group of columns, where pulses are summed by way of the spectrum
};
struct MultipathCounts {
  std::size_t rays = 0, echoes = 0;
};

/// Fills `work.columns` (before the transmitter's pattern and noise) and appends the ghosts of point targets to `points`.
/// Calls cells.in_view: results of earlier calls become invalid.
MultipathCounts sound_ghosts(const RayScene& scene, SurfaceCells& cells, std::span<const Pose> bodies_in_world,
                             const std::vector<LawTable>& laws, const PingPlan& plan, const PingScalars& scalars,
                             const simd::Kernels& kernels, Parallel& pool, MultipathWork& work, std::vector<PointEcho>& points);

/// Adds columns [first, last) of what was heard to `signals`.
void add_ghosts(const MultipathWork& work, int first, int last, ColumnSignals& signals);

}  // namespace sonar
