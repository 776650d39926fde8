// Pulses of all shapes: widths, side lobes and integrals compared with sums, the tables made from them, and rejected pulses.
#include "core/pipeline/pulses/pulse.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/core/pipeline/pulses.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

using Shape = Waveform::Shape;
using Complex = std::complex<double>;

constexpr double width_s = 2 * 0.0254 / 1500;  // width for the shapes whose width can be chosen

class EveryPulse : public ::testing::TestWithParam<Shape> {
 protected:
  void SetUp() override {
    if (GetParam() == Shape::measured && !spectral::have_transform) GTEST_SKIP() << "built without a transform";
  }
  Pulse pulse() const { return Pulse(waveform_of(GetParam()), width_s); }
};
INSTANTIATE_TEST_SUITE_P(Shapes, EveryPulse, ::testing::ValuesIn(all_shapes()),
                         [](const auto& i) { return i.index == 3 ? "measured" : name_of(i.param); });

TEST_P(EveryPulse, Oracle17_IsAsWideAsItSays) {
  const Pulse p = pulse();
  const auto half_power = [&](double direction) {
    double t = 0;
    while (std::norm(p.at(t)) > 0.5) t += direction * 1e-5 * width_s;
    return t;
  };
  EXPECT_NEAR(std::abs(p.at(0) - 1.0), 0, 1e-6);
  const double expected = GetParam() == Shape::measured ? 2 * half_power_bt / measured_b_hz : width_s;
  record_oracle(17, name_of(GetParam()) + ", -3 dB width of p over the one asked for", 1,
                (half_power(1) - half_power(-1)) / expected, 0.02, "");
  EXPECT_NEAR(p.width_s() / expected, 1, 0.01);
}

TEST_P(EveryPulse, IsOverBeyondItsReach) {
  const Pulse p = pulse();
  for (const double t : {1.0001 * p.reach_s(), 1.5 * p.reach_s(), 1.0, -1.0001 * p.reach_s(), -1.0})
    EXPECT_LT(std::abs(p.at(t)), 1e-9) << t;
}

TEST_P(EveryPulse, IntegralsAreThoseOfP) {
  const Pulse p = pulse();
  const double dt = p.width_s() / 200, reach = 1.01 * p.reach_s();
  double energy = 0;
  Complex spectrum, shifted;
  const spectral::FrequencyGrid grid{-0.3 / width_s, 0.1 / width_s, 7};
  for (double t = -reach; t <= reach; t += dt) {
    energy += std::norm(p.at(t)) * dt;
    spectrum += p.at(t) * std::polar(1.0, -2 * pi * grid.first_hz * t) * dt;
    shifted += p.at(t) * std::conj(p.at(t - 0.7 * width_s)) * dt;
  }
  EXPECT_NEAR(p.energy_width_s() / energy, 1, 1e-3);
  EXPECT_LT(std::abs(p.spectrum_s(grid)[0] - spectrum) / p.width_s(), 2e-3);
  EXPECT_LT(std::abs(p.correlation(0.7 * width_s) - shifted / energy), 2e-3);
  EXPECT_NEAR(p.correlation(0).real(), 1, 1e-3);

  const double df = 0.01 / width_s;
  const spectral::FrequencyGrid wide{-20 / width_s, df, 4001};
  double passed = 0, highest = 0;
  for (const Complex& v : p.spectrum_s(wide)) passed += std::norm(v) * df, highest = std::max(highest, std::norm(v));
  EXPECT_NEAR(p.noise_bandwidth_hz() / (passed / highest), 1, 0.01);
  EXPECT_NEAR(passed / energy, 1, 0.01);  // Parseval
}

TEST_P(EveryPulse, HoldsItsBand) {
  const Pulse p = pulse();
  const double edge = p.band_hz() / 2;
  const std::vector<Complex> inside = p.spectrum_s({-edge, edge / 500, 1001});
  double highest = 0;
  for (const Complex& v : inside) highest = std::max(highest, std::abs(v));
  for (const Complex& v : p.spectrum_s({1.001 * edge, edge / 500, 250}))
    EXPECT_LT(std::abs(v), (GetParam() == Shape::cw ? 4e-4 : 1.01e-4) * highest);
}

TEST_P(EveryPulse, RowsAreTheRealPartOrThePower) {
  const Pulse p = pulse();
  for (const double per_width : {1.11, 0.9, 2.355, 20.0}) {
    const double step = p.width_s() / per_width;
    const int taps = taps_of(p, step), steps = 256;
    EXPECT_EQ(taps % 8, 0);
    for (const bool squared : {false, true}) {
      const std::vector<float> rows = make_pulse_rows(p, step, taps, steps, squared);
      ASSERT_EQ(rows.size(), static_cast<std::size_t>(2 * taps * (steps + 1)));
      double worst = 0;
      for (const double place : {0.0, 0.13, 0.5, 0.87654, 0.9999}) {  // offset of an echo after a sample
        const int row = static_cast<int>(place * steps);
        const double part = place * steps - row;
        double kept = 0, all = 0;
        for (int n = -taps; n <= taps; ++n) {
          const Complex v = p.at(step * (n - place));
          const double truth = squared ? std::norm(v) : v.real();
          const int tap = n + taps / 2 - 1;
          all += truth * truth;
          if (tap < 0 || tap >= taps) continue;
          const auto at = static_cast<std::size_t>(2 * taps * row + tap);
          worst = std::max(worst, std::abs(static_cast<double>(rows[at]) +
                                           part * static_cast<double>(rows[at + static_cast<std::size_t>(taps)]) - truth));
          kept += truth * truth;
        }
        EXPECT_NEAR(kept, all, 1e-12 * all) << "the taps miss a part of the pulse";
      }
      EXPECT_LT(worst, 2e-4) << per_width;
    }
  }
}

