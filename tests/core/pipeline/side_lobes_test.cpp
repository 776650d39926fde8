// Side lobes of the elevation pattern: the levels of points, beds and walls far off the main lobe agree with closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::side_lobes_test {
namespace {

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

/// sinc^2 of transmitter and receiver [dB]. The aperture puts half of the two-way power at half of the quoted width.
double two_way_db(const FrequencyMode& mode, double psi_rad) {
  // sinc(x) = 2^(-1/4) at x = 0.3189.
  const double x = 0.31888 * std::sin(psi_rad) / std::sin(static_cast<double>(mode.pattern.elevation_width_rad) / 2);
  return 40 * std::log10(std::abs(std::sin(pi * x) / (pi * x)));
}

TEST(SideLobes, PointsEchoAllAround) {
  for (const FrequencyMode& mode : {p900(), oculus_high()}) {
    double loudest = 0;
    for (const double deg : {0.01, 10.0, 14.0, 20.0, 25.0, 35.0, 50.0, -20.0, -50.0, 75.0, -78.0}) {
      const double psi = rad_from_deg(deg);
      if (two_way_db(mode, psi) < -60) continue;  // near a zero of the pattern
      Sounding s(SceneMaker().add_point({5 * std::cos(psi), 0, 5 * std::sin(psi)}, 0).make(), mode, native_rows(6, 0.0254));
      s.request.switches.side_lobes = true;
      s.ping();
      double peak = 0;
      for (int j = 0; j < s.beams(); ++j) peak = std::max(peak, s.power(static_cast<int>(std::lround(s.row_of_range(5))), j));
      if (loudest == 0) loudest = peak;
      record_oracle(no_number, "point in a side lobe, two-way pattern", two_way_db(mode, psi), db(peak / loudest), 0.1, "dB");
    }
  }
}

constexpr double tilt = 0.1, lambert_db = -20;  // nose down; strength of the beds

/// Returns a flat bed `height` below a sonar, up to a range of six heights.
Sounding over_bed(const FrequencyMode& mode, double height = 2, double pulse_width_m = 0.0254) {
  const double size = height / 2;
  return Sounding(
      SceneMaker()
          .add(height_field(-size, 7 * height, -6 * height, 6 * height, size, [](double, double) { return 0.0; }), lambert_db)
          .make(),
      mode, native_rows(6 * height, pulse_width_m));
}

/// Compares a bed 2 m below, nose down, with the closed form: the mean ratio in the beams around the middle, for blocks of
/// rows.
void expect_bed(const FrequencyMode& mode, bool side_lobes, bool speckle) {
  constexpr double height = 2;
  Sounding s = over_bed(mode);
  s.request.switches.expected_power = !speckle;
  s.request.switches.side_lobes = side_lobes;
  s.ping_from({0, 0, height}, {0, tilt, 0});
  const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, tilt);
  int lobes = 0;
  double sum = 0;
  for (double r = 2.15; r < 11; r += 0.1) {
    const double psi = bed.psi_rad(r), level = two_way_db(mode, psi);
    // Rows near the zeros, where the pattern changes within a pulse, and beyond 80 degrees are excluded.
    const double near = two_way_db(mode, bed.psi_rad(r - 0.05)), far = two_way_db(mode, bed.psi_rad(r + 0.05));
    if (level < -45 || std::abs(near - far) > 3 || psi < -1.3) continue;
    double ratio = 0;
    int n = 0;
    for (int row = static_cast<int>(s.row_of_range(r - 0.03)); row <= s.row_of_range(r + 0.03); ++row)
      for (int j = 200; j < 312; ++j, ++n) ratio += s.power(row, j) / power_from_db(bed.db(s.range_of_row(row), s.beam_sine(j)));
    if (!side_lobes) {
      if (level < -22) {
        EXPECT_LT(db(ratio / n + 1e-30), -20) << r;
      }
      continue;
    }
    if (level < -20) sum += ratio / n, ++lobes;
    if (!speckle) record_oracle(8, "bed in the side lobes, expected power", 0, db(ratio / n), 0.5, "dB");
  }
  // Each block has about forty independent samples.
  if (speckle) record_oracle(8, "bed in the side lobes, speckle, mean of all ranges", 0, db(sum / lobes), 0.5, "dB");
  if (side_lobes) {
    EXPECT_GT(lobes, 5) << mode.name;
  }
}

TEST(SideLobes, ABedIsAsLoudAsTheClosedFormDownTo45Db) {
  for (const FrequencyMode& mode : {p900(), oculus_high()}) expect_bed(mode, true, false);
}
TEST(SideLobes, CoarserCellsKeepItsLevel) { expect_bed(p900(), true, true); }

