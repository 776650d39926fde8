// Makes DISTANCE_SENSOR messages of range finders, and determines which distances a link sends, from the stamps of the
// measurements.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "core/base/geometry.hpp"
#include "protocol/mavlink/messages.hpp"

namespace sonar::mavlink {

/// A distance that a range finder measured.
struct Measured {
  std::int64_t boot_ms = 0;  // time since the start of the daemon's clock
  double range_m = 0;
  int confidence_percent = 0;            // 0 = no echo
  double nearest_m = 0, farthest_m = 0;  // limits of the sensor
  double horizontal_rad = 0, vertical_rad = 0;
  Quatd sensor_in_body;  // FLU axes of the sensor, which points along x, in FLU axes of the vehicle
  std::uint8_t sensor = 0;
};
/// Converts a measurement. Without an echo the distance is the sensor's farthest plus one centimetre, and the signal is invalid
/// (1).
DistanceSensor distance_sensor_of(const Measured& measured);

/// The requests for distances: none, all, or one per interval. In addition, a single distance can be requested.
class DistanceRequests {
 public:
  explicit DistanceRequests(bool all) {
    if (all) interval_us_ = 0;
  }

  bool wanted() const { return interval_us_ || once_; }
  void ask_once() { once_ = true; }
  /// Sets the interval of MAV_CMD_SET_MESSAGE_INTERVAL: -1 = no messages, 0 = one for each ping. Returns false for other negative
  /// numbers and NaN, which change nothing.
  bool set_interval_us(float wanted);
  /// Returns true if this distance is due, and then counts it as sent.
  bool is_due(const DistanceSensor& measured);

 private:
  std::optional<double> interval_us_;  // time between two messages of a sensor; nullopt = no messages
  bool once_ = false;
  std::map<std::uint8_t, std::uint32_t> sent_;  // stamp of each sensor's last message, in ms
};

}  // namespace sonar::mavlink
