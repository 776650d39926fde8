// The filter that gives white noise the pulse's correlation, on every grid that a sonar may request.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/units.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/pipeline/noise.hpp"
#include "core/pipeline/pulses/pulse.hpp"

namespace sonar {
namespace {

class NoiseFilter : public ::testing::TestWithParam<double> {};  // parameter: samples per -3 dB pulse width

double correlation(const std::vector<float>& h, std::size_t lag) {
  double sum = 0;
  for (std::size_t i = 0; i + lag < h.size(); ++i) sum += static_cast<double>(h[i]) * static_cast<double>(h[i + lag]);
  return sum;
}

TEST_P(NoiseFilter, CorrelatesLikeThePulse) {
  const double bt = 2 * half_power_bt / GetParam();
  const std::vector<float> h = make_noise_filter(Pulse({}, 2 * half_power_bt), bt);  // b = 1
  EXPECT_NEAR(correlation(h, 0), 1.0, 1e-5);
  for (std::size_t lag = 1; lag < h.size(); ++lag)
    EXPECT_NEAR(correlation(h, lag), std::exp(-0.5 * bt * bt * static_cast<double>(lag * lag)), 0.02) << "lag " << lag;
}
INSTANTIATE_TEST_SUITE_P(UsualGrids, NoiseFilter, ::testing::Values(0.5, 0.9, 1.0, 2.355, 5, 9, 10, 20, 30));

TEST(NoiseFilter, StaysFiniteOnAbsurdlyFineGrids) {
  for (const double samples_per_width : {40.0, 57.0, 64.0, 300.0}) {
    const std::vector<float> h = make_noise_filter(Pulse({}, samples_per_width), 1);
    for (const float tap : h) ASSERT_TRUE(std::isfinite(tap)) << samples_per_width;
    EXPECT_NEAR(correlation(h, 0), 1.0, 1e-4);
    EXPECT_GT(correlation(h, 1), 0.9);
  }
}

TEST(NoiseTable, SharesDrawsAndTablesWithOthersOfItsSeed) {
  const std::vector<float> filter{0.6f, 0.8f}, other_filter{0.8f, 0, 0.6f};
  NoiseTable first, same, other, other_seed, alone, alone_other_seed;
  first.prepare(Seed{3}, filter);
  const std::vector<const NoiseTable*> drawn{&same, &first};
  same.prepare(Seed{3}, filter, drawn);
  EXPECT_EQ(&same.shaped(), &first.shaped());
  other.prepare(Seed{3}, other_filter, drawn);
  alone.prepare(Seed{3}, other_filter);
  EXPECT_EQ(other.shaped(), alone.shaped());
  other_seed.prepare(Seed{4}, filter, drawn);
  alone_other_seed.prepare(Seed{4}, filter);
  EXPECT_EQ(other_seed.shaped(), alone_other_seed.shaped());
  EXPECT_NE(other_seed.shaped(), first.shaped());
  first.prepare(Seed{4}, filter);  // the part that others share stays unchanged
  EXPECT_EQ(same.shaped().size(), first.shaped().size());
  EXPECT_NE(same.shaped(), first.shaped());
}

}  // namespace
}  // namespace sonar
