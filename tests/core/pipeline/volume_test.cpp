// Reverberation of the water: level, statistics, and objects that block it (docs/acoustics.md, section 3).
#include "core/pipeline/volume.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

std::shared_ptr<const Scene> in_water(const SceneMaker& maker, double volume_db) {
  Scene scene = *maker.make();
  scene.water_column.volume_db = static_cast<float>(volume_db);
  return std::make_shared<const Scene>(std::move(scene));
}

/// SL - 40 log r - 2 alpha r + S_v + 10 log10(theta_eff phi_eff r^2 (c / 2) tau_eff), phi_eff = 1.045 two-way widths.
double closed_form_db(const Sounding& s, double volume_db, double range_m) {
  const BeamPattern& pattern = s.mode().pattern;
  const Taper taper = pattern.azimuth_taper;
  const double theta =
      effective_beam_width_u(taper, aperture_in_wavelengths(taper, static_cast<double>(pattern.azimuth_width_rad)));
  const double phi = 1.045 * static_cast<double>(pattern.elevation_width_rad);
  const double volume_m3 = theta * phi * range_m * range_m * 0.5 * 1500 * energy_width_s(s.envelope_hz());
  const reference::Medium medium = s.medium();
  return 20 * std::log10(medium.source_upa * two_way_transmission(range_m, medium.absorption_np_per_m)) + volume_db +
         10 * std::log10(volume_m3);
}

/// Returns the mean power [dB] over beams with |azimuth| below `azimuth_deg`.
double level_db(const Sounding& s, int row, double azimuth_deg) {
  double sum = 0;
  int n = 0;
  for (int j = 0; j < s.beams(); ++j)
    if (std::abs(std::asin(s.beam_sine(j))) < rad_from_deg(azimuth_deg)) sum += s.power(row, j), ++n;
  return 10 * std::log10(sum / n);
}

TEST(Volume, LevelInOpenWater) {
  struct Case {
    FrequencyMode mode;
    PingSettings settings;
  };
  for (const Case& c : {Case{p900(), native_rows(10, 0.0254)}, Case{oculus_low(), default_rows(20, 720)},
                        Case{oculus_high(), default_rows(10, 437)}}) {
    Sounding s(in_water({}, -60), c.mode, c.settings);
    s.request.switches.expected_power = true;
    s.ping();
    const double edge_deg = 0.49 * 180 / pi * static_cast<double>(c.mode.horizontal_aperture_rad);
    for (int row = s.rows() / 20; row < s.rows() - 1; row += 7)
      record_oracle(no_number, "volume reverberation, level in open water", 0,
                    level_db(s, row, edge_deg) - closed_form_db(s, -60, s.range_of_row(row)), 0.3, "dB");
  }
}

TEST(Volume, FlatBeamsAndTheFixedFanReceiveTheSameInOpenWater) {
  for (const bool conical : {true, false})
    for (const int fan : {0, 200}) {
      Sounding s(in_water({}, -60), p900(), default_rows(10, 394));
      s.request.switches.expected_power = true;
      s.request.switches.conical = conical;
      s.request.switches.fixed_fan = fan;
      s.ping();
      EXPECT_NEAR(level_db(s, 300, 3), closed_form_db(s, -60, s.range_of_row(300)), 0.3) << conical << fan;
    }
}

TEST(Volume, SpeckleHasTheExpectedMeanAndIsRayleigh) {
  Sounding s(in_water({}, -50), p900(), native_rows(10, 0.0254));
  const double width = 2 * std::sin(0.5 * static_cast<double>(s.mode().pattern.azimuth_width_rad));
  std::vector<double> intensity;
  for (std::uint32_t ping = 1; ping <= 3; ++ping) {
    s.request.number = PingNumber{ping};
    s.ping();
    double last_sine = 2;
    for (int j = 0; j < s.beams(); ++j) {
      if (last_sine - s.beam_sine(j) < 3.5 * width) continue;
      last_sine = s.beam_sine(j);
      for (int row = 20; row < s.rows() - 4; row += 5)
        intensity.push_back(s.power(row, j) / power_from_db(closed_form_db(s, -50, s.range_of_row(row))));
    }
  }
  ASSERT_GE(intensity.size(), 2000u);
  const auto n = static_cast<double>(intensity.size());
  std::sort(intensity.begin(), intensity.end());
  double worst = 0, mean = 0, square = 0;
  for (const double i : intensity) mean += i / n, square += i * i / n;
  for (std::size_t i = 0; i < intensity.size(); ++i)
    worst = std::max(worst, std::abs(1 - std::exp(-intensity[i]) - (static_cast<double>(i) + 0.5) / n));
  record_oracle(no_number, "volume reverberation, mean of speckle", 0, 10 * std::log10(mean), 0.3, "dB");
  record_below(no_number, "volume reverberation, Kolmogorov-Smirnov distance from Rayleigh", 1.63 / std::sqrt(n), worst, "");
  record_oracle(no_number, "volume reverberation, scintillation index", 1, square / mean / mean - 1, 0.15, "");
}

