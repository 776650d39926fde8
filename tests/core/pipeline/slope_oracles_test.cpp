// Oracles on the fall of surface levels with range: a wall's first cell, a seabed of constant strength, a Lambert seabed. With
// conical and with flat beams, always in expected power.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::slope_oracles_test {
namespace {

constexpr double dr = 0.0254;

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

/// Returns the mode without elevation pattern and 4 degrees wide, so that only a small surface needs cells.
FrequencyMode narrow(FrequencyMode mode) {
  mode = without_elevation_pattern(mode);
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(4));
  return mode;
}
PingSettings few_beams(double range_m) {
  PingSettings settings = native_rows(range_m, dr);
  settings.beam_count = 24;
  return settings;
}

TEST(SlopeOracles, Oracle06_FirstCellOfAWallFallsAs25LogR) {
  std::vector<double> level;
  for (int octave = 0; octave <= 5; ++octave) {
    PingSettings settings = few_beams(std::ldexp(1.0, octave) + 0.3);
    // The wall is at the middle of a row at every range. So the first cell is sampled in the same way.
    const double distance = (std::floor(std::ldexp(1.0, octave) / settings.range_bin_m) + 0.5) * settings.range_bin_m;
    Sounding s(SceneMaker().add(wall(2.5, 4), -20, {distance, 0, 0}).make(), silent(narrow(p900())), settings);
    s.request.switches.expected_power = true;
    s.ping();
    const int row = static_cast<int>(std::lround(s.row_of_range(distance)));
    double loudest = 0;
    for (int n = row; n < row + 4; ++n) {
      double sum = 0;  // within a third of a degree of straight ahead, because the wall is farther away at larger angles
      for (int j = s.beams() / 2 - 2; j < s.beams() / 2 + 2; ++j) sum += s.power(n, j) / 4;
      loudest = std::max(loudest, sum);
    }
    level.push_back(db(loudest));
  }
  const double octave_in_decades = std::log10(2.0);
  record_oracle(6, "1 to 32 m", -25, (level.back() - level.front()) / (5 * octave_in_decades), 0.5, "dB/decade");
  for (std::size_t i = 1; i < level.size(); ++i)
    record_oracle(6, "octave by octave", -25, (level[i] - level[i - 1]) / octave_in_decades, 0.5, "dB/decade");
}

/// A strip of seabed ahead, `height_m` below, and its level as a function of range: the mean over beams and over blocks of rows
/// at whole octaves of range.
struct Octaves {
  double height_m, first_m;
  int count;
  bool conical;
  Material material;
};
std::vector<double> levels_of(const Octaves& o) {
  const double last = std::ldexp(o.first_m, o.count - 1);
  Mesh strip = height_field(0, last * 1.1, -0.08 * last, 0.08 * last, 2, [](double, double) { return 0.0; });
  Sounding s(SceneMaker().add_of(std::move(strip), o.material).make(), silent(narrow(p900())), few_beams(last * 1.05));
  s.request.switches.expected_power = true;
  s.request.switches.conical = o.conical;
  s.ping_from({0, 0, o.height_m}, {0, 0, 0});
  std::vector<double> levels;
  for (int i = 0; i < o.count; ++i) {
    const double range = std::ldexp(o.first_m, i);
    const int row = static_cast<int>(std::lround(s.row_of_range(range)));
    double sum = 0;
    int n = 0;
    // Each row is corrected to the block's middle by the expected slope. Therefore only the trend across blocks is measured.
    for (int at = row - 12; at <= row + 12; ++at)
      for (int j = 0; j < s.beams(); ++j, ++n) sum += s.power(at, j) * std::pow(s.range_of_row(at) / range, 4);
    levels.push_back(db(sum / n));
  }
  return levels;
}

/// Returns the slope over octaves by least squares [dB/decade].
double slope_of(const std::vector<double>& levels) {
  const auto n = static_cast<double>(levels.size());
  double x_mean = (n - 1) / 2, y_mean = 0, xy = 0, xx = 0;
  for (const double level : levels) y_mean += level / n;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const double x = static_cast<double>(i) - x_mean;
    xy += x * (levels[i] - y_mean), xx += x * x;
  }
  return xy / xx / std::log10(2.0);
}

TEST(SlopeOracles, Oracle07_SeabedFallsAs30Or50LogR) {
  Material constant;
  constant.law = ScatteringLaw::gsab;
  constant.gsab = {.a_db = -200, .b_rad = 0.1f, .c_db = -20, .d = 0, .e_db = -200, .f_rad = 0.1f};
  const auto check = [](const std::string& what, double slope, const Octaves& o) {
    record_oracle(7, what, slope, slope_of(levels_of(o)), 0.3, "dB/decade");
  };
  check("constant strength, 4 to 32 m", -30, {0.5, 4, 4, true, constant});
  Material lambert;
  lambert.lambert_db = -20;
  check("Lambert, conical beams, 4 to 32 heights", -50, {1, 4, 4, true, lambert});
  check("Lambert, flat beams, 3 to 24 heights", -50, {1, 3, 4, false, lambert});
}

// sigma of a seabed in flat beams is that in conical beams times cos(phi_s), where phi_s is the elevation in the sonar's frame.
TEST(SlopeOracles, Oracle08_AbsoluteSeabedLevelInFlatBeams) {
  const double height = 2, lambert_db = -27;
  for (const double tilt : {0.0, 0.25, 0.5}) {
    FrequencyMode mode = without_elevation_pattern(p900());
    mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(6));
    PingSettings settings = native_rows(10, dr);
    settings.beam_count = 36;
    const auto bed = SceneMaker().add(height_field(0, 12, -1.5, 1.5, 1, [](double, double) { return 0.0; }), lambert_db).make();
    Sounding s(bed, mode, settings);
    s.request.switches.expected_power = true;
    s.request.switches.conical = false;
    s.ping_from({0, 0, height}, {0, tilt, 0});
    const reference::SeabedLevel level(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, tilt);
    const double half_fan = 2.3 * static_cast<double>(mode.pattern.elevation_width_rad) / 2;
    constexpr int block = 20;
    int blocks = 0;
    for (int row = 0; row + block <= s.rows() - 4; row += block) {
      const double near = s.range_of_row(row) - 2 * dr, far = s.range_of_row(row + block) + 2 * dr;
      if (!(near > height && level.psi_rad(near) > -half_fan && level.psi_rad(far) < half_fan)) continue;
      double sum = 0;
      int n = 0;
      for (int at = row; at < row + block; ++at) {
        const double r = s.range_of_row(at), expected = power_from_db(level.db(r)) * std::cos(level.psi_rad(r));
        for (int j = 6; j < 30; ++j, ++n) sum += s.power(at, j) / expected;  // within 2 degrees of straight ahead
      }
      record_oracle(8, "level over closed form, flat beams", 0, db(sum / n), 0.3, "dB");
      ++blocks;
    }
    EXPECT_GT(blocks, 8) << tilt;
  }
}

}  // namespace
}  // namespace sonar::test::slope_oracles_test
