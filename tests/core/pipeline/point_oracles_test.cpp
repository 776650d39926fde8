// Oracles on point targets, through the whole engine: their positions, levels and widths.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

Vec3d at(double range_m, double azimuth_rad, double elevation_rad = 0) {
  return {range_m * std::cos(elevation_rad) * std::cos(azimuth_rad), range_m * std::cos(elevation_rad) * std::sin(azimuth_rad),
          range_m * std::sin(elevation_rad)};
}

/// Returns the row with the highest level within 5 rows of `row` in a beam.
int loudest_near(const Sounding& s, double row, int beam) {
  int best = static_cast<int>(std::lround(row));
  for (int n = best - 5; n <= std::lround(row) + 5; ++n) {
    if (s.pressure(n, beam) > s.pressure(best, beam)) best = n;
  }
  return best;
}

/// Returns the fractional row and height of the strongest echo near `row` in a beam.
Peak peak_near(const Sounding& s, double row, int beam) {
  const int best = loudest_near(s, row, beam);
  Peak p = log_parabola(s.pressure(best - 1, beam), s.pressure(best, beam), s.pressure(best + 1, beam));
  p.offset += best;
  return p;
}

/// Returns the azimuth of the middle beam. The targets of most tests lie in it.
double middle_azimuth(const FrequencyMode& mode, const PingSettings& settings) {
  Sounding empty(SceneMaker().make(), mode, settings);
  return static_cast<double>(empty.ping().beam_azimuth_rad[static_cast<std::size_t>(settings.beam_count / 2)]);
}

TEST(PointOracles, Oracle01_RangeOfAPoint) {
  for (const PingSettings& settings : {native_rows(12, 0.0254), default_rows(12, 472)}) {
    const double azimuth = middle_azimuth(p900(), settings);
    SceneMaker maker;
    std::vector<double> ranges;
    for (int i = 0; i < 17; ++i) ranges.push_back(1.5 + 0.6 * i + i / 17.0 * settings.range_bin_m);
    for (const double r : ranges) maker.add_point(at(r, azimuth), -20);
    Sounding s(maker.make(), p900(), settings);
    s.ping();
    for (const double r : ranges) {
      const double row = s.row_of_range(r);
      const Peak peak = peak_near(s, row, settings.beam_count / 2);
      record_oracle(1, "log-parabola peak minus range", 0, peak.offset - row, 0.1, "rows");
      // The sample that contains the range. Halfway between rows, two samples have equal levels.
      record_oracle(1, "loudest row minus range", 0, loudest_near(s, row, settings.beam_count / 2) - row, 0.5 + 0.01, "rows");
    }
  }
}

TEST(PointOracles, Oracle02_SoundSpeedMismatchScalesRange) {
  const PingSettings settings = native_rows(12, 0.0254);
  const double azimuth = middle_azimuth(p900(), settings);
  for (const double c : {1420.0, 1500.0, 1545.0}) {
    Sounding s(SceneMaker().add_point(at(4, azimuth), -20).add_point(at(9, azimuth), -20).make(), p900(), settings);
    s.request.water.sound_speed_mps = c;
    s.ping();
    for (const double r : {4.0, 9.0}) {
      const Peak peak = peak_near(s, s.row_of_range(r * 1500 / c), 256);
      record_oracle(2, "(seen / true range) / (c_dev / c)", 1, s.range_of_row(peak.offset) / r / (1500 / c), 1e-3, "");
    }
  }
}

TEST(PointOracles, BearingsFollowTheDevicesSoundSpeedIfConfigured) {
  for (const FrequencyMode& mode : {p900(), oculus_high()})
    for (const double c : {1412.0, 1500.0, 1549.0})
      for (const double deg : {25.0, -12.0, 0.0})
        for (const Bearings bearings : {Bearings::are_true, Bearings::follow_device_speed}) {
          Sounding s(SceneMaker().add_point(at(5, rad_from_deg(deg)), -15).make(), mode, native_rows(7, 0.0254));
          s.request.water.sound_speed_mps = c;
          s.request.bearings = bearings;
          s.ping();
          const int row = static_cast<int>(std::lround(s.row_of_range(5 * 1500 / c))), j = s.loudest_beam(row);
          const Peak peak = log_parabola(s.pressure(row, j - 1), s.pressure(row, j), s.pressure(row, j + 1));
          const double next = peak.offset < 0 ? s.beam_sine(j - 1) : s.beam_sine(j + 1);
          const double seen_deg = deg_from_rad(std::asin(std::lerp(s.beam_sine(j), next, std::abs(peak.offset))));
          const double speeds = bearings == Bearings::are_true ? 1 : 1500 / c;
          const double expected_deg = deg_from_rad(std::asin(std::sin(rad_from_deg(deg)) * speeds));
          record_oracle(no_number, "bearing under a wrong sound speed", expected_deg, seen_deg, 0.03, "deg");
        }
}

