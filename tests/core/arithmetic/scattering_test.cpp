// Lambert cross-sections, spreading and carrier phase: the obliquity, the Lambert sphere, and the inputs that must not blow up.
#include "core/pipeline/arithmetic/scattering.hpp"
#include "tests/oracles/record.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace sonar {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

TEST(Scattering, SolidAngleFormIsMuTimesOneCosine) {
  EXPECT_NEAR(lambert_cross_section_m2(0.1, 0.5, 3, 1e-4), 0.1 * 0.5 * 9 * 1e-4, 1e-15);
  EXPECT_NEAR(lambert_cross_section_m2(0.1, -0.5, 3, 1e-4), 0.1 * 0.5 * 9 * 1e-4, 1e-15);  // two-sided
  EXPECT_NEAR(cell_cross_section_m2(0.1, 0.5, 2e-3), 0.1 * 0.25 * 2e-3, 1e-15);
  // At and below the floor the area is held: falls with cos^2, never grows.
  EXPECT_NEAR(footprint_area_m2(0, 1, 1e-4), 1e-4 / cosine_floor, 1e-12);
  EXPECT_EQ(lambert_cross_section_m2(0.1, 0, 3, 1e-4), 0);
}

// Oracle 9 for d -> infinity: integrating mu cos^2 dA over the lit half of a sphere gives (2 pi / 3) mu a^2.
TEST(Scattering, Oracle09_LambertSphereFromAfar) {
  const double a = 0.25, mu = 0.05, dt = 1e-5;
  double sigma = 0;
  for (double t = 0.5 * dt; t < 0.5 * pi; t += dt) {
    sigma += cell_cross_section_m2(mu, std::cos(t), 2 * pi * a * a * std::sin(t) * dt);
  }
  test::record_oracle(9, "formula, from afar, over (2 pi / 3) mu a^2", 0, 10 * std::log10(sigma / (2 * pi / 3 * mu * a * a)),
                      0.05, "dB");
}

TEST(Scattering, TwoWayTransmission) {
  const double alpha = nepers_from_db(0.3);
  EXPECT_NEAR(20 * std::log10(two_way_transmission(10, alpha)), -40 - 2 * 0.3 * 10, 1e-9);
  EXPECT_NEAR(nepers_from_db(8.685889638), 1, 1e-9);
  EXPECT_EQ(two_way_transmission(0, alpha), 0);
  EXPECT_EQ(two_way_transmission(-1, alpha), 0);
  EXPECT_EQ(two_way_transmission(not_a_number, alpha), 0);
  EXPECT_TRUE(std::isfinite(two_way_transmission(nearest_scatterer_m, alpha)));
}

TEST(Scattering, LambertCoefficient) {
  EXPECT_NEAR(lambert_coefficient(-27), 1.995e-3, 1e-6);
  EXPECT_NEAR(lambert_coefficient(largest_lambert_db), 1 / pi, 1e-12);
}

TEST(Scattering, CarrierTurnsFold) {
  EXPECT_NEAR(carrier_turns(2.1e6, 1500, 1500 / 2.1e6 / 2 * 7.25), 0.25, 1e-9);
  const double a = carrier_turns(2.1e6, 1500, 30), quarter_wave = 1500 / 2.1e6 / 8;
  const double b = carrier_turns(2.1e6, 1500, 30 + quarter_wave);
  EXPECT_NEAR(b - a - std::floor(b - a), 0.25, 1e-9);
}

}  // namespace
}  // namespace sonar
