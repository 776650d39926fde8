// Range images: one transmission covers the whole field of view, and each beam of a grid reports the range and strength of one
// return. This file has the vendor-independent settings and samples of such a ping.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/sonar/ping.hpp"

namespace sonar {

/// If a ping has vendor settings of this type, it is a range image, and PingSettings have other meanings. The image has
/// beam_count columns and range_bin_count rows, pulse_width_m is the width of a range cell, samples have 32 bits, and
/// format.max_code is the full scale of the strength. The mode's horizontal_aperture_rad and pattern.elevation_width_rad are
/// the field of view; the centres of the outer beams lie on its edges. pattern.azimuth_width_rad is the two-way -3 dB width of
/// a beam.
struct RangeImageSettings : VendorSettings {
  double beam_height_rad = 0;        // two-way -3 dB width of a beam in elevation
  double range_unit_m = 0;           // unit of the ranges in samples; 65535 units must be at least range_m
  std::uint32_t least_strength = 1;  // weaker returns are dropped
  double detection = 16;             // returns below this multiple of the noise power are dropped
  bool nearest = false;              // use the nearest return of a direction, not the strongest
  bool chosen_as_heard = false;      // choose the strongest cell after speckle is applied (each range cell has its own)
  bool range_of_loudest = false;  // report the range of the strongest return in the chosen cell, not the centroid of all returns
  double range_sample_m = 0;      // ranges are whole multiples of it, 0 = any
  // The filters of the device, in the order in which they are applied. The neighbours of a pixel are the pixels around it, up
  // to eight, in the same block of rows.
  int block_rows = 0;        // number of rows that form a block; each block is measured with its own speckle; 0 = all rows
  int least_confirming = 0;  // a return is dropped if fewer of its neighbours confirm it
  double confirming_m = 0;   // a neighbour confirms a return if its range differs by no more than this
  int median_passes = 0;     // number of passes that replace each range by the median of the pixel and its neighbours
};

inline const RangeImageSettings* range_image_of(const PingRequest& request) {
  return dynamic_cast<const RangeImageSettings*>(request.vendor_settings.get());
}

/// A pixel in Ping::samples, little-endian. The upper 16 bits are the strength; therefore samples can be compared as
/// levels. The lower 16 bits are the range. 0 = no return. Row 0 is the lowest. Column 0 is the one farthest to port.
struct RangePixel {
  static constexpr std::uint32_t most_range = 0xFFFF, most_strength = 0x7FFF;
  std::uint32_t strength = 0, range = 0;  // strength: amplitude, linear; range: in range_unit_m
  std::uint32_t code() const { return strength << 16 | range; }
};
constexpr std::uint32_t range_image_max_code(std::uint32_t full_scale_strength) { return full_scale_strength << 16 | 0xFFFFu; }

inline RangePixel range_pixel(const Ping& ping, std::size_t index) {
  const std::uint32_t code = sample_code(ping.samples, index, 4);
  return {code >> 16, code & 0xFFFFu};
}

/// Directions of the beams [rad]: azimuth positive to port, elevation positive up.
struct RangeImageGrid {
  int columns = 0, rows = 0;
  double horizontal_rad = 0, vertical_rad = 0;

  explicit RangeImageGrid(const PingRequest& r) : columns(r.settings.beam_count), rows(r.settings.range_bin_count) {
    const FrequencyMode& mode = r.model->modes[static_cast<std::size_t>(r.settings.mode)];
    horizontal_rad = static_cast<double>(mode.horizontal_aperture_rad);
    vertical_rad = static_cast<double>(mode.pattern.elevation_width_rad);
  }
  double column_step_rad() const { return columns > 1 ? horizontal_rad / (columns - 1) : horizontal_rad; }
  double row_step_rad() const { return rows > 1 ? vertical_rad / (rows - 1) : vertical_rad; }
  double azimuth_rad(double column) const { return horizontal_rad / 2 - column * column_step_rad(); }
  double elevation_rad(double row) const { return row * row_step_rad() - vertical_rad / 2; }
};

}  // namespace sonar
