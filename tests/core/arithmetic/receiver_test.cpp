// Oracles 41 and 42 at the level of formulas, the noise level of the figures in the specification, and the limits of
// quantisation.
#include "core/pipeline/arithmetic/receiver.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"

namespace sonar {
namespace {

FrequencyMode mode_of(double hz, double azimuth_deg, double elevation_deg) {
  FrequencyMode mode;
  mode.centre_hz = static_cast<float>(hz);
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(azimuth_deg));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(elevation_deg));
  return mode;
}

TEST(Receiver, Oracle41_QuantisationRoundTripWithRowGains) {
  SampleFormat format{.bits = 16, .max_code = 65535, .gamma = 1, .row_gains = true};
  for (const double tvg : {-9.0, -3.2, 0.0, 11.7, 30.0, 47.3}) {
    const std::uint32_t gain = row_power_gain(tvg, -9.0);
    ASSERT_GE(gain, 1u);
    for (double v = 1e-6; v < 1; v *= 1.37) {
      const double applied = v * std::sqrt(static_cast<double>(gain));
      if (applied >= 1) break;
      const double code = quantise(applied, format);
      const double undone = code / std::sqrt(static_cast<double>(gain));
      EXPECT_NEAR(undone, v * 65535, 0.5 / std::sqrt(static_cast<double>(gain)) + 1e-6) << tvg << " dB, " << v;
    }
  }
}

TEST(Receiver, RowGainsAreAtLeastOne) {
  EXPECT_EQ(row_power_gain(-9, -9), 1u);
  EXPECT_EQ(row_power_gain(1, -9), 10u);
  EXPECT_EQ(row_power_gain(-8.5, -9), 1u);
  EXPECT_EQ(row_power_gain(-20, -9), 1u);
  EXPECT_EQ(row_power_gain(200, -9), 4294967295u);
  EXPECT_EQ(row_power_gain(std::numeric_limits<double>::quiet_NaN(), -9), 1u);
}

TEST(Receiver, LevelsAreQuantised) {
  const SampleFormat decibels{
      .bits = 8, .max_code = 255, .scale = SampleFormat::Scale::logarithmic, .floor_db = -20, .ceiling_db = 60};
  EXPECT_EQ(quantise(0, decibels), 0u);
  EXPECT_EQ(quantise(std::numeric_limits<double>::quiet_NaN(), decibels), 0u);
  EXPECT_EQ(quantise(std::numeric_limits<double>::infinity(), decibels), 255u);
  EXPECT_EQ(quantise(0.1, decibels), 0u);
  EXPECT_EQ(quantise(1000, decibels), 255u);
  EXPECT_EQ(quantise(1, decibels), 64u) << "round(255 * 20 / 80): 0 dB is the linear full scale";
  const double added = 255 * 20 * std::log10(2.0) / 80;
  std::uint32_t last = 0;
  for (double v = 0.01; v < 2000; v *= 1.01) {
    const std::uint32_t code = quantise(v, decibels);
    EXPECT_GE(code, last);
    last = code;
    if (v > 0.11 && v < 490) {
      EXPECT_NEAR(quantise(2 * v, decibels) - code, added, 1) << v;
    }
  }
}

TEST(Receiver, SamplesAreQuantised) {
  const SampleFormat linear8{.bits = 8, .max_code = 254, .gamma = 1, .row_gains = false};
  EXPECT_EQ(quantise(0, linear8), 0u);
  EXPECT_EQ(quantise(-1, linear8), 0u);
  EXPECT_EQ(quantise(std::numeric_limits<double>::quiet_NaN(), linear8), 0u);
  EXPECT_EQ(quantise(std::numeric_limits<double>::infinity(), linear8), 254u);
  EXPECT_EQ(quantise(1, linear8), 254u);
  EXPECT_EQ(quantise(0.5, linear8), 127u);
  EXPECT_EQ(quantise(1.49 / 254, linear8), 1u);
  EXPECT_EQ(quantise(1.51 / 254, linear8), 2u);
  const SampleFormat root8{.bits = 8, .max_code = 254, .gamma = 0.5f, .row_gains = false};
  EXPECT_EQ(quantise(0.25, root8), 127u);
  EXPECT_EQ(quantise(0.999 / 255, linear8, true), 0u);
  EXPECT_EQ(quantise(1.001 / 255, linear8, true), 1u);
  EXPECT_EQ(quantise(0.9999, linear8, true), 254u);
  EXPECT_EQ(quantise(1, linear8, true), 254u);
  const SampleFormat linear32{.bits = 32, .max_code = 4294967295u, .gamma = 1, .row_gains = false};
  EXPECT_EQ(quantise(2, linear32), 4294967295u);
  EXPECT_EQ(quantise(0.5, linear32), 2147483648u);
}