TEST(PointOracles, Oracle03_LevelOfAPoint) {
  struct Case {
    FrequencyMode mode;
    double range_m, pulse_m;
  };
  for (const Case& c : {Case{p900(), 12, 0.0254}, Case{oculus_low(), 30, 0.04}, Case{oculus_high(), 10, 0.01}}) {
    const PingSettings settings = native_rows(c.range_m, c.pulse_m);
    const double azimuth = middle_azimuth(c.mode, settings);
    for (const double part : {0.1, 0.35, 0.9}) {
      const double r = part * c.range_m + 0.0037;
      Sounding s(SceneMaker().add_point(at(r, azimuth), -15).make(), c.mode, settings);
      s.ping();
      const double alpha = 8.685889638 * s.medium().absorption_np_per_m;
      const double expected = static_cast<double>(c.mode.source_level_db) - 40 * std::log10(r) - 2 * alpha * r - 15;
      const Peak peak = peak_near(s, s.row_of_range(r), 256);
      record_oracle(3, "peak minus (SL - 40 log r - 2 alpha r + TS)", 0, 20 * std::log10(peak.height) - expected, 0.1, "dB");
    }
  }
}

TEST(PointOracles, PointElevationFollowsThePattern) {
  const PingSettings settings = native_rows(6, 0.0254);
  const double azimuth = middle_azimuth(p900(), settings);
  for (const double elevation : {-0.3, -0.1, 0.1745, 0.25}) {
    Sounding s(SceneMaker().add_point(at(5, azimuth, elevation), -15).make(), p900(), settings);
    s.ping();
    const Vec3d p = at(5, azimuth, elevation);
    const double u = p.y / 5, psi = std::atan2(p.z, p.x);
    const double weight =
        directivity(Taper::taylor30, aperture_in_wavelengths(Taper::taylor30, rad_from_deg(1)), u - s.beam_sine(256));
    const Peak peak = peak_near(s, s.row_of_range(5), 256);
    const double expected = s.medium().source_upa * amplitude_from_db(-15) *
                            two_way_transmission(5, s.medium().absorption_np_per_m) * std::abs(weight) *
                            elevation_two_way(p900().pattern, psi);
    EXPECT_NEAR(20 * std::log10(peak.height / expected), 0, 0.05) << elevation;
  }
}

TEST(PointOracles, Oracle04_SlopeOfAPointWithoutAbsorption) {
  const PingSettings settings = native_rows(36, 0.0254);
  const double azimuth = middle_azimuth(p900(), settings);
  SceneMaker maker;
  std::vector<double> log_r, level;
  for (double r = 2; r <= 32.01; r *= std::sqrt(2.0)) log_r.push_back(std::log10(r)), maker.add_point(at(r, azimuth), -15);
  Sounding s(maker.make(), silent(p900()), settings);
  s.ping();
  for (const double l : log_r) level.push_back(20 * std::log10(peak_near(s, s.row_of_range(std::pow(10, l)), 256).height));
  for (std::size_t i = 1; i < level.size(); ++i) {
    record_oracle(4, "slope from 2 m", -40, (level[i] - level[0]) / (log_r[i] - log_r[0]), 0.2, "dB/decade");
  }
}

