// Compares eq. (9) with an array element by element: the signals that beams receive from a few points, near and far, through
// the engine's path for points and through columns and beamforming. Also the angle at which such an array has grating lobes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/pulses/pulse.hpp"
#include "core/pipeline/synthesize.hpp"
#include "tests/core/pipeline/element_array.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

using reference::Complex;
using reference::ElementArray;
using reference::PlacedScatterer;
using Signals = std::vector<std::vector<Complex>>;

struct Agreement {
  double relative_l2 = 0, level_db = 0;
};
Agreement compare(const Signals& got, const Signals& truth) {
  double error = 0, power = 0, got_power = 0;
  for (std::size_t j = 0; j < truth.size(); ++j)
    for (std::size_t n = 0; n < truth[j].size(); ++n) {
      error += std::norm(got[j][n] - truth[j][n]);
      power += std::norm(truth[j][n]);
      got_power += std::norm(got[j][n]);
    }
  return {std::sqrt(error / power), 10 * std::log10(got_power / power)};
}

/// Returns the complex beam signals of the engine's last ping.
Signals beam_signals(const Sounding& s) {
  Signals out(static_cast<std::size_t>(s.beams()), std::vector<Complex>(static_cast<std::size_t>(s.rows())));
  for (std::size_t j = 0; j < out.size(); ++j)
    for (std::size_t n = 0; n < out[j].size(); ++n) out[j][n] = Complex(s.last().beam_signal_upa[n * out.size() + j]);
  return out;
}

std::vector<Vec3d> places(double nearest_m, double farthest_m) {
  std::mt19937 random(17);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<Vec3d> all;
  for (int i = 0; i < 8; ++i) {
    const double r = nearest_m + (farthest_m - nearest_m) * uniform(), azimuth = 0.9 * (uniform() - 0.5);
    const double elevation = 0.1 * (uniform() - 0.5);
    all.push_back(
        {r * std::cos(elevation) * std::cos(azimuth), r * std::cos(elevation) * std::sin(azimuth), r * std::sin(elevation)});
  }
  return all;
}

// A pulse of this length crosses the array as a whole. The near field is removed by focusing at each range.
TEST(Elements, PointsThroughTheEngineMatchTheArray) {
  for (const FrequencyMode& mode : {p900(), oculus_high()})
    for (const double nearest : {0.7, 4.0}) {
      const std::vector<Vec3d> at = places(nearest, nearest + 2);
      SceneMaker maker;
      for (const Vec3d& p : at) maker.add_point(p, -20);
      PingSettings settings = native_rows(nearest + 2.5, 0.0254);
      settings.beam_count = 65;
      Sounding s(maker.make(), mode, settings);
      s.request.switches.keep_beams = true;
      s.ping();
      std::vector<PlacedScatterer> scatterers;
      for (const Vec3d& p : at)
        scatterers.push_back({p, reference::scatterer_at(mode, s.medium(), p, power_from_db(-20), 1).amplitude});
      std::vector<double> sines;
      for (int j = 0; j < s.beams(); ++j) sines.push_back(s.beam_sine(j));
      const reference::Grid grid{1500, s.envelope_hz(), s.range_of_row(0), settings.range_bin_m, s.rows()};
      const Pulse pulse({}, 2 * 0.0254 / 1500);
      const ElementArray array(mode, 1500);
      const Signals truth = array.beams(
          scatterers, sines, grid, [&](double t) { return pulse.at(t); }, pulse.reach_s());
      const Agreement a = compare(beam_signals(s), truth);
      const std::string what = std::to_string(array.elements()) + " elements, points from " + (nearest < 1 ? "0.7" : "4") + " m";
      // At eight apertures there is no far field, and the side lobes are no longer those of the far field.
      record_below(no_number, "eq. 9 against " + what + ", relative L2 of the beams", nearest < 1 ? 0.12 : 0.05, a.relative_l2,
                   "");
      record_oracle(no_number, "eq. 9 against " + what + ", level", 0, a.level_db, 0.1, "dB");
    }
}

