// DISTANCE_SENSOR: the message of a range finder's distance, and which of its distances a link sends. No clock: the stamps of the
// measurements count.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "core/base/geometry.hpp"
#include "protocol/mavlink/messages.hpp"

namespace sonar::mavlink {

/// A distance as a range finder measured it.
struct Measured {
  std::int64_t boot_ms = 0;  // since the daemon's clock began
  double range_m = 0;
  int confidence_percent = 0;            // 0 = no echo
  double nearest_m = 0, farthest_m = 0;  // what the sensor can measure
  double horizontal_rad = 0, vertical_rad = 0;
  Quatd sensor_in_body;  // FLU axes of the sensor, which looks along x, in FLU axes of the vehicle
  std::uint8_t sensor = 0;
};
/// Without an echo the distance is one centimetre more than the sensor's farthest, and the signal is invalid (1).
DistanceSensor distance_sensor_of(const Measured& measured);

/// The request for distances: none, all, or one each interval; and single ones.
class DistanceRequests {
 public:
  explicit DistanceRequests(bool all) {
    if (all) interval_us_ = 0;
  }

  bool wanted() const { return interval_us_ || once_; }
  void ask_once() { once_ = true; }
  /// Sets the interval as MAV_CMD_SET_MESSAGE_INTERVAL gives it: -1 = no messages, 0 = one for each ping. False: another negative
  /// number or NaN, which changes nothing.
  bool set_interval_us(float wanted);
  /// Whether this distance is to be sent. It then counts as sent.
  bool is_due(const DistanceSensor& measured);

 private:
  std::optional<double> interval_us_;  // between two messages of a sensor; absent = none
  bool once_ = false;
  std::map<std::uint8_t, std::uint32_t> sent_;  // stamp of each sensor's last message, in ms
};

}  // namespace sonar::mavlink
