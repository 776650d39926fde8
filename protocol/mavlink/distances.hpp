// Makes DISTANCE_SENSOR messages of range finders, and decides which distances a link sends. It uses the stamps of the
// measurements, no clock.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "core/base/geometry.hpp"
#include "protocol/mavlink/messages.hpp"

namespace sonar::mavlink {

/// A distance as a range finder measured it.
struct Measured {
  std::int64_t boot_ms = 0;  // since the start of the daemon's clock
  double range_m = 0;
  int confidence_percent = 0;            // 0 = no echo
  double nearest_m = 0, farthest_m = 0;  // limits of the sensor
  double horizontal_rad = 0, vertical_rad = 0;
  Quatd sensor_in_body;  // FLU axes of the sensor, which looks along x, in FLU axes of the vehicle
  std::uint8_t sensor = 0;
};
/// Without an echo the distance is the sensor's farthest plus one centimetre, and the signal is invalid (1).
DistanceSensor distance_sensor_of(const Measured& measured);

/// The vehicle's requests for distances: none, all, or one per interval; and requests for single ones.
class DistanceRequests {
 public:
  explicit DistanceRequests(bool all) {
    if (all) interval_us_ = 0;
  }

  bool wanted() const { return interval_us_ || once_; }
  void ask_once() { once_ = true; }
  /// Sets the interval of MAV_CMD_SET_MESSAGE_INTERVAL: -1 = no messages, 0 = one for each ping. Other negative numbers and NaN
  /// change nothing and return false.
  bool set_interval_us(float wanted);
  /// True if this distance is due. It then counts as sent.
  bool is_due(const DistanceSensor& measured);

 private:
  std::optional<double> interval_us_;  // between two messages of a sensor; absent = none
  bool once_ = false;
  std::map<std::uint8_t, std::uint32_t> sent_;  // stamp of each sensor's last message, in ms
};

}  // namespace sonar::mavlink
