// Echoes via mirrors. A path out and a path back form a pair between the sonar and a cell or a point target. Pairs that differ
// only in direction have the same delay and phase, so they add coherently (docs/acoustics.md, section 3).
#pragma once

#include <vector>

#include "core/pipeline/multipath/multipath_trace.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/scene/cells/surface_cells.hpp"

namespace sonar {

/// The inputs for the echoes of one ping via mirrors.
struct ImagePaths {
  std::vector<FlatMirror> mirrors;
  std::vector<Path> paths;  // paths that a part of the map belongs to; [0] is the straight path
  BounceMap map;
  BubbleLayer bubbles;
};

/// Finds the lengths of a path at which a ball around a point is visible, with a delay within the record. The point is in the
/// axes of PingScalars::seen_from.
class PathReach {
 public:
  PathReach(const Path& path, const ImagePaths& image_paths, const PingPlan& plan, const PingScalars& scalars);
  std::optional<DistanceSpan> seen_between(Vec3d place, double radius_m) const;

 private:
  const Path& path_;
  const ImagePaths& image_paths_;
  struct Span {
    double low_rad = 1, high_rad = -1;  // elevations; initially an empty interval
  };
  const PingPlan& plan_;
  double longest_m_;         // length of the ways out and back together
  std::vector<Span> spans_;  // spans of the path's windows for each block of columns
};

/// Amplitude of one pattern, of the transmitter or the receiver, at an elevation.
class OneWayPattern {
 public:
  explicit OneWayPattern(const BeamPattern& pattern);
  float operator()(float squared_sine) const;

 private:
  float aperture_ = 0;  // wavelengths, 0 = no pattern
};

/// Computes the echoes of tiles of cells via mirrors. Each worker has one object for each ping.
class MultipathScatterer {
 public:
  static constexpr int group_columns = 64;  // echoes are sorted by groups of this many receiving columns

  MultipathScatterer(const PingContext& context, const ImagePaths& image_paths, const std::vector<PathReach>& reach,
                     const std::vector<float>& beam_correlation);
  void scatter(const TileInView& tile, std::vector<Echoes>& by_group);

 private:
  struct TilePath {  // a path to one tile
    const Path* path;
    float from_sonar_object[3], from_sonar[3], turn[9];  // geometry of the tile's image, as in simd::TileSeen
    float range_m, sample_shift, half_turns, amplitude;
    float reflection, rough_normal[2][3];  // product of the mirrors' Rc; their normals times sqrt(2) k h, sonar axes
    float lit_normal[3], lit_height;       // object axes; points with dot + height above 0 are lit by the last mirror
  };
  struct Arrival {                      // values of one cell for one path
    float range_m, sample_shift, size;  // size: pressure per source, includes the root of the scattering law
    std::complex<float> carried;        // `size` with the carrier's phase
    float transmit, sine;
    int column;
    bool front;  // side of the surface
  };
  struct Cell {
    float x, y, z;  // relative to the tile's centre [m]
    float normal[3];
    std::complex<float> weight;  // xi * root of the area * source * sqrt(mu); in expected power without xi
  };

  TilePath look_at(const TileInView& tile, const Path& path) const;
  void scatter_cell(const Cell& cell, const LawTable& law, const CellLevel& level, std::vector<Echoes>& by_group);
  bool arrive(const TilePath& tile_path, const Cell& cell, float range_m, float offset_m, const LawTable& law,
              Arrival& out) const;
  void pair_up(const Cell& cell, float fade, std::vector<Echoes>& by_group) const;
  void add(float sample, std::complex<float> amplitude, int column, std::vector<Echoes>& by_group) const;
  float beam_correlation(const Arrival& a, const Arrival& b) const;
  bool is_visible(const Path& path, int column, float bin, float nearness) const;

  const ImagePaths& image_paths_;
  const std::vector<PathReach>& reach_;
  const SurfaceCells& cells_;
  const std::vector<LawTable>& laws_;
  const std::vector<float>& beam_correlation_;
  const PingPlan& plan_;
  const PingScalars& s_;
  OneWayPattern pattern_;
  float first_edge_sine_, columns_per_sine_, tolerance_m_, absorption_np_per_m_, half_turns_per_m_;
  const std::vector<float>& turned_away_;
  float away_ = 0;     // TileSeen::turned_away of the tile's object
  Vec3d tile_middle_;  // position of a cell of the tile, in the axes of PingScalars::seen_from
  std::vector<TilePath> tile_paths_;
  std::vector<Arrival> arrivals_;
  bool direct_ = false;  // whether arrivals_[0] is the direct path
};

/// sum_k W(k) W(k + n) / sum_k W(k)^2 of the receive pattern over columns: the correlation of two columns that are n columns
/// apart.
std::vector<float> beam_correlation_over_columns(const PingPlan& plan);

/// Computes the echoes of the point targets via mirrors and appends them to `points`.
void multipath_of_points(const PingContext& context, const FlatFaces& faces, const ImagePaths& image_paths,
                         std::vector<PointEcho>& points);

}  // namespace sonar
