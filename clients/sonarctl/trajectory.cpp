#include "clients/sonarctl/trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace sonar::clients {
namespace {

/// In FLU, a positive turn about y (port) lowers the bow.
Quatd facing(double yaw_rad, double pitch_up_rad) { return quat_from_rpy({0, -pitch_up_rad, yaw_rad}); }

}  // namespace

Moment on_circle(const Circle& c, double time_s) {
  const double rate = 2 * pi / c.period_s, angle = rate * time_s;
  const Vec3d outwards{std::cos(angle), std::sin(angle), 0};
  const Vec3d velocity = (rate * c.radius_m) * Vec3d{-std::sin(angle), std::cos(angle), 0};
  const double ahead = rate >= 0 ? angle + pi / 2 : angle - pi / 2;
  return {{c.centre_m + c.radius_m * outwards, facing(c.look_inwards ? angle + pi : ahead, c.pitch_rad)}, velocity};
}

Moment on_line(const Line& line, double time_s) {
  const Vec3d way = line.to_m - line.from_m;
  const double distance = length(way), done = std::clamp(line.speed_mps * time_s, 0.0, distance);
  const Vec3d along = distance > 0 ? (1 / distance) * way : Vec3d{1, 0, 0};
  const bool under_way = time_s >= 0 && done < distance;
  return {{line.from_m + done * along, facing(std::atan2(along.y, along.x), line.pitch_rad)},
          (under_way ? line.speed_mps : 0.0) * along};
}

}  // namespace sonar::clients