TEST(PointOracles, Oracle14_WidthOfAPointAcrossBeams) {
  // Finely spaced beams: a narrow sector with many beams.
  for (FrequencyMode mode : {p900(), oculus_low(), oculus_high()}) {
    const double width = static_cast<double>(mode.pattern.azimuth_width_rad);
    mode.horizontal_aperture_rad = static_cast<float>(8 * width);
    const PingSettings settings = native_rows(4, 0.0254);
    Sounding s(SceneMaker().add_point(at(3, 0), -15).make(), mode, settings);
    s.ping();
    const int row = static_cast<int>(std::lround(s.row_of_range(3)));
    const double half = s.pressure(row, s.loudest_beam(row)) * std::sqrt(0.5);
    const auto crossing = [&](int step) {  // azimuth between two beams at which the level passes half power
      int j = s.loudest_beam(row);
      while (s.pressure(row, j + step) > half) j += step;
      const double a = s.pressure(row, j), b = s.pressure(row, j + step), part = (a - half) / (a - b);
      return std::asin(s.beam_sine(j)) * (1 - part) + std::asin(s.beam_sine(j + step)) * part;
    };
    record_oracle(14, "width across beams / data sheet's", 1, (crossing(-1) - crossing(1)) / width, 0.02, "");
  }
}

TEST(PointOracles, Oracle15_SideLobesOfAPointAcrossBeams) {
  FrequencyMode mode = p900();
  const double width = static_cast<double>(mode.pattern.azimuth_width_rad);
  mode.horizontal_aperture_rad = static_cast<float>(10 * width);
  const PingSettings settings = native_rows(4, 0.0254);
  Sounding s(SceneMaker().add_point(at(3, 0), -15).make(), mode, settings);
  s.ping();
  const int row = static_cast<int>(std::lround(s.row_of_range(3))), top = s.loudest_beam(row);
  double highest = 0;
  for (int j = 0; j < s.beams(); ++j) {
    if (std::abs(s.beam_sine(j)) > 1.3 * width) highest = std::max(highest, s.pressure(row, j));  // beyond the first null
  }
  record_oracle(15, "side lobe of a point across beams, Taylor", -30.3, 20 * std::log10(highest / s.pressure(row, top)), 0.5,
                "dB");
}

TEST(PointOracles, Oracle17_WidthOfAPointInRange) {
  for (const double width : {0.0254, 0.01}) {
    PingSettings settings = native_rows(3, width);
    settings.range_bin_m /= 8;  // finer than the pulse needs, so that its shape is visible
    settings.range_bin_count *= 8;
    const double azimuth = middle_azimuth(p900(), settings);
    Sounding s(SceneMaker().add_point(at(2, azimuth), -15).make(), p900(), settings);
    s.ping();
    const int top = s.loudest_row(256);
    const double half = s.pressure(top, 256) * std::sqrt(0.5);
    const auto crossing = [&](int step) {
      int n = top;
      while (s.pressure(n + step, 256) > half) n += step;
      const double a = s.pressure(n, 256), b = s.pressure(n + step, 256);
      return s.range_of_row(n + step * (a - half) / (a - b));
    };
    record_oracle(17, "width of a point / pulse's", 1, (crossing(1) - crossing(-1)) / width, 0.02, "");
  }
}

TEST(PointOracles, Oracle42_TvgFlattensAPoint) {
  for (FrequencyMode mode : {p900(), oculus_high()}) {
    mode.receiver.tvg_slope_db = 40;
    mode.receiver.tvg_minimum_range_m = 0;
    mode.receiver.tvg_ceiling_db = std::numeric_limits<float>::infinity();
    const double max_range = mode.centre_hz > 2e6f ? 10 : 40;
    PingSettings settings = native_rows(max_range + 1, 0.0254);
    const double azimuth = middle_azimuth(mode, settings);
    SceneMaker maker;
    std::vector<int> rows;
    const double spacing = settings.range_bin_m;
    for (double r = 1; r <= max_range; r *= 1.25) {
      rows.push_back(static_cast<int>(r / spacing));
      maker.add_point(at((rows.back() + 0.5) * spacing, azimuth), -40);
    }
    Sounding s(maker.make(), mode, settings);
    s.ping();
    s.request.settings.device_absorption_db_per_m = static_cast<float>(8.685889638 * s.medium().absorption_np_per_m);
    const Ping& ping = s.ping();
    const double full_scale = static_cast<double>(mode.receiver.full_scale_upa);
    const double expected = 65535 * amplitude_from_db(static_cast<double>(mode.source_level_db) - 40) / full_scale;
    ASSERT_GT(expected, 1000);
    for (const int row : rows) {
      const std::size_t i = 2 * (static_cast<std::size_t>(row) * 512 + 256);
      const int code = std::to_integer<int>(ping.samples[i]) + 256 * std::to_integer<int>(ping.samples[i + 1]);
      record_oracle(42, "samples of points at 1 m to the greatest range, TVG 40", 0, 20 * std::log10(code / expected), 0.2, "dB");
    }
  }
}

