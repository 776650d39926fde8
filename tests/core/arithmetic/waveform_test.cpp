// Oracle 17 at the level of formulas, and the integrals of the pulse compared with sums.
#include "core/pipeline/arithmetic/waveform.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace sonar {
namespace {

TEST(Waveform, Oracle17_PulseWidth) {
  for (const double width_m : {0.0025, 0.0254, 0.1}) {
    for (const double c : {1482.4, 1500.0}) {
      const double b = envelope_parameter_hz(c, width_m);
      double range_m = 0;  // searches in small steps for half power in range
      while (std::pow(envelope(b, 2 * range_m / c), 2) > 0.5) range_m += width_m * 1e-4;
      EXPECT_NEAR(2 * range_m / width_m, 1, 0.001);
    }
  }
  EXPECT_NEAR(envelope_parameter_hz(1500, 0.0254), 34.8e3, 50);  // P900-90 in the specification
  EXPECT_NEAR(half_power_bt, std::sqrt(std::log(2.0) / 2), 1e-15);
}

TEST(Waveform, ThePulseHasItsIntegrals) {
  const double b = 34.8e3, dt = 1e-8, nu = 0.31 * b;
  double energy = 0, spectrum = 0;
  for (int i = -20000; i <= 20000; ++i) {
    const double p = envelope(b, i * dt);
    energy += p * p * dt;
    spectrum += p * std::cos(2 * pi * nu * i * dt) * dt;
  }
  EXPECT_NEAR(energy / energy_width_s(b), 1, 1e-9);
  EXPECT_NEAR(spectrum / envelope_spectrum_s(b, nu), 1, 1e-9);

  double passed = 0;  // noise bandwidth: integral of |P/P(0)|^2
  for (double f = -4 * b; f <= 4 * b; f += b * 1e-4) passed += std::pow(envelope_spectrum_s(b, f) / envelope_spectrum_s(b, 0), 2);
  EXPECT_NEAR(passed * b * 1e-4 / noise_bandwidth_hz(b), 1, 1e-6);
  EXPECT_NEAR(noise_bandwidth_hz(b), 0.3989 * b, 1e-4 * b);
}

TEST(Waveform, NeighbouringRowsHaveTheirNoiseCorrelation) {
  const double c = 1500, dr = 0.02, b = envelope_parameter_hz(c, dr);
  EXPECT_NEAR(noise_correlation(b, 2 * dr / c), 0.50, 0.005);         // rows one pulse width apart
  EXPECT_NEAR(noise_correlation(b, 2 * dr / 0.9 / c), 0.425, 0.005);  // pulse 0.9 of a row
  double sum = 0;                                                     // autocorrelation of p itself
  for (int i = -20000; i <= 20000; ++i) sum += envelope(b, i * 1e-8) * envelope(b, i * 1e-8 - 2 * dr / c) * 1e-8;
  EXPECT_NEAR(sum / energy_width_s(b), noise_correlation(b, 2 * dr / c), 1e-6);
}

}  // namespace
}  // namespace sonar