TEST(Volume, EndsAtAWall) {
  const auto far_wall = SceneMaker().add(wall(30, 30), -80, {5, 0, 0});
  const auto lower_wall = SceneMaker().add(wall(30, 10), -80, {5, 0, -10});  // up to the horizon
  for (const bool expected : {true, false}) {
    Sounding whole(in_water(far_wall, -55), p900(), default_rows(10, 394));
    Sounding half(in_water(lower_wall, -55), p900(), default_rows(10, 394));
    Sounding open(in_water({}, -55), p900(), default_rows(10, 394));
    for (Sounding* s : {&whole, &half, &open}) s->request.switches.expected_power = expected, s->ping();
    const int before = static_cast<int>(open.row_of_range(4.7)), behind = static_cast<int>(open.row_of_range(6));
    double open_sum = 0, whole_sum = 0, half_sum = 0;
    for (int row = behind; row < open.rows(); ++row)
      for (int j = 200; j < 312; ++j)
        open_sum += open.power(row, j), whole_sum += whole.power(row, j), half_sum += half.power(row, j);
    if (expected) {
      EXPECT_NEAR(level_db(whole, before, 10), level_db(open, before, 10), 1e-3);
      record_oracle(no_number, "volume reverberation, half the fan behind a wall", -3.01, 10 * std::log10(half_sum / open_sum),
                    0.3, "dB");
    }
    EXPECT_LT(whole_sum, 1e-4 * open_sum) << expected;
    EXPECT_NEAR(half_sum / open_sum, 0.5, 0.05) << expected;
  }
}

TEST(Volume, IsDrawnAnewForEveryPingOnly) {
  const SceneMaker scene = SceneMaker().add(sphere(0.4, 3), -10, {5, 1, 0.4});
  Sounding s(in_water(scene, -60), silent(oculus_high()), default_rows(10, 400));
  const std::vector<float> first = s.ping().pressure_upa;
  EXPECT_EQ(s.ping().pressure_upa, first);
  for (const int threads : {1, 3}) {
    Sounding other(in_water(scene, -60), silent(oculus_high()), default_rows(10, 400), {.threads = threads, .engine = {}});
    EXPECT_EQ(other.ping().pressure_upa, first) << threads << " threads";
  }
  const auto differs = [&](auto&& change) {
    const PingRequest kept = s.request;
    change();
    const std::vector<float> other = s.ping().pressure_upa;
    s.request = kept;
    std::vector<double> a, b;
    for (std::size_t i = 0; i < first.size(); ++i) {
      const double r = s.range_of_row(static_cast<double>(i / static_cast<std::size_t>(s.beams())));
      if (r > 1 && r < 4) a.push_back(r * static_cast<double>(first[i])), b.push_back(r * static_cast<double>(other[i]));
    }
    EXPECT_LT(std::abs(correlation(a, b)), 0.1);
  };
  differs([&] { s.request.number = PingNumber{7}; });
  differs([&] { s.request.sonar_id = 3; });
  differs([&] { s.request.seed = Seed{99}; });
}

TEST(Volume, IsNotTheNoiseAndOffIsOff) {
  const SceneMaker scene = SceneMaker().add(sphere(0.4, 3), -10, {5, 1, 0.4});
  Sounding clear(in_water(scene, -200), p900(), default_rows(10, 300)),
      turbid(in_water(scene, -60), p900(), default_rows(10, 300));
  for (const bool noise : {false, true}) {
    clear.request.switches.noise = turbid.request.switches.noise = noise;
    turbid.request.switches.volume = true;
    const std::vector<float> none = clear.ping().pressure_upa, some = turbid.ping().pressure_upa;
    EXPECT_NE(some, none);
    turbid.request.switches.volume = false;
    EXPECT_EQ(turbid.ping().pressure_upa, none);
  }
  // A blank ping contains only noise.
  turbid.request.switches.volume = true;
  turbid.request.blank = clear.request.blank = true;
  EXPECT_EQ(turbid.ping().pressure_upa, clear.ping().pressure_upa);
  // Volume and noise have separate draws. In one ping, volume alone and noise alone are not correlated.
  Sounding volume(in_water({}, -60), p900(), default_rows(10, 300)), noise(in_water({}, -200), p900(), default_rows(10, 300));
  noise.request.switches.noise = true;
  volume.ping(), noise.ping();
  std::vector<double> a, b;
  for (int row = 60; row < 300; ++row)
    for (int j = 0; j < volume.beams(); ++j)
      a.push_back(volume.range_of_row(row) * volume.pressure(row, j)), b.push_back(noise.pressure(row, j));
  EXPECT_LT(std::abs(correlation(a, b)), 0.05);
}

}  // namespace
}  // namespace sonar::test
