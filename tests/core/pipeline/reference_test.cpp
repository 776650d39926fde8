// Tests of the reference: its two kinds of sums agree, and its closed forms agree with sums over points.
#include "tests/core/pipeline/reference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/sonar/ping.hpp"

namespace sonar::reference {
namespace {

FrequencyMode p900() {
  FrequencyMode mode;
  mode.centre_hz = 900e3f;
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(1));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(20));
  return mode;
}

Grid grid_of(double pulse_width_m, double from_m, int samples) {
  Grid grid;
  grid.envelope_hz = envelope_parameter_hz(1500, pulse_width_m);
  grid.spacing_m = 1500 / (2 * native_sample_rate_hz(grid.envelope_hz));
  grid.first_range_m = from_m;
  grid.samples = samples;
  return grid;
}

TEST(Reference, TimeAndFrequencyAgree) {
  const Grid grid = grid_of(0.0254, 2, 400);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Scatterer> scatterers;
  const double margin = 4 / grid.envelope_hz * 750, span = 400 * grid.spacing_m - 2 * margin;
  for (int i = 0; i < 300; ++i) {
    scatterers.push_back({2 + margin + span * uniform(random), 0, std::polar(uniform(random), 2 * pi * uniform(random))});
  }
  const auto a = signal_in_time(scatterers, grid), b = signal_in_frequency(scatterers, grid);
  double error = 0, power = 0;
  for (std::size_t n = 0; n < a.size(); ++n) error += std::norm(a[n] - b[n]), power += std::norm(a[n]);
  EXPECT_GT(power, 0);
  EXPECT_LT(std::sqrt(error / power), 1e-4);
}

TEST(Reference, APointHasItsLevelAndRange) {
  const Medium medium{1500, nepers_from_db(0.3), amplitude_from_db(210)};
  const Grid grid = grid_of(0.0254, 3, 400);
  const double r = 3 + 100 * grid.spacing_m;
  const Scatterer s = scatterer_at(p900(), medium, {r, 0, 0}, power_from_db(-20), 1);
  const double sine = 0;
  const auto signal = beams(std::span(&s, 1), std::span(&sine, 1), p900().pattern, grid);
  EXPECT_NEAR(20 * std::log10(std::abs(signal[0][100])), 210 - 40 * std::log10(r) - 0.6 * r - 20, 1e-6);
  EXPECT_LT(std::abs(signal[0][99]), std::abs(signal[0][100]));
}

// Compares the closed forms with brute force: points of equal area over the surface, each with its own range, sine and
// incidence.
TEST(Reference, SeabedClosedFormAgreesWithPoints) {
  FrequencyMode mode = p900();
  const Medium medium{1500, 0, 1};
  const double height = 2, lambert_db = -27, mu = lambert_coefficient(lambert_db), step = 0.004, tilt = 0.25;
  for (const auto& [r, sine] : {std::pair{4.0, 0.0}, std::pair{7.0, 0.0}, std::pair{7.0, 0.5}}) {
    const Grid grid = grid_of(0.0254, r, 1);
    const double across = r * sine, ahead = std::sqrt(r * r - across * across - height * height);
    std::vector<Scatterer> points;
    for (double x = ahead - 0.25; x < ahead + 0.25; x += step) {
      for (double y = across - 0.6; y <= across + 0.6; y += step) {
        const double range = std::sqrt(x * x + y * y + height * height);
        const Vec3d in_sonar{x * std::cos(tilt) + height * std::sin(tilt), y, x * std::sin(tilt) - height * std::cos(tilt)};
        points.push_back(scatterer_at(mode, medium, in_sonar, lambert_per_area(mu, height / range) * step * step, 1));
      }
    }
    const double got = expected_power(points, std::span(&sine, 1), mode.pattern, grid)[0][0];
    EXPECT_NEAR(10 * std::log10(got), SeabedLevel(mode, medium, grid.envelope_hz, lambert_db, height, tilt).db(r, sine), 0.05)
        << r << " " << sine;
  }
}

TEST(Reference, WallEnergyClosedFormAgreesWithPoints) {
  FrequencyMode mode = p900();
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(3));  // coarser points are sufficient
  const double mu = 0.01, d = 3, step = 0.03, half_fan = 0.3;
  const double b = envelope_parameter_hz(1500, 0.0254);
  const double aperture = aperture_in_wavelengths(Taper::taylor30, rad_from_deg(3));
  double sum = 0;
  for (double y = -6; y <= 6; y += step) {
    for (double z = -std::tan(half_fan) * d; z <= std::tan(half_fan) * d; z += step) {
      const double r = std::sqrt(d * d + y * y + z * z);
      const Scatterer s = scatterer_at(mode, {}, {d, y, z}, lambert_per_area(mu, d / r) * step * step, 1);
      sum += std::norm(s.amplitude * directivity(Taper::taylor30, aperture, s.sine)) * energy_width_s(b);
    }
  }
  EXPECT_NEAR(10 * std::log10(sum / wall_energy(mode, {}, b, mu, d, half_fan)), 0, 0.05);
}

TEST(Reference, SphereTendsToItsClosedForm) {
  for (const double a : {0.2, 0.05, 0.01}) {
    const double mu = 0.03, d = 4, ratio = a / d;
    const double closed = 2 * pi / 3 * mu * a * a * (1 + 1.5 * ratio) / std::pow(d, 4);
    EXPECT_NEAR(10 * std::log10(sphere_echo_per_m2(mu, a, d) / closed), 0, 0.001 + 12 * ratio * ratio) << a;
  }
}

}  // namespace
}  // namespace sonar::reference
