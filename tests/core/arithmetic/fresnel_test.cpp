// Compares Fresnel integrals with their definition and with tabulated values.
#include "core/pipeline/arithmetic/fresnel.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace sonar {
namespace {

TEST(Fresnel, HasTheTabledValues) {  // Abramowitz & Stegun, table 7.7
  EXPECT_NEAR(fresnel(0.5).c, 0.4923442, 1e-7);
  EXPECT_NEAR(fresnel(0.5).s, 0.0647324, 1e-7);
  EXPECT_NEAR(fresnel(1).c, 0.7798934, 1e-7);
  EXPECT_NEAR(fresnel(1).s, 0.4382591, 1e-7);
  EXPECT_NEAR(fresnel(2).c, 0.4882534, 1e-7);
  EXPECT_NEAR(fresnel(2).s, 0.3434157, 1e-7);
  EXPECT_NEAR(fresnel(5).c, 0.5636312, 1e-7);
  EXPECT_NEAR(fresnel(5).s, 0.4991914, 1e-7);
}

TEST(Fresnel, IntegratesItsDefinition) {
  // Simpson's rule from 0, compared at every tenth step.
  FresnelPair sum;
  const double step = 1e-3;
  for (int i = 0; i < 9000; ++i) {
    const double a = i * step, m = a + step / 2, b = a + step;
    const auto angle = [](double t) { return pi / 2 * t * t; };
    sum.c += step / 6 * (std::cos(angle(a)) + 4 * std::cos(angle(m)) + std::cos(angle(b)));
    sum.s += step / 6 * (std::sin(angle(a)) + 4 * std::sin(angle(m)) + std::sin(angle(b)));
    if ((i + 1) % 100 != 0) continue;
    EXPECT_NEAR(fresnel(b).c, sum.c, 1e-8) << b;
    EXPECT_NEAR(fresnel(b).s, sum.s, 1e-8) << b;
    EXPECT_EQ(fresnel(-b).c, -fresnel(b).c);
    EXPECT_EQ(fresnel(-b).s, -fresnel(b).s);
  }
}

TEST(Fresnel, SettlesAtOneHalf) {
  EXPECT_EQ(fresnel(0).c, 0);
  EXPECT_EQ(fresnel(0).s, 0);
  for (const double x : {1e3, 1e5, 1e7}) {
    EXPECT_NEAR(std::hypot(fresnel(x).c - 0.5, fresnel(x).s - 0.5), 1 / (pi * x), 1e-9) << x;
  }
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(fresnel(infinity).c, 0.5);
  EXPECT_EQ(fresnel(-infinity).s, -0.5);
}

}  // namespace
}  // namespace sonar
