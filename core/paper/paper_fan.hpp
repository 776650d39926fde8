// The rays of the two comparison modes: every ray is a scatterer, as in Choi 2025 (Sensors 25(5):1516) and the older raster
// method. First stage of core/paper; docs/acoustics.md, section 8.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar::paper {

/// Default number of rays per column: the number in the paper's model, and the number of rows in its raster run.
inline constexpr int default_rays = 300, default_raster_rows = 11;

/// Directions of the rays, with one column per beam. The rays of a fan (paper) are uniform in azimuth and elevation, those of a
/// grid (raster) are uniform on an image plane ahead of the sonar, like the pixels of a camera.
struct PaperFan {
  bool perspective = false;
  std::vector<double> azimuth_rad;     // [columns] falling from port to starboard: directions of the beams
  std::vector<double> column_width;    // [columns] width in azimuth [rad]; perspective: in its tangent
  double first_row = 0, row_step = 0;  // elevation [rad] of row 0; perspective: its tangent over the horizontal x axis
  int rows = 0;
  std::vector<Vec3d> ahead;         // [columns]: the part of the direction that depends on the column
  std::vector<double> level, rise;  // [rows]: parts of the direction that depend on the row

  int columns() const { return static_cast<int>(azimuth_rad.size()); }
  /// Unit vector in the sonar's frame.
  Vec3d direction(int column, int row) const;
  double elevation_rad(int column, int row) const {
    return perspective ? std::asin(direction(column, row).z) : first_row + row * row_step;
  }
  /// Solid angle of a ray [sr]. Fan: dtheta dphi, without cos(phi), as printed in eq. (2).
  double solid_angle_sr(int column, int row) const;
};

/// `mode` is paper or raster; `rays` is the number of rays per column, 0 = the default. The fan spans twice the quoted vertical
/// width (P900: 40 degrees for 20), like the paper's model.
PaperFan make_paper_fan(const PingPlan& plan, Mode mode, int rays);

/// The hit of a ray on a surface.
struct PaperHit {
  int column = 0, row = 0;
  double range_m = 0;
  double elevation_rad = 0;
  double cosine = 0;  // cosine of the angle of incidence, with the normal of the triangle
  double solid_angle_sr = 0;
  std::uint32_t object = 0, triangle = 0;
};

/// Appends the hits of one column, lowest row first.
void trace_column(const RayScene& scene, const PaperFan& fan, const PingScalars& scalars, int column, float far_m,
                  std::vector<PaperHit>& hits);

}  // namespace sonar::paper
