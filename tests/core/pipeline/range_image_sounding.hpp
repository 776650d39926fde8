// Pings of a sonar that makes range images, for tests.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "core/base/units.hpp"
#include "core/sonar/range_image.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {

inline constexpr std::uint32_t full_scale = 400;

struct Wanted final : RangeImageSettings {
  bool equals(const VendorSettings&) const override { return true; }
};

/// 256 x 64 beams of 1.5 degrees over 90 x 40 degrees, up to 15 m.
class RangeImageSounding {
 public:
  explicit RangeImageSounding(std::shared_ptr<const Scene> scene, int threads = 2)
      : sounding_(std::move(scene), mode(), settings(), {.threads = threads, .engine = {}}), wanted(std::make_shared<Wanted>()) {
    wanted->beam_height_rad = rad_from_deg(1.5);
    wanted->range_unit_m = 50.0 / 65536;
    wanted->least_strength = 31;
    request().vendor_settings = wanted;
    request().switches.keep_pressure = false;
  }
  PingRequest& request() { return sounding_.request; }
  const Ping& ping() { return sounding_.ping(); }
  const Ping& last() const { return sounding_.last(); }
  RangeImageGrid grid() { return RangeImageGrid(request()); }
  RangePixel at(int column, int row) const { return range_pixel(last(), static_cast<std::size_t>(row * 256 + column)); }
  double range_m(int column, int row) const { return at(column, row).range * wanted->range_unit_m; }
  /// Returns the place of a pixel: forward, left, up [m].
  Vec3d place(int column, int row) {
    const double a = grid().azimuth_rad(column), e = grid().elevation_rad(row), r = range_m(column, row);
    return {r * std::cos(e) * std::cos(a), r * std::cos(e) * std::sin(a), r * std::sin(e)};
  }
  /// Returns the mean column and row of the pixels with a return.
  std::pair<double, double> middle() {
    double columns = 0, rows = 0, n = 0;
    for (int row = 0; row < 64; ++row)
      for (int column = 0; column < 256; ++column)
        if (at(column, row).range != 0) columns += column, rows += row, ++n;
    return n > 0 ? std::pair(columns / n, rows / n) : std::pair(-1.0, -1.0);
  }

 private:
  static FrequencyMode mode() {
    FrequencyMode m;
    m.name = "range image";
    m.centre_hz = 1.2e6f;
    m.horizontal_aperture_rad = static_cast<float>(rad_from_deg(90));
    m.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(40));
    m.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(1.5));
    m.beam_spacing = BeamSpacing::uniform_in_angle;
    m.max_range_m = 15;
    m.source_level_db = 200;
    m.receiver.tvg_slope_db = 20;
    m.receiver.full_scale_upa = 1e9f;
    return m;
  }
  static PingSettings settings() {
    PingSettings s;
    s.beam_count = 256;
    s.range_bin_count = 64;
    s.range_m = 15;
    s.range_bin_m = 15.0 / 64;
    s.pulse_width_m = 0.02f;
    s.gain_db = 30;
    s.device_sound_speed_mps = 1500;
    s.format = {.bits = 32, .max_code = range_image_max_code(full_scale)};
    return s;
  }
  Sounding sounding_;

 public:
  std::shared_ptr<Wanted> wanted;
};

}  // namespace sonar::test
