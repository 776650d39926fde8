// Compares the synthesis of columns in the frequency and the time domain with the direct sum of eq. (8) in double, for pulses
// of all shapes.
#include "core/pipeline/spectral_columns.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/synthesize.hpp"
#include "tests/core/pipeline/pulses.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

using Shape = Waveform::Shape;
using Complex = std::complex<double>;

struct Arrived {
  double sample;  // exactly representable as a float
  Complex amplitude;
};

std::vector<Arrived> scattered(int n, double from_sample, double to_sample) {
  std::mt19937 random(11);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<Arrived> all;
  for (int i = 0; i < n; ++i) {
    const Complex amplitude = std::polar(uniform(), 2 * pi * uniform());
    all.push_back({static_cast<double>(static_cast<float>(from_sample + (to_sample - from_sample) * uniform())),
                   Complex(std::complex<float>(amplitude))});
  }
  return all;
}

/// p(t) as a formula, with which both methods are compared.
Complex formula(Shape shape, const Pulse& pulse, double time_s) {
  return shape == Shape::measured ? measured_envelope(time_s) : pulse.at(time_s);
}

std::vector<Complex> direct(Shape shape, const PingPlan& plan, const std::vector<Arrived>& echoes) {
  std::vector<Complex> g(static_cast<std::size_t>(plan.samples));
  for (int n = 0; n < plan.samples; ++n)
    for (const Arrived& e : echoes)
      g[static_cast<std::size_t>(n)] += e.amplitude * formula(shape, plan.pulse_shape, plan.sample_time_s * (n - e.sample));
  return g;
}

ColumnSignals synthesized(const PingPlan& plan, const std::vector<Arrived>& arrived) {
  Echoes echoes;
  for (const Arrived& e : arrived) echoes.add(static_cast<float>(e.sample), std::complex<float>(e.amplitude), 7);
  ColumnSignals columns;
  columns.shape(9, plan.samples, plan.taps);
  clear_columns(columns, 0, 9);
  if (plan.spectral) {
    SpectralScratch scratch;
    plan.spectral->begin(3, scratch);
    plan.spectral->add(echoes, 6, scratch);
    plan.spectral->finish(6, 9, scratch, columns);
  } else {
    synthesize(echoes, plan.pulse(), simd::kernels_for(SimdLevel::automatic), columns);
  }
  EXPECT_EQ(echoes.count, 0);
  return columns;
}

double relative_error(const ColumnSignals& columns, int column, const std::vector<Complex>& truth) {
  double error = 0, power = 0;
  for (std::size_t n = 0; n < truth.size(); ++n) {
    const float* at = columns.first_sample(column) + 2 * n;
    error += std::norm(Complex(static_cast<double>(at[0]), static_cast<double>(at[1])) - truth[n]), power += std::norm(truth[n]);
  }
  return std::sqrt(error / power);
}

PingPlan plan_for(Shape shape, bool exact, const PingSettings& settings) {
  FrequencyMode mode = p900();
  mode.waveform = waveform_of(shape);
  mode.waveform.exact = exact;
  return make_plan(mode, settings, Switches{});
}

std::vector<PingSettings> grids() {
  std::vector<PingSettings> all = {native_rows(8, 0.0254), default_rows(8, 300), default_rows(8, 301), default_rows(10, 100)};
  all.back().samples_per_row = 4;
  return all;
}

struct Way {
  Shape shape;
  bool exact;
  double error;  // the corners of a tone need an unlimited band
};

class EveryWay : public ::testing::TestWithParam<Way> {
 protected:
  void SetUp() override {
    if ((GetParam().exact || GetParam().shape == Shape::measured) && !spectral::have_transform)
      GTEST_SKIP() << "built without a transform";
  }
};
INSTANTIATE_TEST_SUITE_P(Pulses, EveryWay,
                         ::testing::Values(Way{Shape::gaussian, true, 1e-4}, Way{Shape::cw, false, 2e-4},
                                           Way{Shape::cw, true, 2e-3}, Way{Shape::lfm, false, 1e-4}, Way{Shape::lfm, true, 1e-4},
                                           Way{Shape::measured, false, 1e-4}));

TEST_P(EveryWay, Oracle18_SynthesisAgainstDirectSum) {
  const auto& [shape, exact, tolerance] = GetParam();
  for (const PingSettings& settings : grids()) {
    const PingPlan plan = plan_for(shape, exact, settings);
    ASSERT_EQ(plan.spectral != nullptr, exact || shape == Shape::measured);
    const double margin = 4 / plan.envelope_hz / plan.sample_time_s;
    const std::vector<Arrived> echoes = scattered(300, margin, plan.samples - margin);
    const ColumnSignals columns = synthesized(plan, echoes);
    const double error = relative_error(columns, 7, direct(shape, plan, echoes));
    const std::string what = name_of(shape) + (plan.spectral ? " by the spectrum" : " in time") + ", relative L2 error";
    if (tolerance <= 1e-4)
      record_below(18, what, tolerance, error, "");
    else
      EXPECT_LT(error, tolerance) << what;
    for (int n = 0; n < plan.samples; ++n) {
      ASSERT_EQ(columns.first_sample(6)[2 * n], 0.0f);
      ASSERT_EQ(columns.first_sample(8)[2 * n], 0.0f);
    }
  }
}

TEST_P(EveryWay, Oracle43_EchoesAtOneEndDoNotWrapToTheOther) {
  const auto& [shape, exact, tolerance] = GetParam();
  for (const PingSettings& settings : grids()) {
    const PingPlan plan = plan_for(shape, exact, settings);
    const double reach = plan.taps / 2 - 0.01;
    for (const double sample :
         {-reach, -0.4 * reach, -0.3, plan.samples - 0.7, plan.samples + 0.4 * reach, plan.samples - 1 + reach}) {
      const std::vector<Arrived> echo = {{static_cast<double>(static_cast<float>(sample)), {1000, 0}}};
      const ColumnSignals columns = synthesized(plan, echo);
      const std::vector<Complex> truth = direct(shape, plan, echo);
      double worst = 0;
      for (int n = 0; n < plan.samples; ++n) {
        const float* at = columns.first_sample(7) + 2 * n;
        const Complex got(static_cast<double>(at[0]), static_cast<double>(at[1]));
        worst = std::max(worst, std::abs(got - truth[static_cast<std::size_t>(n)]) / 1000);
      }
      EXPECT_LT(worst, 5 * tolerance) << name_of(shape) << " at sample " << sample;
    }
  }
}

}  // namespace
}  // namespace sonar::test
