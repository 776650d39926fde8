// Oracles 14 to 16 at the level of formulas: receive widths, side lobes and the two-way elevation product, from sampled
// patterns. Also the geometry of oracle 46: the beam in which a point off the horizontal appears.
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "tests/oracles/record.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace sonar {
namespace {

constexpr Taper shaped[] = {Taper::uniform, Taper::taylor30, Taper::hamming, Taper::hann};

/// Returns the full width between the half-power points of a pattern that falls from 1 at 0. It is found by small steps, not
/// by a formula.
double half_power_width(const std::function<double(double)>& amplitude, double step) {
  double x = 0;
  while (amplitude(x) * amplitude(x) > 0.5) x += step;
  return 2 * x;
}

TEST(BeamPattern, Oracle14_ReceiveWidthIsTheDataSheets) {
  for (const Taper taper : shaped) {
    for (const double width_deg : {0.4, 0.6, 1.0, 3.0}) {
      const double width = rad_from_deg(width_deg);
      const double aperture = aperture_in_wavelengths(taper, width);
      const auto turned = [&](double theta) { return directivity(taper, aperture, std::sin(theta)); };
      EXPECT_NEAR(half_power_width(turned, width * 1e-4) / width, 1, 0.001) << static_cast<int>(taper) << " " << width_deg;
    }
  }
}

TEST(BeamPattern, WidthFactorsAreThoseOfTheTable) {
  EXPECT_NEAR(width_factor(Taper::uniform), 0.886, 0.001);
  EXPECT_NEAR(width_factor(Taper::taylor30), 1.125, 0.001);
  EXPECT_NEAR(width_factor(Taper::hamming), 1.31, 0.01);
  EXPECT_NEAR(width_factor(Taper::hann), 1.44, 0.001);
  EXPECT_NEAR(aperture_in_wavelengths(Taper::uniform, 0.01), 88.6, 0.1);
}

TEST(BeamPattern, Oracle15_HighestSideLobe) {
  const double expected_db[] = {-13.3, -30.3, -42.6, -31.5};
  for (int i = 0; i < 4; ++i) {
    double x = 0;
    while (beam_amplitude(shaped[i], x) > 0) x += 1e-3;  // first null
    double highest = 0;
    for (; x < 60; x += 1e-3) highest = std::max(highest, std::fabs(beam_amplitude(shaped[i], x)));
    constexpr const char* names[] = {"formula, uniform", "formula, Taylor", "formula, Hamming", "formula, Hann"};
    test::record_oracle(15, names[i], expected_db[i], 20 * std::log10(highest), 0.5, "dB");
  }
}

TEST(BeamPattern, TaylorHasItsMovedZerosAndThenTheUniformOnes) {
  const double a = std::acosh(std::pow(10.0, 1.5)) / pi;
  const double sigma = 4 / std::sqrt(a * a + 3.5 * 3.5);
  for (int n = 1; n < 4; ++n) {
    EXPECT_NEAR(beam_amplitude(Taper::taylor30, sigma * std::sqrt(a * a + (n - 0.5) * (n - 0.5))), 0, 1e-12) << n;
  }
  for (int n = 4; n < 9; ++n) EXPECT_NEAR(beam_amplitude(Taper::taylor30, n), 0, 1e-12) << n;
}

TEST(BeamPattern, AmplitudesAreSignedEvenAndOneOnTheAxis) {
  for (const Taper taper : shaped) {
    EXPECT_DOUBLE_EQ(beam_amplitude(taper, 0), 1);
    for (double x = 0.1; x < 9; x += 0.37) EXPECT_NEAR(beam_amplitude(taper, x), beam_amplitude(taper, -x), 1e-12);
  }
  EXPECT_LT(beam_amplitude(Taper::uniform, 1.5), -0.2);
  EXPECT_LT(beam_amplitude(Taper::taylor30, 1.8), 0);
  EXPECT_EQ(beam_amplitude(Taper::unit, 123.4), 1);
}

TEST(BeamPattern, EffectiveWidthIsTheSumOfSquaredWeights) {
  for (const Taper taper : shaped) {
    const double aperture = 57.3;
    double sum = 0;
    const double du = 1e-3;
    for (int k = -200000; k <= 200000; ++k) {
      const double w = directivity(taper, aperture, k * du + 0.0002);
      sum += w * w * du;
    }
    EXPECT_NEAR(sum / effective_beam_width_u(taper, aperture), 1, 2e-4) << static_cast<int>(taper);
  }
}

TEST(BeamPattern, Oracle16_TwoWayElevationProduct) {
  for (const double width_deg : {3.0, 12.0, 20.0}) {
    BeamPattern pattern;
    pattern.elevation_width_rad = static_cast<float>(rad_from_deg(width_deg));
    const auto product = [&](double psi) { return elevation_two_way(pattern, psi); };
    pattern.elevation_width_is = ElevationWidthIs::one_way;
    test::record_oracle(16, "two-way over one-way width", 0.720, half_power_width(product, 1e-5) / rad_from_deg(width_deg),
                        0.02 * 0.720, "");
    // The width of one of the two equal sincs is the quoted width.
    const auto one_of_two = [&](double psi) { return std::sqrt(elevation_two_way(pattern, psi)); };
    EXPECT_NEAR(half_power_width(one_of_two, 1e-5) / rad_from_deg(width_deg), 1, 0.001) << width_deg;
    pattern.elevation_width_is = ElevationWidthIs::two_way;
    EXPECT_NEAR(half_power_width(product, 1e-5) / rad_from_deg(width_deg), 1, 0.001) << width_deg;
  }
}

TEST(BeamPattern, ElevationPatternHasTheRightReachAndIntegral) {
  BeamPattern pattern;
  pattern.elevation_width_rad = static_cast<float>(rad_from_deg(20));
  const double half = 0.5 * rad_from_deg(20);
  const double reach = elevation_reach_rad(pattern, 0.1);
  EXPECT_NEAR(elevation_two_way(pattern, reach), 0.1, 1e-9);
  EXPECT_NEAR(reach / half, 2.3, 0.1);
  double power = 0;
  for (double psi = -1.5; psi < 1.5; psi += 1e-4) power += std::pow(elevation_two_way(pattern, psi), 2) * 1e-4;
  EXPECT_NEAR(power / rad_from_deg(20), 1.045, 0.01);
  EXPECT_EQ(elevation_two_way(pattern, 0.75 * pi), 0);  // behind
  pattern.elevation_taper = Taper::unit;
  EXPECT_EQ(elevation_two_way(pattern, 1.0), 1);
  EXPECT_EQ(elevation_two_way(pattern, 2.0), 0);
  EXPECT_DOUBLE_EQ(elevation_reach_rad(pattern, 0.1), 0.5 * pi);
}

TEST(BeamPattern, Oracle46_ConicalShiftOfAnElevatedPoint) {
  for (const auto& [elevation_deg, seen_deg] : {std::pair{-14.0, 43.3}, std::pair{-20.0, 41.6}}) {
    const double azimuth = rad_from_deg(45), elevation = rad_from_deg(elevation_deg);
    const Vec3d direction{std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
    const ConicalDirection c = conical_from_sonar(7.0 * direction);
    EXPECT_NEAR(deg_from_rad(std::asin(c.u)), seen_deg, 0.1);
    EXPECT_NEAR(length(sonar_from_conical(c) - direction), 0, 1e-12);
    EXPECT_NEAR(length(sonar_from_flat(flat_from_sonar(7.0 * direction)) - direction), 0, 1e-12);
    const auto rounded = [](double x) { return static_cast<float>(x); };
    for (const bool conical : {true, false}) {
      const ConicalDirection d = conical ? c : flat_from_sonar(direction);
      const Vec3 ray = ray_in_sonar(conical, rounded(d.u), rounded(std::sqrt(1 - d.u * d.u)), rounded(std::cos(d.psi_rad)),
                                    rounded(std::sin(d.psi_rad)));
      EXPECT_NEAR(length(to_double(ray) - direction), 0, 1e-6);
    }
  }
}

}  // namespace
}  // namespace sonar
