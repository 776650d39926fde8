// Lambert cross-sections, spreading and carrier phase: oblique incidence, and inputs that must not give infinite results.
#include "core/pipeline/arithmetic/scattering.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/scene/scene.hpp"

namespace sonar {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

TEST(Scattering, SolidAngleFormIsMuTimesOneCosine) {
  const auto sigma = [](double cosine) { return lambert_per_area(0.1, cosine) * footprint_area_m2(cosine, 3, 1e-4); };
  EXPECT_NEAR(sigma(0.5), 0.1 * 0.5 * 9 * 1e-4, 1e-15);
  EXPECT_NEAR(sigma(-0.5), 0.1 * 0.5 * 9 * 1e-4, 1e-15);  // the law is two-sided
  // At and below the lower limit of the cosine the area stays constant: the result falls with cos^2 and never grows.
  EXPECT_NEAR(footprint_area_m2(0, 1, 1e-4), 1e-4 / cosine_floor, 1e-12);
  EXPECT_EQ(sigma(0), 0);
}

TEST(Scattering, TwoWayTransmissionFollowsTheRange) {
  const double alpha = nepers_from_db(0.3);
  EXPECT_NEAR(20 * std::log10(two_way_transmission(10, alpha)), -40 - 2 * 0.3 * 10, 1e-9);
  EXPECT_NEAR(nepers_from_db(8.685889638), 1, 1e-9);
  EXPECT_EQ(two_way_transmission(0, alpha), 0);
  EXPECT_EQ(two_way_transmission(-1, alpha), 0);
  EXPECT_EQ(two_way_transmission(not_a_number, alpha), 0);
  EXPECT_TRUE(std::isfinite(two_way_transmission(nearest_scatterer_m, alpha)));
}

TEST(Scattering, LambertCoefficientFollowsTheStrength) {
  EXPECT_NEAR(lambert_coefficient(-27), 1.995e-3, 1e-6);
  EXPECT_NEAR(lambert_coefficient(largest_lambert_db), largest_lambert, 2e-4);
}

TEST(Scattering, TurnsOfTheCarrierAreFoldedToOne) {
  const double turns_per_m = 2 * 2.1e6 / 1500;
  EXPECT_NEAR(fraction_of_turn(7.25), 0.25, 1e-9);
  EXPECT_NEAR(fraction_of_turn(-7.25), 0.75, 1e-9);
  const double a = fraction_of_turn(30 * turns_per_m), b = fraction_of_turn((30 + 0.25 / turns_per_m) * turns_per_m);
  EXPECT_NEAR(fraction_of_turn(b - a), 0.25, 1e-9);
}

}  // namespace
}  // namespace sonar