TEST(Receiver, Oracle42_TvgCancelsSpreadingAndAbsorption) {
  ReceiverModel law;
  law.tvg_slope_db = 40;
  law.tvg_minimum_range_m = 0;
  law.tvg_ceiling_db = std::numeric_limits<float>::infinity();
  const double alpha_db = 1.42;
  for (double r = 1; r <= 40; r *= 1.2) {
    EXPECT_NEAR(20 * std::log10(two_way_transmission(r, nepers_from_db(alpha_db))) + tvg_db(law, r, alpha_db), 0, 1e-6) << r;
  }
}

TEST(Receiver, TvgHasAMinimumRangeAndACeiling) {
  ReceiverModel law;
  EXPECT_NEAR(tvg_db(law, 0.01, 0.3), tvg_db(law, 0.5, 0.3), 1e-9);
  EXPECT_NEAR(tvg_db(law, 0.5, 0.3), 30 * std::log10(0.5) + 0.3, 1e-6);
  EXPECT_EQ(tvg_db(law, 60, 1), 80);
  law.tvg_slope_db = 40;
  law.tvg_ceiling_db = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(tvg_db(law, 30, 0.4954), 88.8, 0.1);  // gain that LF at 30 m would need
}

TEST(Receiver, FullScaleBecomesOne) {
  ReceiverModel law;
  law.full_scale_upa = 200;
  EXPECT_NEAR(full_scale_factor(law, 20) * 20, 1, 1e-9);
}

TEST(Receiver, NoiseLevelIsThatOfTheSpecification) {
  EXPECT_NEAR(thermal_noise_db(900e3), 44.1, 0.05);
  EXPECT_NEAR(thermal_noise_db(2100e3), 51.4, 0.05);
  EXPECT_NEAR(directivity_index_db(rad_from_deg(1), rad_from_deg(20)), 33.1, 0.1);
  EXPECT_NEAR(directivity_index_db(rad_from_deg(0.6), rad_from_deg(20)), 35.4, 0.1);
  EXPECT_NEAR(directivity_index_db(rad_from_deg(0.4), rad_from_deg(12)), 39.3, 0.1);

  // HF 10 m, SL 200, TS -40, T 10 S 35, 2.5 mm: SNR 28 dB before the noise figure.
  FrequencyMode hf = mode_of(2.1e6, 0.4, 12);
  hf.receiver.noise_figure_db = 0;
  const double bandwidth = noise_bandwidth_hz(envelope_parameter_hz(1500, 0.0025));
  EXPECT_NEAR(200 - 40 - 40 - 2 * 1.4186 * 10 - noise_level_db(hf, bandwidth), 28, 0.5);
  FrequencyMode lf = mode_of(1.2e6, 0.6, 20);
  lf.receiver.noise_figure_db = 10;
  const double lf_snr = 200 - 40 - 40 * std::log10(30) - 2 * 0.4954 * 30 - noise_level_db(lf, bandwidth);
  EXPECT_NEAR(lf_snr, 8.5 - 10, 0.5);
  EXPECT_NEAR(20 * std::log10(noise_rms_upa(lf, bandwidth)), noise_level_db(lf, bandwidth), 1e-9);
}

}  // namespace
}  // namespace sonar
