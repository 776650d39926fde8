// The products: beams, limits, range modes. Sources: protocol/dvl/README.md.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/base/geometry.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar::dvl {

inline constexpr std::size_t beam_count = 4;
inline constexpr double tilt_rad = rad_from_deg(22.5);  // angle between a beam and the axis
/// Altitude above level ground divided by the distance along a beam.
inline const double altitude_per_distance = std::cos(tilt_rad);

struct Product {
  const char *profile, *name;
  std::uint16_t part_number;
  double centre_hz, beam_deg, source_level_db, highest_m, fastest_mps;
  double range_unit_m;  // unit of the ranges in the pixels of its pings
};
const Product& product_of(const SonarModel& model);
std::span<const std::shared_ptr<const SonarModel>> models();
/// The model of a replay of this product. A device of this model sends no positions of its own; they are among the recorded
/// reports.
std::shared_ptr<const SonarModel> replayed_model(const SonarModel& recorded);

struct RangeMode {
  double lowest_m, highest_m;  // altitudes
  float rate_hz;
  double pulse_m;  // unknown: assumed
};
inline constexpr int range_mode_count = 5;
RangeMode range_mode(int index, const Product& product);

/// Unit vector of a beam in the device's frame: x forward, y to starboard, z down.
Vec3d beam_direction(std::size_t beam);

/// A ping is computed as a range image of `grid_size` by `grid_size` directions about the device's axis; the beams are four of
/// them.
inline constexpr int grid_size = 27;
/// Index of a beam's pixel in Ping::samples.
std::size_t pixel_of(std::size_t beam);

/// Converts a vector from the sonar's axes (it looks along x, z up) to the device's frame. The same formula converts back.
constexpr Vec3d device_from_sonar(Vec3d v) { return {v.z, -v.y, v.x}; }

}  // namespace sonar::dvl
