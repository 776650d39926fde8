#include "protocol/mavlink/distances.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace sonar::mavlink {
namespace {

/// MAV_SENSOR_ORIENTATION of common.xml.
enum Orientation : std::uint8_t {
  ahead = 0,
  starboard = 2,
  astern = 4,
  port = 6,
  up = 24,
  down = 25,  // MAV_SENSOR_ROTATION_PITCH_270
  custom = 100,
};
constexpr double axis_tolerance = 0.966;  // cosine of 15 deg (our choice): within 15 deg a sensor counts as along an axis

std::uint16_t centimetres(double m) { return static_cast<std::uint16_t>(std::lround(std::clamp(100 * m, 0.0, 65535.0))); }

}  // namespace

DistanceSensor distance_sensor_of(const Measured& measured) {
  DistanceSensor m;
  m.boot_ms = static_cast<std::uint32_t>(measured.boot_ms);
  m.min_cm = centimetres(measured.nearest_m);
  m.max_cm = static_cast<std::uint16_t>(std::min<int>(centimetres(measured.farthest_m), 65534));
  const bool has_echo = measured.confidence_percent > 0;
  m.current_cm = has_echo ? centimetres(measured.range_m) : static_cast<std::uint16_t>(m.max_cm + 1);
  m.signal_percent = has_echo ? static_cast<std::uint8_t>(std::clamp(measured.confidence_percent, 2, 100)) : std::uint8_t{1};
  m.sensor = measured.sensor;
  m.horizontal_fov_rad = static_cast<float>(measured.horizontal_rad);
  m.vertical_fov_rad = static_cast<float>(measured.vertical_rad);

  const Vec3d direction = rotate(measured.sensor_in_body, {1, 0, 0});
  constexpr std::array<std::pair<Vec3d, Orientation>, 6> axes{{{{1, 0, 0}, ahead},
                                                               {{0, -1, 0}, starboard},
                                                               {{-1, 0, 0}, astern},
                                                               {{0, 1, 0}, port},
                                                               {{0, 0, 1}, up},
                                                               {{0, 0, -1}, down}}};
  const auto along =
      std::find_if(axes.begin(), axes.end(), [&](const auto& axis) { return dot(direction, axis.first) >= axis_tolerance; });
  m.orientation = along != axes.end() ? along->second : custom;
  if (m.orientation == custom) {
    // The message has the rotation between FRD axes. Half turns about x, before and after the rotation, change the signs of y and
    // z.
    const Quatd& q = measured.sensor_in_body;
    m.wxyz = {static_cast<float>(q.w), static_cast<float>(q.x), static_cast<float>(-q.y), static_cast<float>(-q.z)};
  }
  return m;
}

bool DistanceRequests::set_interval_us(float wanted) {
  if (wanted == -1)
    interval_us_.reset();
  else if (wanted >= 0)  // false for NaN, too
    interval_us_ = wanted;
  else
    return false;
  return true;
}

bool DistanceRequests::is_due(const DistanceSensor& measured) {
  const auto last = sent_.find(measured.sensor);
  const double passed_us = last == sent_.end() ? INFINITY : 1e3 * static_cast<double>(measured.boot_ms - last->second);
  // Stamps are cut to whole milliseconds, so an interval that has passed may seem up to one millisecond too short.
  const bool due = std::exchange(once_, false) || (interval_us_ && passed_us + 1000 >= *interval_us_);
  if (due) sent_[measured.sensor] = measured.boot_ms;
  return due;
}

}  // namespace sonar::mavlink
