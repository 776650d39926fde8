#include "protocol/dvl/settings.hpp"

#include <cmath>

namespace sonar::dvl {
namespace {

// Columns: profile, name, part number, carrier [Hz], beam width [deg], source level [dB], highest altitude [m], fastest velocity
// [m/s], unit of the ranges in a ping [m].
constexpr std::array<Product, 2> products{{
    {"dvl-a50", "DVL A50", 21035, 1e6, 4.4, 197, 50, 3.75, 0.001},
    {"dvl-a125", "DVL A125", 21037, 420e3, 4.1, 198, 125, 9, 0.0025},
}};
constexpr std::array<double, beam_count> azimuth_deg{135, -135, -45, 45};  // from forward to starboard

// The grid has `margin` steps beyond each beam, so that it contains the width of the beam, and `steps_between` between two beams.
constexpr int margin = 3, steps_between = grid_size - 1 - 2 * margin;
/// Azimuth and elevation of the beam ahead to port in the sonar's axes; those of other beams differ in sign.
struct Corner {
  double azimuth_rad, elevation_rad;
};
Corner corner() {
  const double side = std::sin(tilt_rad) * std::sqrt(0.5);
  return {std::atan2(side, std::cos(tilt_rad)), std::asin(side)};
}

SonarModel model_of(const Product& product) {
  FrequencyMode mode;
  mode.name = product.centre_hz < 1e6 ? "420 kHz" : "1 MHz";
  mode.centre_hz = static_cast<float>(product.centre_hz);
  const double extent = 2.0 * (grid_size - 1) / steps_between;
  mode.horizontal_aperture_rad = static_cast<float>(extent * corner().azimuth_rad);
  mode.pattern.elevation_width_rad = static_cast<float>(extent * corner().elevation_rad);
  // A beam transmits and receives, so the two-way width is smaller by a factor of sqrt(2).
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(product.beam_deg) / std::sqrt(2.0));
  mode.beam_spacing = BeamSpacing::uniform_in_angle;
  mode.min_range_m = 0;
  mode.max_range_m = static_cast<float>(product.highest_m / altitude_per_distance);
  mode.source_level_db = static_cast<float>(product.source_level_db);
  mode.receiver.tvg_slope_db = 40;  // keeps echoes of all distances within 15 bits
  mode.receiver.tvg_minimum_range_m = 0.02f;
  mode.receiver.tvg_ceiling_db = 200;
  mode.receiver.full_scale_upa = 1e10f;  // unknown: full scale of an echo at 1 m
  SonarModel model;
  model.profile = product.profile;
  model.name = product.name;
  model.part_number = product.part_number;
  model.max_rate_hz = 15;
  model.modes = {mode};
  return model;
}

using Models = std::array<std::shared_ptr<const SonarModel>, products.size()>;
Models all_models() {
  return {std::make_shared<const SonarModel>(model_of(products[0])), std::make_shared<const SonarModel>(model_of(products[1]))};
}

}  // namespace

const Product& product_of(const SonarModel& model) {
  for (const Product& product : products)
    if (product.part_number == model.part_number) return product;
  return products.front();
}

std::span<const std::shared_ptr<const SonarModel>> models() {
  static const Models all = all_models();
  return all;
}

std::shared_ptr<const SonarModel> replayed_model(const SonarModel& recorded) {
  static const Models all = all_models();
  return all[static_cast<std::size_t>(&product_of(recorded) - products.data())];
}

RangeMode range_mode(int index, const Product& product) {
  constexpr std::array<RangeMode, range_mode_count> all{
      {{0.05, 0.6, 15, 0.01}, {0.3, 3, 10, 0.03}, {1.5, 14, 5.5, 0.1}, {7.7, 36, 7.5, 0.2}, {15, 0, 3, 0.4}}};
  RangeMode mode = all[static_cast<std::size_t>(index)];
  if (mode.highest_m == 0) mode.highest_m = product.highest_m;
  return mode;
}

Vec3d beam_direction(std::size_t beam) {
  const double azimuth = rad_from_deg(azimuth_deg[beam]), out = std::sin(tilt_rad);
  return {out * std::cos(azimuth), out * std::sin(azimuth), std::cos(tilt_rad)};
}

std::size_t pixel_of(std::size_t beam) {
  const Vec3d at = beam_direction(beam);
  // Columns count from port, rows from the lowest elevation. The sonar points along the device's z axis, with its own z axis
  // forward, so row 0 is aft.
  const int column = at.y < 0 ? margin : margin + steps_between, row = at.x < 0 ? margin : margin + steps_between;
  return static_cast<std::size_t>(row * grid_size + column);
}

}  // namespace sonar::dvl
