// Compares Philox4x32-10 with the known-answer vectors published with Random123, and tests the statistics of the normal draws.
#include "core/base/random.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace sonar {
namespace {

void expect_words(const Random4& got, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  EXPECT_EQ(got.v[0], a);
  EXPECT_EQ(got.v[1], b);
  EXPECT_EQ(got.v[2], c);
  EXPECT_EQ(got.v[3], d);
}

// Random123, kat_vectors, "philox4x32 10": all zeros, all ones, digits of pi.
TEST(Random, PhiloxKnownAnswers) {
  expect_words(philox(0, 0, 0, 0, 0, 0), 0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8);
  const std::uint32_t ones = 0xffffffff;
  expect_words(philox(ones, ones, ones, ones, ones, ones), 0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd);
  expect_words(philox(0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344, 0xa4093822, 0x299f31d0), 0xd16cfe09, 0x94fdcceb, 0x5001e420,
               0x24126ea1);
}

TEST(Random, PhiloxIsAConstantExpression) {
  static_assert(philox(0, 0, 0, 0, 0, 0).v[0] == 0x6627e8d5u);
  constexpr Random4 words = philox(1, 2, 3, 4, 5, 6);
  const Random4 again = philox(1, 2, 3, 4, 5, 6);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(words.v[i], again.v[i]);
}

TEST(Random, UniformStaysInsideTheOpenInterval) {
  EXPECT_GT(uniform_open(0), 0.0f);
  EXPECT_LT(uniform_open(0xffffffffu), 1.0f);
  EXPECT_TRUE(std::isfinite(complex_normal(0, 0).re));
  EXPECT_TRUE(std::isfinite(complex_normal(0xffffffffu, 0xffffffffu).im));
}

TEST(Random, ComplexNormalIsCircularWithUnitPower) {
  const int n = 400000;
  double power = 0, fourth = 0, re = 0, im = 0, square_re = 0, square_im = 0, neighbour = 0;
  ComplexNormal last{0, 0};
  for (int i = 0; i < n; i += 2) {
    const Random4 r = philox(static_cast<std::uint32_t>(i), 7, 0, 0, 11, 13);
    for (int k = 0; k < 4; k += 2) {
      const ComplexNormal z = complex_normal(r.v[k], r.v[k + 1]);
      const double x = static_cast<double>(z.re), y = static_cast<double>(z.im), p = x * x + y * y;
      power += p, fourth += p * p, re += x, im += y;
      square_re += x * x - y * y, square_im += 2 * x * y;
      neighbour += x * static_cast<double>(last.re) + y * static_cast<double>(last.im);
      last = z;
    }
  }
  const double sd = 1 / std::sqrt(static_cast<double>(n));  // standard deviation of a mean of n unit-variance terms
  EXPECT_NEAR(power / n, 1, 5 * sd);
  EXPECT_NEAR(fourth / n, 2, 5 * std::sqrt(20.0) * sd);  // exponential intensity: scintillation index 1
  EXPECT_NEAR(re / n, 0, 5 * sd);
  EXPECT_NEAR(im / n, 0, 5 * sd);
  EXPECT_NEAR(square_re / n, 0, 5 * std::sqrt(2.0) * sd);  // circular: E z^2 = 0
  EXPECT_NEAR(square_im / n, 0, 5 * std::sqrt(2.0) * sd);
  EXPECT_NEAR(neighbour / n, 0, 5 * sd);
}

// Kolmogorov-Smirnov test at 1 %: |z| has a Rayleigh distribution.
TEST(Random, ComplexNormalMagnitudeIsRayleigh) {
  const int n = 20000;
  std::vector<int> bins(2000);  // bins of the cumulative probability 1 - exp(-|z|^2)
  for (int i = 0; i < n; ++i) {
    const Random4 r = philox(static_cast<std::uint32_t>(i), 0, 0, 0, 3, 5);
    const ComplexNormal z = complex_normal(r.v[0], r.v[1]);
    const double cumulative = 1 - std::exp(-static_cast<double>(z.re * z.re + z.im * z.im));
    ++bins[static_cast<std::size_t>(cumulative * 1999.999)];
  }
  double sum = 0, worst = 0;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    sum += bins[b];
    worst = std::fmax(worst, std::fabs(sum / n - static_cast<double>(b + 1) / 2000));
  }
  EXPECT_LT(worst, 1.63 / std::sqrt(static_cast<double>(n)) + 1.0 / 2000);
}

}  // namespace
}  // namespace sonar