TEST_P(EveryPulse, NoiseFilterHasThePulsesCorrelation) {
  const Pulse p = pulse();
  for (const double per_width : {0.9, 1.11, 2.355, 9.0}) {
    const double step = p.width_s() / per_width;
    const std::vector<float> h = make_noise_filter(p, step);
    for (std::size_t lag = 0; lag < std::min<std::size_t>(h.size(), 30); ++lag) {
      double sum = 0;
      for (std::size_t i = 0; i + lag < h.size(); ++i) sum += static_cast<double>(h[i]) * static_cast<double>(h[i + lag]);
      EXPECT_NEAR(sum, p.correlation(static_cast<double>(lag) * step).real(), lag == 0 ? 1e-5 : 0.02) << per_width << ", " << lag;
    }
  }
}

TEST(Pulse, Oracle15_SideLobesOfASweep) {
  const Pulse p(waveform_of(Shape::lfm), width_s);
  double t = 0, highest = 0;
  while (p.at(t).real() > 0) t += width_s * 1e-3;  // first null
  for (; t < p.reach_s(); t += width_s * 1e-3) highest = std::max(highest, std::abs(p.at(t)));
  record_oracle(15, "Hamming-weighted sweep, highest side lobe in range", -42.6, 20 * std::log10(highest), 0.5, "dB");
  EXPECT_NEAR(p.width_s() * sweep_bandwidth_hz(width_s), 1.30, 0.01);
  // At the end of the pulse, where the fade begins, the level is -60 dB.
  double cut = 0;
  for (double x = 0.98 * p.reach_s(); x < p.reach_s(); x += width_s * 1e-3) cut = std::max(cut, std::abs(p.at(x)));
  EXPECT_LT(20 * std::log10(cut), -60);
}

TEST(Pulse, AToneBecomesATriangleAsLongAsItself) {
  const Pulse p(waveform_of(Shape::cw), width_s);
  const double length_s = width_s / 0.5857864;  // dr = 0.293 c T
  EXPECT_NEAR(p.at(0.25 * length_s).real(), 0.75, 1e-6);
  EXPECT_NEAR(p.reach_s(), length_s, 1e-9);
  EXPECT_NEAR(p.energy_width_s(), 2 * length_s / 3, 1e-9);
}

TEST(Pulse, AMeasuredPulseIsWhatItsSamplesWereTakenOf) {
  if (!spectral::have_transform) GTEST_SKIP() << "built without a transform";
  const Pulse p(waveform_of(Shape::measured), width_s);
  double worst = 0;
  for (double x = -5; x < 9; x += 0.0137) {
    const double t = x / measured_b_hz;
    worst = std::max(worst, std::abs(p.at(t) - measured_envelope(t)));
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_FALSE(p.is_real());
}

TEST(Pulse, UnusableWaveformsAreRefused) {
  const double step_s = 3e-5;
  const Waveform good = waveform_of(Shape::measured);
  if (!spectral::have_transform) {
    EXPECT_NE(why_invalid(good, step_s), "");
    return;
  }
  for (const Shape shape : all_shapes()) EXPECT_EQ(why_invalid(waveform_of(shape), step_s), "");
  const auto refused = [&](auto&& change) {
    Waveform w = good;
    change(w);
    EXPECT_NE(why_invalid(w, step_s), "");
  };
  refused([](Waveform& w) { w.samples.clear(); });
  refused([](Waveform& w) { w.samples.resize(65537); });
  refused([](Waveform& w) { w.samples.front() = std::numeric_limits<float>::quiet_NaN(); });
  refused([](Waveform& w) { w.samples.erase(w.samples.begin(), w.samples.begin() + 4); });  // the peak is not in the middle
  refused([](Waveform& w) {
    for (auto& s : w.samples) s = 0;
  });
  refused([](Waveform& w) { w.sample_rate_hz = 0; });
  refused([](Waveform& w) { w.sample_rate_hz = std::numeric_limits<double>::infinity(); });
  refused([](Waveform& w) { w.sample_rate_hz = 1e9; });  // far finer than the rows
  refused([](Waveform& w) { w.sample_rate_hz = 1; });    // longer than any record
  refused([](Waveform& w) { w.sweep_s = 0; });
}

}  // namespace
}  // namespace sonar::test