/// Power of samples divided by the bed's closed form, where the pattern is between `least_db` and -20 dB. Results: the
/// scintillation index, which is 1 for speckle of many cells per sample, and the mean in dB.
struct Speckle {
  double index, mean_db;
};
Speckle speckle_of_bed(const FrequencyMode& mode, double least_db, double height, double pulse_width_m) {
  double sum = 0, squares = 0, n = 0;
  Sounding s = over_bed(mode, height, pulse_width_m);
  s.request.switches.side_lobes = true;
  for (const std::uint32_t seed : {1u, 2u, 3u, 4u}) {
    s.request.seed = Seed{seed};
    s.ping_from({0, 0, height}, {0, tilt, 0});
    const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, tilt);
    for (int row = static_cast<int>(s.row_of_range(1.075 * height)); row < s.row_of_range(5.5 * height); ++row) {
      const double r = s.range_of_row(row), beside = 0.025 * height, level = two_way_db(mode, bed.psi_rad(r));
      const double near = two_way_db(mode, bed.psi_rad(r - beside)), far = two_way_db(mode, bed.psi_rad(r + beside));
      if (level < least_db || level > -20 || std::abs(near - far) > 3 || bed.psi_rad(r) < -1.3) continue;
      for (int j = 200; j < 312; ++j, ++n) {
        const double ratio = s.power(row, j) / power_from_db(bed.db(r, s.beam_sine(j)));
        sum += ratio, squares += ratio * ratio;
      }
    }
  }
  const double mean = sum / n;
  return {squares / n / (mean * mean) - 1, db(mean)};
}
TEST(SideLobes, CoarserCellsKeepItsSpeckle) {
  for (const FrequencyMode& mode : {p900(), oculus_high()})
    record_oracle(24, "bed in the side lobes, scintillation index", 1, speckle_of_bed(mode, -45, 2, 0.0254).index, 0.2, "");
}
// Cells are as large as the beams and the pulse allow. Therefore other heights and pulses give other shapes of the area of a
// beam and a pulse.
TEST(SideLobes, CoarserCellsSuitEveryRangeAndPulse) {
  for (const auto& [height, pulse_width_m] : {std::pair{0.9, 0.0026}, {1.3, 0.01}, {5.0, 0.02}, {3.0, 0.1}}) {
    const Speckle found = speckle_of_bed(oculus_high(), -45, height, pulse_width_m);
    record_oracle(24, "bed in the side lobes, scintillation index", 1, found.index, 0.2, "");
    record_oracle(8, "bed in the side lobes, speckle, mean of all ranges", 0, found.mean_db, 0.5, "dB");
  }
}

// Without side lobes a bed begins with a step where the fan ends.
TEST(SideLobes, TheBedHasNoStepAtTheEdgeOfTheFan) {
  constexpr double height = 2;
  Sounding s = over_bed(p900());
  const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), lambert_db, height, tilt);
  double edge_m = 2 * height;
  while (two_way_db(s.mode(), bed.psi_rad(edge_m)) > -20) edge_m -= 0.01;
  for (const bool side_lobes : {false, true}) {
    double before = 0, behind = 0;  // sums divided by the closed form, of equal numbers of samples
    for (const std::uint32_t seed : {1u, 2u, 3u, 4u}) {
      s.request.seed = Seed{seed};
      s.request.switches.side_lobes = side_lobes;
      s.ping_from({0, 0, height}, {0, tilt, 0});
      for (double off = 0.04; off < 0.12; off += 0.01)
        for (int j = 100; j < 412; ++j) {
          const auto level = [&](double r) {
            const int row = static_cast<int>(std::lround(s.row_of_range(r)));
            return s.power(row, j) / power_from_db(bed.db(s.range_of_row(row), s.beam_sine(j)));
          };
          before += level(edge_m - off), behind += level(edge_m + off);
        }
    }
    if (side_lobes)
      record_oracle(8, "bed at the edge of the fan, step beyond the closed form", 0, db(behind / before), 1, "dB");
    else
      EXPECT_GT(db(behind / before), 10);
  }
}
TEST(SideLobes, AnObstacleBelowTheFanIsThere) {
  constexpr double range = 2.7, radius = 0.2;
  const auto energy = [&](double psi_deg, bool side_lobes) {  // energy of the echo of a sphere at this angle
    const double psi = rad_from_deg(psi_deg);
    Sounding s(SceneMaker().add(sphere(radius, 5), -10, {range * std::cos(psi), 0, range * std::sin(psi)}).make(), p900(),
               native_rows(4, 0.0254));
    s.request.switches.expected_power = true;
    s.request.switches.side_lobes = side_lobes;
    s.ping();
    double sum = 0;
    for (int row = static_cast<int>(s.row_of_range(range - 1.3 * radius)); row < s.row_of_range(range); ++row)
      for (int j = 0; j < s.beams(); ++j) sum += s.power(row, j);
    return sum;
  };
  EXPECT_EQ(energy(-50, false), 0);
  record_oracle(no_number, "sphere in a side lobe, two-way pattern", two_way_db(p900(), rad_from_deg(-50)),
                db(energy(-50, true) / energy(0, true)), 1, "dB");
}
TEST(SideLobes, WithoutTheSwitchThereAreNoEchoes) { expect_bed(p900(), false, false); }

}  // namespace
}  // namespace sonar::test::side_lobes_test