// The same comparison through columns and the banded beamforming, with the points in the middle of columns.
TEST(Elements, ColumnsAndBeamWeightsMatchTheArray) {
  FrequencyMode mode = p900();
  mode.beam_spacing = BeamSpacing::uniform_in_sine;
  PingSettings settings = native_rows(6, 0.0254);
  settings.beam_count = 128;
  Switches switches;
  switches.noise = false;
  const PingPlan plan = make_plan(mode, settings, switches);
  const simd::Kernels& kernels = simd::kernels_for(SimdLevel::automatic);
  ColumnSignals columns;
  columns.shape(plan.columns.count, plan.samples, plan.taps);
  clear_columns(columns, 0, plan.columns.count);
  Echoes echoes;
  std::vector<PlacedScatterer> scatterers;
  std::mt19937 random(23);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (int i = 0; i < 8; ++i) {
    const int column = static_cast<int>(plan.columns.count * (0.2 + 0.6 * uniform()));
    const auto sample = static_cast<float>(plan.samples * (0.4 + 0.5 * uniform()));
    const double r = (static_cast<double>(sample) + plan.sample_offset) * plan.sample_spacing_m, u = plan.columns.sine(column);
    const Complex amplitude = std::polar(1.0, 2 * pi * uniform());
    echoes.add(sample, std::complex<float>(amplitude), column);
    scatterers.push_back({{r * std::sqrt(1 - u * u), r * u, 0}, amplitude});
  }
  synthesize(echoes, plan.pulse(), kernels, columns);
  BeamScratch scratch;
  BeamSignals beams;
  beams.shape(settings.beam_count, 0, plan.samples);
  form_beams(columns, plan.beam_weights, kernels, scratch, beams);
  Signals got(static_cast<std::size_t>(settings.beam_count), std::vector<Complex>(static_cast<std::size_t>(plan.samples)));
  for (int j = 0; j < settings.beam_count; ++j)
    for (int n = 0; n < plan.samples; ++n)
      got[static_cast<std::size_t>(j)][static_cast<std::size_t>(n)] = {static_cast<double>(beams.beam(j)[2 * n]),
                                                                       static_cast<double>(beams.beam(j)[2 * n + 1])};
  const reference::Grid grid{1500, plan.envelope_hz, plan.sample_offset * plan.sample_spacing_m, plan.sample_spacing_m,
                             plan.samples};
  const ElementArray array(mode, 1500);
  const Signals truth = array.beams(
      scatterers, plan.beam_sine, grid, [&](double t) { return plan.pulse_shape.at(t); }, plan.pulse_shape.reach_s());
  const Agreement a = compare(got, truth);
  record_below(no_number, "columns and coupling against the array's elements, relative L2 of the beams", 0.05, a.relative_l2, "");
  record_oracle(no_number, "columns and coupling against the array's elements, level", 0, a.level_db, 0.1, "dB");
}

/// Returns the highest level of a point at azimuth 45 degrees, dB re its own beam, in beams whose sine differs by more than
/// 0.1.
double loudest_elsewhere_db(double pitch_wavelengths, double& at_sine) {
  const FrequencyMode mode = p900();
  const ElementArray array(mode, 1500, pitch_wavelengths);
  const double u = std::sin(pi / 4), r = 8;
  std::vector<double> sines{u};
  for (double other = -0.95; other < 0.95; other += 0.002)
    if (std::abs(other - u) > 0.1) sines.push_back(other);
  const std::vector<PlacedScatterer> point{{{r * u, r * u, 0}, 1}};
  // An endless tone shows only the pattern, without the time that a short pulse needs to cross the array.
  const Signals s = array.beams(
      point, sines, {1500, 1, r, 1, 1}, [](double) { return Complex(1); }, 1);
  double loudest = 0;
  for (std::size_t j = 1; j < sines.size(); ++j) {
    if (std::abs(s[j][0]) <= loudest) continue;
    loudest = std::abs(s[j][0]);
    at_sine = sines[j];
  }
  return 20 * std::log10(loudest / std::abs(s[0][0]));
}

TEST(Elements, HalfAWavelengthApartTheyHaveNoGratingLobes) {
  double at_sine = 0;
  record_below(no_number, "array of half-wavelength pitch steered to 45 degrees, loudest elsewhere", -30,
               loudest_elsewhere_db(0.5, at_sine), "dB");
  // Control: at a spacing of 0.8 wavelengths there is a grating lobe at -33 degrees with the level of the beam itself.
  EXPECT_GT(loudest_elsewhere_db(0.8, at_sine), -0.5);
  EXPECT_NEAR(deg_from_rad(std::asin(at_sine)), -32.9, 0.3);
}

}  // namespace
}  // namespace sonar::test