TEST(PointOracles, Oracle43_EchoesBeyondTheRecordDoNotWrap) {
  const PingSettings settings = native_rows(10, 0.0254);
  Sounding s(SceneMaker().add_point(at(13, 0), 20).add_point(at(10.5, 0.2), 20).add_point(at(20, 0), 20).make(), p900(),
             settings);
  s.ping();
  const auto loudest = [](const Ping& ping) { return static_cast<double>(*std::ranges::max_element(ping.pressure_upa)); };
  record_oracle(43, "points at 1.05 to 2 R_max: greatest sample", 0, loudest(s.last()), 0, "uPa");
  // A surface beyond the range has no effect either, with one scatterer per ray or cells.
  for (const int fan : {0, 64}) {
    Sounding w(SceneMaker().add(wall(20, 20), -10, {13, 0, 0}).make(), p900(), settings);
    w.request.switches.fixed_fan = fan;
    w.ping();
    record_oracle(43, "wall at 1.3 R_max: greatest sample", 0, loudest(w.last()), 0, "uPa");
  }
}

TEST(PointOracles, Oracle46_ConicalShift) {
  const PingSettings settings = native_rows(6, 0.0254);
  FrequencyMode mode = p900();
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(130));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(60));
  PingSettings many = settings;
  many.beam_count = 1024;
  for (const bool conical : {true, false}) {
    for (const double side : {1.0, -1.0}) {
      Sounding s(SceneMaker().add_point(at(5, side * rad_from_deg(45), rad_from_deg(-20)), -15).make(), mode, many);
      s.request.switches.conical = conical;
      s.ping();
      const int row = static_cast<int>(std::lround(s.row_of_range(5))), j = s.loudest_beam(row);
      const Peak peak = log_parabola(s.pressure(row, j - 1), s.pressure(row, j), s.pressure(row, j + 1));
      const double spacing_deg = 130.0 / 1024;
      const double seen_deg =
          deg_from_rad(std::asin(s.beam_sine(j))) - peak.offset * spacing_deg;  // beams run from port to starboard
      record_oracle(46, conical ? "conical beams" : "flat beams", conical ? 41.6 : 45, side * seen_deg, 0.1, "deg");
    }
  }
}

// Port is left: a target on the left must appear on the left, targets ahead in the middle, all at their ranges.
TEST(PointOracles, AsymmetricTargetsLandWhereTheyStand) {
  const PingSettings settings = native_rows(8, 0.0254);
  const Vec3d sonar{1000, -2000, -50};
  const RollPitchYaw attitude{0, 0, pi / 2};  // looks along world +y, so port is world -x
  SceneMaker maker;
  maker.add_point(sonar + Vec3d{0, 5, 0}, -15).add_point(sonar + Vec3d{-2, 5, 0}, -15).add_point(sonar + Vec3d{0, 7, 0}, -15);
  Sounding s(maker.make(), p900(), settings);
  s.ping_from(sonar, attitude);
  const double left_range = std::hypot(2, 5);
  const int left_row = static_cast<int>(std::lround(s.row_of_range(left_range)));
  EXPECT_NEAR(std::asin(s.beam_sine(s.loudest_beam(left_row))), std::atan2(2, 5), rad_from_deg(0.2));
  EXPECT_LT(s.loudest_beam(left_row), s.beams() / 2);
  for (const double r : {5.0, 7.0}) {
    const int row = static_cast<int>(std::lround(s.row_of_range(r)));
    EXPECT_NEAR(std::asin(s.beam_sine(s.loudest_beam(row))), 0, rad_from_deg(0.2)) << r;
  }
}

}  // namespace
}  // namespace sonar::test
