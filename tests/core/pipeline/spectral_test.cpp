// Sums over frequencies: the definition compared with closed forms, and the fast method compared with the definition.
#include "core/pipeline/pulses/spectral.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::spectral {
namespace {

double relative_error(const std::vector<Complex>& got, const std::vector<Complex>& truth) {
  double error = 0, power = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) error += std::norm(got[i] - truth[i]), power += std::norm(truth[i]);
  return std::sqrt(error / power);
}

std::vector<Arrival> random_arrivals(int n, double longest_s) {
  std::mt19937 random(11);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<Arrival> arrivals;
  for (int i = 0; i < n; ++i) arrivals.push_back({longest_s * uniform(), std::polar(uniform(), 2 * pi * uniform())});
  return arrivals;
}

TEST(Spectral, DirectSumIsTheDefinition) {
  const std::vector<Arrival> arrivals = random_arrivals(5, 0.0133);
  const FrequencyGrid grid{899e3, 75, 1000};
  const std::vector<Complex> sums = direct_sum(arrivals, grid);
  ASSERT_EQ(sums.size(), 1000u);
  for (const int m : {0, 1, 255, 256, 257, 999}) {
    Complex sum;
    for (const Arrival& a : arrivals)
      sum += a.amplitude * std::exp(Complex(0, -2 * pi * std::fmod((grid.first_hz + m * grid.step_hz) * a.delay_s, 1.0)));
    EXPECT_LT(std::abs(sums[static_cast<std::size_t>(m)] - sum), 1e-9) << m;
  }
}

class SpectralWithTransform : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!have_transform) GTEST_SKIP() << "built without a transform";
  }
};

TEST_F(SpectralWithTransform, FastSumKeepsTheErrorOfItsWidth) {
  const std::vector<Arrival> arrivals = random_arrivals(300, 0.0133);
  const struct {
    int width;
    double error;
  } widths[] = {{4, 2e-3}, {5, 2e-4}, {6, 2e-5}, {7, 2e-6}, {8, 2e-7}, {10, 2e-9}};
  for (const FrequencyGrid& grid : {FrequencyGrid{-14750, 75, 394}, FrequencyGrid{885e3, 75.2, 395}, FrequencyGrid{0, 10, 7}}) {
    const std::vector<Complex> truth = direct_sum(arrivals, grid);
    for (const auto& w : widths) {
      const double error = relative_error(fast_sum(arrivals, grid, w.width), truth);
      EXPECT_LE(error, w.error) << w.width << " points, " << grid.count << " frequencies";
      if (w.width == 6) test::record_below(18, "frequency sums, fast (6 points) against direct, relative L2", 1e-4, error, "");
    }
  }
}

TEST_F(SpectralWithTransform, DelaysOutsideOnePeriodAndAtItsSeamAreJustPhases) {
  const FrequencyGrid grid{-3000, 100, 61};
  std::vector<Arrival> arrivals = random_arrivals(20, 0.1);
  for (const double delay : {0.0, -1e-18, 0.01, 0.02 - 1e-17, -0.005, 1e-9, -1e-9}) arrivals.push_back({delay, {1, 0}});
  EXPECT_LE(relative_error(fast_sum(arrivals, grid, 10), direct_sum(arrivals, grid)), 2e-9);
}

TEST_F(SpectralWithTransform, TransformAndInverseGiveTheInput) {
  for (const int size : {2, 6, 30, 394, 1050}) {
    std::vector<Complex> x;
    for (const Arrival& a : random_arrivals(size, 1)) x.push_back(a.amplitude);
    std::vector<Complex> y = x;
    Fft(size, Fft::Direction::forward).run(y.data());
    Complex second;
    for (int n = 0; n < size; ++n) second += x[static_cast<std::size_t>(n)] * std::polar(1.0, -2 * pi * n / size);
    EXPECT_LT(std::abs(y[1] - second), 1e-9 * size);
    Fft(size, Fft::Direction::inverse).run(y.data());
    for (Complex& v : y) v /= size;
    EXPECT_LT(relative_error(y, x), 1e-13);
  }
}

// For beams that are uniform in the sine, eq. (9) is a convolution over columns. A transform computes it completely, without a
// band.
TEST_F(SpectralWithTransform, Oracle19_BeamsByTransformAgainstDenseSum) {
  const double spacing = 0.0018, aperture = aperture_in_wavelengths(Taper::taylor30, 0.00698);
  const int beams = 512, margin = 12, columns = beams + 2 * margin, size = quick_size(2 * columns);
  const auto weight = [&](int apart) { return directivity(Taper::taylor30, aperture, apart * spacing); };
  std::vector<Complex> signal(static_cast<std::size_t>(size)), pattern(static_cast<std::size_t>(size)), dense;
  const std::vector<Arrival> random = random_arrivals(columns, 1);
  for (std::size_t k = 0; k < random.size(); ++k) signal[k] = random[k].amplitude;
  for (int apart = 1 - columns; apart < columns; ++apart)
    pattern[static_cast<std::size_t>((apart + size) % size)] = weight(apart);
  for (int j = 0; j < beams; ++j) {
    Complex sum;
    for (int k = 0; k < columns; ++k) sum += weight(k - j - margin) * random[static_cast<std::size_t>(k)].amplitude;
    dense.push_back(sum);
  }
  const Fft forward(size, Fft::Direction::forward), inverse(size, Fft::Direction::inverse);
  forward.run(signal.data());
  forward.run(pattern.data());
  for (std::size_t i = 0; i < signal.size(); ++i) signal[i] *= pattern[i] / static_cast<double>(size);
  inverse.run(signal.data());
  const std::vector<Complex> got(signal.begin() + margin, signal.begin() + margin + beams);
  test::record_below(19, "coupling by transform against the dense sum, relative L2", 1e-5, relative_error(got, dense), "");
}

TEST(Spectral, QuickSizesAreEvenAndSmooth) {
  EXPECT_EQ(quick_size(1), 2);
  EXPECT_EQ(quick_size(784), 784);  // 2^4 7^2
  EXPECT_EQ(quick_size(785), 800);
}

}  // namespace
}  // namespace sonar::spectral
