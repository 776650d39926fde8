// Pulses of all shapes through the whole engine: widths, levels, noise and Doppler. Only the intended path may have an
// influence.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/pulses/pulse.hpp"
#include "tests/core/pipeline/pulses.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test::pulse_oracles_test {
namespace {

using Shape = Waveform::Shape;

FrequencyMode with(FrequencyMode mode, const Waveform& waveform) {
  mode.waveform = waveform;
  return mode;
}
FrequencyMode p900_with(Shape shape) { return with(p900(), waveform_of(shape)); }

Pulse pulse_of(const Sounding& s) {
  return Pulse(s.mode().waveform, 2 * static_cast<double>(s.request.settings.pulse_width_m) /
                                      static_cast<double>(s.request.settings.device_sound_speed_mps));
}

std::shared_ptr<const Scene> flat_bed() {
  return SceneMaker().add(height_field(-5, 40, -40, 40, 2.5, [](double, double) { return 0.0; }), -15).make();
}

class EveryShape : public ::testing::TestWithParam<Shape> {
 protected:
  void SetUp() override {
    if (GetParam() == Shape::measured && !spectral::have_transform) GTEST_SKIP() << "built without a transform";
  }
};
INSTANTIATE_TEST_SUITE_P(Pulses, EveryShape, ::testing::ValuesIn(all_shapes()),
                         [](const auto& i) { return i.index == 3 ? "measured" : name_of(i.param); });

TEST_P(EveryShape, Oracle17_WidthOfAPointInRange) {
  PingSettings settings = native_rows(3, 0.0254);
  settings.range_bin_m /= 8;  // finer than the pulse needs, so that its shape is visible
  settings.range_bin_count *= 8;
  settings.beam_count = 65;
  Sounding s(SceneMaker().add_point({2, 0, 0}, -15).make(), with(oculus_high(), waveform_of(GetParam())), settings);
  s.ping();
  const int top = s.loudest_row(32);
  const double half = s.pressure(top, 32) * std::sqrt(0.5);
  const auto crossing = [&](int step) {
    int n = top;
    while (s.pressure(n + step, 32) > half) n += step;
    const double a = s.pressure(n, 32), b = s.pressure(n + step, 32);
    return s.range_of_row(n + step * (a - half) / (a - b));
  };
  record_oracle(17, name_of(GetParam()) + ", -3 dB width of a point over the one asked for", 1,
                (crossing(1) - crossing(-1)) / (pulse_of(s).width_s() * 750), 0.02, "");
  EXPECT_NEAR(s.range_of_row(top), 2, settings.range_bin_m);
}

// Level of a point, fitted through the peak. It does not depend on the pulse.
TEST_P(EveryShape, Oracle3_LevelOfAPoint) {
  PingSettings settings = native_rows(3, 0.0254);
  settings.range_bin_m = 2.0 / 200.5;  // row 200 lies at the point
  settings.range_bin_count = 300;
  settings.beam_count = 65;
  Sounding s(SceneMaker().add_point({2, 0, 0}, -15).make(), with(oculus_high(), waveform_of(GetParam())), settings);
  s.ping();
  const double expected = 200 - 40 * std::log10(2.0) - 2 * 8.685889638 * s.medium().absorption_np_per_m * 2 - 15;
  record_oracle(3, name_of(GetParam()) + ", level of a point", expected, 20 * std::log10(s.pressure(200, 32)), 0.1, "dB");
}

// Expected power of a flat bed follows from the pulse's energy: oracle 8 with another tau_eff.
TEST_P(EveryShape, Oracle8_LevelOfABed) {
  const FrequencyMode mode = without_elevation_pattern(p900_with(GetParam()));
  PingSettings settings = native_rows(9, 0.0254);
  settings.beam_count = 65;
  Sounding s(flat_bed(), mode, settings);
  s.request.switches.expected_power = true;
  s.ping_from({0, 0, 2}, {0, 0.25, 0});
  const double gaussian_b_of_that_energy = std::sqrt(0.5 * pi) / pulse_of(s).energy_width_s();
  const reference::SeabedLevel bed(mode, s.medium(), gaussian_b_of_that_energy, -15, 2, 0.25);
  for (const double from : {4.5, 5.5, 6.5}) {
    double got = 0, expected = 0;
    for (int row = static_cast<int>(s.row_of_range(from)); row < s.row_of_range(from + 0.8); ++row) {
      got += s.power(row, 32);
      expected += std::pow(10.0, bed.db(s.range_of_row(row)) / 10);
    }
    record_oracle(8, name_of(GetParam()) + ", flat bed at azimuth 0", 10 * std::log10(expected), 10 * std::log10(got), 0.3, "dB");
  }
}

// The mean of many pings with speckle has the level of expected power. So both kinds of sums agree.
TEST_P(EveryShape, SpeckleHasTheExpectedPower) {
  Sounding s(flat_bed(), p900_with(GetParam()), default_rows(8, 300));
  const auto mean_power = [&](bool expected) {
    s.request.switches.expected_power = expected;
    s.ping_from({0, 0, 2}, {0, 0.25, 0});
    double sum = 0;
    for (int row = static_cast<int>(s.row_of_range(5)); row < s.row_of_range(7.5); ++row)
      for (int j = 30; j < 480; ++j) sum += s.power(row, j) * std::pow(s.range_of_row(row), 4);
    return sum;
  };
  EXPECT_NEAR(10 * std::log10(mean_power(false) / mean_power(true)), 0, 0.3);
}

TEST_P(EveryShape, Oracle30_NoiseLevelWithoutAScene) {
  for (const PingSettings& settings : {native_rows(10, 0.0254), default_rows(10, 720)}) {
    Sounding s(SceneMaker().make(), p900_with(GetParam()), settings);
    s.request.switches.noise = true;
    double sum = 0;
    for (const std::uint32_t number : {1u, 2u}) {
      s.request.number = PingNumber{number};
      s.ping();
      for (const float p : s.last().pressure_upa) sum += static_cast<double>(p) * static_cast<double>(p);
    }
    record_oracle(30, name_of(GetParam()) + ", noise without a scene", noise_level_db(s.mode(), pulse_of(s).noise_bandwidth_hz()),
                  10 * std::log10(sum / (2.0 * s.rows() * s.beams())), 0.2, "dB");
  }
}

TEST_P(EveryShape, Oracle31_NoiseCorrelationOfNeighbours) {
  Sounding s(SceneMaker().make(), p900_with(GetParam()), native_rows(10, 0.0254));
  s.request.switches.noise = true;
  const double aperture = aperture_in_wavelengths(Taper::taylor30, static_cast<double>(s.mode().pattern.azimuth_width_rad));
  std::vector<double> here, beside, below;
  double product = 0, square = 0;
  for (const std::uint32_t number : {1u, 2u, 3u, 4u}) {
    s.request.number = PingNumber{number};
    s.ping();
    for (int j = 100; j < 412; ++j)
      for (int row = 0; row + 1 < s.rows(); row += 2)
        here.push_back(s.power(row, j)), beside.push_back(s.power(row, j + 2)), below.push_back(s.power(row + 1, j));
  }
  const double ua = s.beam_sine(256), ub = s.beam_sine(258);
  for (double u = -0.9; u < 0.9; u += 1e-4) {
    const double wa = directivity(Taper::taylor30, aperture, u - ua), wb = directivity(Taper::taylor30, aperture, u - ub);
    product += wa * wb, square += wa * wa;
  }
  // For complex Gaussian noise the correlation of intensities is the square of that of the fields.
  const auto coherence = [](double c) { return std::sqrt(std::max(0.0, c)); };
  record_oracle(31, name_of(GetParam()) + ", noise of beams two apart", std::abs(product / square),
                coherence(correlation(here, beside)), 0.05, "");
  const double seconds = 2 * s.request.settings.range_bin_m / 1500;
  EXPECT_NEAR(coherence(correlation(here, below)), std::abs(pulse_of(s).correlation(seconds).real()), 0.05);
}

TEST_P(EveryShape, Oracle43_EchoesBeyondTheRecordDoNotWrap) {
  PingSettings settings = native_rows(10, 0.0254);
  settings.beam_count = 64;
  SceneMaker maker;
  maker.add_point({13, 0, 0}, 20).add_point({20, 0, 0}, 20).add(wall(3, 3), 0, {13.5, 0, 0});
  FrequencyMode mode = p900_with(GetParam());
  mode.waveform.exact = spectral::have_transform;
  Sounding s(maker.make(), mode, settings);
  double loudest = 0;
  for (const float p : s.ping().pressure_upa) loudest = std::max(loudest, static_cast<double>(p));
  record_oracle(43, name_of(GetParam()) + " by the spectrum, loudest of targets at 1.3 of the range", 0, loudest, 0, "uPa");
}

TEST_P(EveryShape, TheSamePictureFromAnyNumberOfThreads) {
  PingSettings settings = default_rows(8, 200);
  settings.beam_count = 256;
  FrequencyMode mode = p900_with(GetParam());
  mode.waveform.exact = spectral::have_transform;
  std::vector<float> first;
  for (const int threads : {1, 2, 5}) {
    Sounding s(flat_bed(), mode, settings, {.threads = threads, .engine = {}});
    s.request.switches.noise = true;
    const std::vector<float> now = s.ping_from({0, 0, 2}, {0, 0.25, 0}).pressure_upa;
    if (first.empty()) first = now;
    EXPECT_EQ(now, first) << threads << " threads";
  }
}

TEST(PulseOracles, ExactIsTheSamePictureByAnotherWay) {
  if (!spectral::have_transform) GTEST_SKIP() << "built without a transform";
  for (const Shape shape : {Shape::gaussian, Shape::lfm}) {
    const auto ping = [&](bool exact, bool expected_power) {
      FrequencyMode mode = p900_with(shape);
      mode.waveform.exact = exact;
      Sounding s(flat_bed(), mode, default_rows(8, 200));
      s.request.switches.expected_power = expected_power;
      return s.ping_from({0, 0, 2}, {0, 0.25, 0}).pressure_upa;
    };
    const std::vector<float> in_time = ping(false, false), by_spectrum = ping(true, false);
    double error = 0, power = 0;
    for (std::size_t i = 0; i < in_time.size(); ++i) {
      error += std::pow(static_cast<double>(in_time[i]) - static_cast<double>(by_spectrum[i]), 2);
      power += std::pow(static_cast<double>(in_time[i]), 2);
    }
    record_below(18, name_of(shape) + " through the engine, spectrum against time, relative L2", 1e-4, std::sqrt(error / power),
                 "");
    EXPECT_EQ(ping(false, true), ping(true, true));  // expected power has only one path
  }
}

/// Returns the range at which a point 5 m straight ahead appears while the sonar moves. Motion within the ping is off, so that
/// only Doppler shifts it.
double apparent_range(const Waveform& waveform, const Twist& twist, bool doppler, int fixed_fan = 0, bool motion = false) {
  PingSettings settings = native_rows(8, 0.0254);
  settings.beam_count = 65;
  SceneMaker maker;
  if (fixed_fan > 0)
    maker.add(wall(0.5, 0.5), 0, {5, 0, 0});
  else
    maker.add_point({5, 0, 0}, -15);
  Sounding s(maker.make(), with(oculus_high(), waveform), settings);
  s.request.switches.motion = motion;
  s.request.switches.doppler = doppler;
  s.request.switches.fixed_fan = fixed_fan;
  s.request.switches.expected_power = fixed_fan > 0;
  s.request.sonar_moves = twist;
  s.ping();
  const int top = s.loudest_row(32);
  return s.range_of_row(top + log_parabola(s.pressure(top - 1, 32), s.pressure(top, 32), s.pressure(top + 1, 32)).offset);
}

TEST(PulseOracles, ASweepsEchoIsShiftedByDoppler) {
  Waveform rising = waveform_of(Shape::lfm);
  rising.sweep_s = 2e-3f;
  Waveform falling = rising;
  falling.falling = true;
  const double resting = apparent_range(rising, {}, true);
  EXPECT_NEAR(resting, 5, 0.002);
  const double bandwidth_hz = 1.303 * 1500 / (2 * 0.0254);
  for (const double speed : {1.5, -1.0}) {
    const Twist closing{{speed, 0, 0}, {}};
    // -(df / B) (c T / 2), df = 2 v f / c
    const double shift = -2 * speed * 2.1e6 / 1500 / bandwidth_hz * 1500 * 2e-3 / 2;
    record_oracle(no_number, "Doppler shift of a rising sweep over the formula's", 1,
                  (apparent_range(rising, closing, true) - resting) / shift, 0.05, "");
    record_oracle(no_number, "Doppler shift of a falling sweep over the formula's", -1,
                  (apparent_range(falling, closing, true) - resting) / shift, 0.05, "");
    EXPECT_EQ(apparent_range(rising, closing, false), resting);
    EXPECT_EQ(apparent_range(waveform_of(Shape::gaussian), closing, true),
              apparent_range(waveform_of(Shape::gaussian), {}, true));
    EXPECT_EQ(apparent_range(waveform_of(Shape::cw), closing, true), apparent_range(waveform_of(Shape::cw), {}, true));
    // Scatterers of the ray fan and points, now with motion within the ping: 5 m of travel, reflection at 3.3 ms.
    EXPECT_NEAR((apparent_range(rising, closing, true, 40) - apparent_range(rising, {}, true, 40)) / shift, 1, 0.05);
    EXPECT_NEAR(apparent_range(rising, closing, true, 0, true) - resting, shift - speed * 5 / 1500, 0.05 * std::abs(shift));
  }
  EXPECT_NEAR(apparent_range(rising, {{0, 2, 1}, {}}, true), resting, 1e-4);  // sideways motion: no range rate, no shift
}

// Cells are shifted tile by tile: a wall of cells moves as the point does.
TEST(PulseOracles, ASweepsSurfacesAreShiftedByDoppler) {
  const auto range_of_wall = [](double speed) {
    PingSettings settings = native_rows(8, 0.0254);
    settings.beam_count = 65;
    Waveform rising = waveform_of(Shape::lfm);
    rising.sweep_s = 2e-3f;
    Sounding s(SceneMaker().add(wall(0.5, 0.5), 0, {5, 0, 0}).make(), with(oculus_high(), rising), settings);
    s.request.switches.expected_power = true;
    s.request.switches.motion = false;
    s.request.sonar_moves = {{speed, 0, 0}, {}};
    s.ping();
    double sum = 0, moment = 0;
    for (int row = 0; row < s.rows(); ++row) sum += s.power(row, 32), moment += s.power(row, 32) * s.range_of_row(row);
    return moment / sum;
  };
  const double shift = -2.1e6 / (1.303 * 1500 / (2 * 0.0254)) * 2e-3;
  EXPECT_NEAR((range_of_wall(1) - range_of_wall(0)) / shift, 1, 0.05);
}

TEST(PulseOracles, RequestsWithPulsesThatCannotBeUsedAreRefused) {
  FrequencyMode mode = p900();
  mode.waveform.shape = Shape::measured;
  Sounding s(SceneMaker().make(), p900(), default_rows(10, 394));
  auto model = std::make_shared<SonarModel>(*s.request.model);
  model->modes[0] = mode;
  s.request.model = model;
  EXPECT_NE(why_invalid(s.request), "");
}

}  // namespace
}  // namespace sonar::test::pulse_oracles_test
