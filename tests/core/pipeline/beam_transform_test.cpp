// Beams computed by a transform across the columns are equal to sums over columns, with every instruction set.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/plan_tables.hpp"

namespace sonar {
namespace {

FrequencyMode mode_with(double aperture_deg, double width_deg, BeamSpacing spacing) {
  FrequencyMode mode;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(aperture_deg));
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(width_deg));
  mode.beam_spacing = spacing;
  return mode;
}

struct Case {
  const char* name;
  double aperture_deg, width_deg;
  int beams;
  BeamSpacing spacing;
};

class BeamTransform : public testing::TestWithParam<std::tuple<Case, SimdLevel>> {};

TEST_P(BeamTransform, IsTheSumOverColumns) {
  const auto& [c, level] = GetParam();
  const FrequencyMode mode = mode_with(c.aperture_deg, c.width_deg, c.spacing);
  const std::vector<double> sines = make_beam_sines(mode, c.beams);
  const Columns columns = make_columns(mode, c.beams);
  BeamWeights beam_weights;
  beam_weights.transform = std::make_shared<const BeamTransformTables>(receive_pattern(mode.pattern), columns, sines);

  constexpr int samples = 48;
  ColumnSignals signals;
  signals.shape(columns.count, samples, 8);
  for (int k = 0; k < columns.count; ++k)
    for (int n = 0; n < samples; ++n) {
      const Random4 draw = philox(static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(n), 0, 0, 1, 0);
      const ComplexNormal z = complex_normal(draw.v[0], draw.v[1]);
      float* at = signals.column(k) + 2 * (signals.lead + n);
      at[0] = z.re, at[1] = z.im;
    }
  BeamScratch scratch;
  BeamSignals beams;
  beams.shape(c.beams, 0, samples);
  form_beams(signals, beam_weights, simd::kernels_for(level), scratch, beams);

  const ReceivePattern pattern = receive_pattern(mode.pattern);
  double off = 0, all = 0, worst = 0;
  for (int j = 0; j < c.beams; ++j)
    for (int n = 0; n < samples; n += 7) {
      std::complex<double> sum;
      for (int k = 0; k < columns.count; ++k) {
        const float* at = signals.first_sample(k) + 2 * n;
        sum += pattern(columns.sine(k) - sines[static_cast<std::size_t>(j)]) *
               std::complex<double>(static_cast<double>(at[0]), static_cast<double>(at[1]));
      }
      const float* got = beams.beam(j) + 2 * n;
      const double error = std::norm(sum - std::complex<double>(static_cast<double>(got[0]), static_cast<double>(got[1])));
      off += error, all += std::norm(sum);
      worst = std::max(worst, error);
    }
  EXPECT_LT(std::sqrt(off / all), 2e-6);
  EXPECT_LT(std::sqrt(worst * c.beams * 7 / all), 1e-4) << "no beam is wrong, not even the outermost";
}

constexpr auto in_sine = BeamSpacing::uniform_in_sine, in_angle = BeamSpacing::uniform_in_angle;

std::string name_of(const testing::TestParamInfo<std::tuple<Case, SimdLevel>>& about) {
  return std::string(std::get<0>(about.param).name) + "_" +
         std::string(simd_level_names[static_cast<std::size_t>(std::get<1>(about.param))]);
}
INSTANTIATE_TEST_SUITE_P(
    Products, BeamTransform,
    testing::Combine(testing::Values(Case{"on_columns", 80, 0.6, 512, in_sine}, Case{"two_columns_a_beam", 80, 0.4, 512, in_sine},
                                     Case{"between_columns", 90, 1, 512, in_angle}, Case{"sparse_columns", 130, 1, 256, in_angle},
                                     Case{"few", 60, 2, 7, in_angle}),
                     testing::Values(SimdLevel::portable, SimdLevel::avx2, SimdLevel::avx512)),
    name_of);

TEST(BeamTransformTables, WeighAsMuchAsAllColumnsTogether) {
  const FrequencyMode mode = mode_with(90, 1, in_angle);
  const Columns columns = make_columns(mode, 512);
  const std::vector<double> sines = make_beam_sines(mode, 512);
  const BeamWeights ours = make_beam_weights(mode, columns, sines, false);
  const BeamWeights band = make_beam_weights(mode, columns, sines, false, {.dropped_energy = 0, .transform = false});
  ASSERT_TRUE(ours.transform);
  EXPECT_TRUE(ours.panels.empty() && ours.weights.empty()) << "a table of all columns takes as long as a ping";
  EXPECT_NEAR(ours.weight_energy, band.weight_energy, 1e-9 * band.weight_energy);
  EXPECT_FALSE(make_beam_weights(mode, columns, sines, true).transform) << "powers keep their sums";
}

}  // namespace
}  // namespace sonar
