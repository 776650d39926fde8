// Multipath, off by default (Switches::multipath), computes echoes via flat mirrors: column signals for surfaces, and point
// echoes for point targets. It runs once for each ping, before the columns are simulated (docs/acoustics.md, section 3).
#pragma once

#include <vector>

#include "core/pipeline/multipath/multipath_scatter.hpp"
#include "core/pipeline/spectral_columns.hpp"
#include "core/pipeline/synthesize.hpp"

namespace sonar {

/// Values that are kept from ping to ping. They belong to one scene.
struct MultipathWork {
  bool faces_found = false;
  FlatFaces faces;
  ImagePaths image_paths;
  ColumnSignals columns;                     // echoes via mirrors
  bool has_echoes = false;                   // false: `columns` has no echoes
  std::vector<std::vector<Echoes>> batches;  // echoes to be summed, by batch of tiles and group of columns
  std::vector<SpectralScratch> spectral;     // per group of columns, if pulses are summed via the spectrum
};
struct MultipathCounts {
  std::size_t rays = 0, echoes = 0;
};

/// Computes `work.columns` (without the transmitter's pattern and noise) and appends the echoes of point targets via mirrors to
/// `points`. The function calls SurfaceCells::in_view(), so the results of earlier calls become invalid.
MultipathCounts simulate_multipath(const PingContext& context, MultipathWork& work, std::vector<PointEcho>& points);

/// Adds columns [first, last) of the multipath echoes to `signals`.
void add_multipath(const MultipathWork& work, int first, int last, ColumnSignals& signals);

}  // namespace sonar
