#include "core/paper/paper_fan.hpp"

#include <algorithm>

namespace sonar::paper {
namespace {

constexpr double widest_half_angle_rad = 1.48;  // 85 degrees: an image plane has no pixels at 90

/// Width of each column: half the distance between its neighbours; for an outermost column, the distance to its neighbour.
std::vector<double> widths_of(const std::vector<double>& centres, double lone) {
  const std::size_t n = centres.size();
  if (n < 2) return std::vector<double>(n, lone);
  std::vector<double> widths(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, n - 1);
    widths[i] = (centres[before] - centres[after]) / static_cast<double>(after - before);
  }
  return widths;
}

void tabulate(PaperFan& fan) {
  // A direction is computed from the values of its column and of its row.
  for (const double azimuth : fan.azimuth_rad)
    fan.ahead.push_back(fan.perspective ? Vec3d{1, std::tan(azimuth), 0} : Vec3d{std::cos(azimuth), std::sin(azimuth), 0});
  for (int row = 0; row < fan.rows; ++row) {
    // Elevation [rad], or its tangent on the image plane.
    const double up = fan.first_row + row * fan.row_step;
    fan.level.push_back(fan.perspective ? 1 : std::cos(up));
    fan.rise.push_back(fan.perspective ? up : std::sin(up));
  }
}

}  // namespace

PaperFan make_paper_fan(const PingPlan& plan, Mode mode, int rays) {
  PaperFan fan;
  fan.perspective = mode == Mode::raster;
  fan.rows = rays > 0 ? rays : fan.perspective ? default_raster_rows : default_rays;
  // Half of the fan's angle. The fan's angle is twice the quoted width, as in Choi 2025 (P25).
  const double vertical = std::min(static_cast<double>(plan.mode.pattern.elevation_width_rad), widest_half_angle_rad);
  const double top = fan.perspective ? std::tan(vertical) : vertical;
  fan.row_step = 2 * top / fan.rows;
  // Rows lie in the middle of equal steps.
  fan.first_row = -top + 0.5 * fan.row_step;

  const double aperture = static_cast<double>(plan.mode.horizontal_aperture_rad);
  if (!fan.perspective) {
    // A column has a constant azimuth; it is not a cone about the array (oracle 46).
    for (const double sine : plan.beam_sine) fan.azimuth_rad.push_back(std::asin(sine));
    fan.column_width = widths_of(fan.azimuth_rad, aperture);
    tabulate(fan);
    return fan;
  }
  // Pixels are uniform in the tangent of azimuth.
  const double side = std::tan(std::min(0.5 * aperture, widest_half_angle_rad));
  const int columns = plan.settings.beam_count;
  for (int i = 0; i < columns; ++i) fan.azimuth_rad.push_back(std::atan(side * (1 - (2.0 * i + 1) / columns)));
  fan.column_width.assign(static_cast<std::size_t>(columns), 2 * side / columns);
  tabulate(fan);
  return fan;
}

Vec3d PaperFan::direction(int column, int row) const {
  const Vec3d& to = ahead[static_cast<std::size_t>(column)];
  const auto r = static_cast<std::size_t>(row);
  if (!perspective) return {level[r] * to.x, level[r] * to.y, rise[r]};
  const Vec3d pixel{1, to.y, rise[r]};
  return (1 / length(pixel)) * pixel;
}

double PaperFan::solid_angle_sr(int column, int row) const {
  const double cell = column_width[static_cast<std::size_t>(column)] * row_step;
  // The solid angle [sr] of P25's eq. (2) as printed: dtheta dphi, without cos(phi).
  if (!perspective) return cell;
  const double x = direction(column, row).x;  // a pixel of the plane x = 1 has the solid angle dy dz x^3
  return cell * x * x * x;
}

void trace_column(const RayScene& scene, const PaperFan& fan, const PingScalars& scalars, int column, float far_m,
                  std::vector<PaperHit>& hits) {
  RayPacket packet{};
  const Vec3 origin = scalars.position_in_scene;
  for (int from = 0; from < fan.rows; from += RayPacket::size) {
    const int count = std::min(RayPacket::size, fan.rows - from);
    for (int lane = 0; lane < count; ++lane) {
      const Vec3 along = to_float(scalars.world_from_sonar * fan.direction(column, from + lane));
      packet.origin_x[lane] = origin.x, packet.origin_y[lane] = origin.y, packet.origin_z[lane] = origin.z;
      packet.direction_x[lane] = along.x, packet.direction_y[lane] = along.y, packet.direction_z[lane] = along.z;
      packet.far[lane] = far_m;
    }
    scene.trace(packet, count == RayPacket::size ? 0xFFFFu : (1u << count) - 1u, true);
    for (int lane = 0; lane < count; ++lane) {
      if (packet.object[lane] == RayPacket::miss) continue;
      const Vec3 normal{packet.normal_x[lane], packet.normal_y[lane], packet.normal_z[lane]};
      const Vec3 along{packet.direction_x[lane], packet.direction_y[lane], packet.direction_z[lane]};
      // Triangles without an area have no normal.
      if (!(length(normal) > 0)) continue;
      const int row = from + lane;
      hits.push_back({column, row, static_cast<double>(packet.far[lane]), fan.elevation_rad(column, row),
                      std::min(1.0, static_cast<double>(std::abs(dot(normal, along)) / length(normal))),
                      fan.solid_angle_sr(column, row), packet.object[lane], packet.triangle[lane]});
    }
  }
}

}  // namespace sonar::paper
