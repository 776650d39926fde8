// The arithmetic of the comparison modes in parts: spectrum, frequency sum, inverse transform, beam correction, rays.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/base/units.hpp"
#include "core/paper/paper_signal.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"

namespace sonar::paper {
namespace {

using spectral::Complex;

FrequencyMode p900() {
  FrequencyMode mode;
  mode.name = "900";
  mode.centre_hz = 900e3f;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(90));
  mode.beam_spacing = BeamSpacing::uniform_in_angle;
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(1));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(20));
  return mode;
}

/// Returns a plan with b = 29.5 kHz and rows of one inch, as in the paper.
PingPlan paper_plan(int beams = 512) {
  PingSettings s;
  s.beam_count = beams;
  s.range_m = 10;
  s.range_bin_m = 1500 / (2 * 29.5e3);
  s.range_bin_count = 394;
  s.pulse_width_m = static_cast<float>(0.588705 * 1500 / 29.5e3);
  return make_plan(p900(), s, {});
}

TEST(PaperSpectrum, FollowsEquationsThreeAndFour) {
  const PaperSpectrum s = make_spectrum(paper_plan());
  EXPECT_EQ(s.count, 394);  // M = b T, T the time of 394 inches
  EXPECT_NEAR(s.first_frequency, 1 - 197, 1e-2);
  EXPECT_NEAR(std::accumulate(s.weight.begin(), s.weight.end(), 0.0), 1, 1e-12);
  const std::size_t middle = 196;  // f_c
  for (const std::size_t off : {50u, 100u, 196u}) {
    const double x = pi * static_cast<double>(off) / 394;
    EXPECT_NEAR(s.weight[middle + off] / s.weight[middle], std::exp(-x * x), 1e-4) << off;
  }
}

TEST(PaperSpectrum, ALoneEchoOnASamplePeaksAtItsAmplitudeAndHasTheGaussiansWidth) {
  const PaperSpectrum s = make_spectrum(paper_plan());
  const InverseTransform inverse(s);
  std::vector<std::complex<float>> sums(static_cast<std::size_t>(s.count));
  std::vector<Complex> work;
  std::vector<float> out(2 * static_cast<std::size_t>(s.samples));
  PaperEchoes echo;
  echo.push_back({(200 + s.sample_offset) / s.samples, {3, 4}});
  SumScratch scratch;
  sum_frequencies(echo, s, nullptr, simd::portable_kernels, scratch, sums);
  inverse.run(sums, work, out.data());
  const auto level = [&](std::size_t n) { return std::hypot(out[2 * n], out[2 * n + 1]); };
  EXPECT_NEAR(out[400], 3, 1e-4);
  EXPECT_NEAR(out[401], 4, 1e-4);
  // b times one row is 1. The neighbour is at about exp(-1); the difference comes from the cut of the spectrum at +-b / 2.
  EXPECT_NEAR(level(201) / 5, std::exp(-1.0), 0.05);
  EXPECT_GT(level(210), 1e-3f);  // the cut causes side lobes, which a Gaussian does not have
}

TEST(PaperSum, FastAndDirectAgreeAndFollowTheDefinition) {
  if (!spectral::have_transform) GTEST_SKIP() << "built without FFTW";
  const PaperSpectrum s = make_spectrum(paper_plan());
  const spectral::FrequencySums fast(s.count, 8);
  PaperEchoes echoes;
  for (int i = 0; i < 300; ++i) echoes.push_back({std::fmod(0.137 + i * 0.618034, 1.0), std::polar(1.0 + i % 7, 0.7 * i)});
  std::vector<std::complex<float>> a(static_cast<std::size_t>(s.count)), b(a.size());
  SumScratch scratch;
  sum_frequencies(echoes, s, nullptr, simd::portable_kernels, scratch, a);
  for (const SimdLevel level : {SimdLevel::portable, SimdLevel::avx2, SimdLevel::avx512}) {
    sum_frequencies(echoes, s, &fast, simd::kernels_for(level), scratch, b);
    double off = 0, all = 0;
    for (std::size_t m = 0; m < a.size(); ++m) {
      Complex sum;
      for (std::size_t i = 0; i < echoes.size(); ++i)
        sum += s.weight[m] * echoes[i].amplitude *
               std::polar(1.0, -2 * pi * echoes[i].turns * (s.first_frequency + static_cast<double>(m)));
      EXPECT_LT(std::abs(sum - Complex(a[m])), 1e-6 + 1e-5 * std::abs(sum)) << m;
      off += std::norm(sum - Complex(b[m]));
      all += std::norm(sum);
    }
    EXPECT_LT(std::sqrt(off / all), 3e-7) << "against the sum in double";
  }
}

TEST(PaperTransform, EqualsItsDefinitionForAnyOffsetAndMoreFrequenciesThanSamples) {
  PingPlan plan = paper_plan();
  plan.samples = 60;
  plan.sample_offset = 0.2;
  plan.envelope_hz *= 1.7;
  const PaperSpectrum s = make_spectrum(plan);
  ASSERT_GT(s.count, s.samples);
  std::vector<std::complex<float>> spectrum;
  for (int m = 0; m < s.count; ++m) spectrum.push_back(std::polar(1.0f, 0.01f * static_cast<float>(m * m)));
  std::vector<Complex> work;
  std::vector<float> out(120);
  InverseTransform(s).run(spectrum, work, out.data());
  for (int n = 0; n < 60; n += 7) {
    Complex sum;
    for (int m = 0; m < s.count; ++m)
      sum += Complex(spectrum[static_cast<std::size_t>(m)]) * std::polar(1.0, 2 * pi * (s.first_frequency + m) * (n + 0.2) / 60);
    EXPECT_NEAR(out[static_cast<std::size_t>(2 * n)], sum.real(), 1e-3);
    EXPECT_NEAR(out[static_cast<std::size_t>(2 * n + 1)], sum.imag(), 1e-3);
  }
}

TEST(PaperPower, OneEchoIsTheSquareOfItsSignal) {
  PingPlan plan = paper_plan();
  const PaperSpectrum s = make_spectrum(plan);
  const InverseTransform inverse(s);
  const PulsePower power(s, inverse);
  for (const double row : {50.0, 200.25, 392.9}) {
    std::vector<std::complex<float>> sums(static_cast<std::size_t>(s.count));
    std::vector<Complex> work;
    std::vector<float> signal(2 * static_cast<std::size_t>(s.samples)), sum(static_cast<std::size_t>(s.samples));
    const double turns = (row + s.sample_offset) / s.samples;
    PaperEchoes echo;
    echo.push_back({turns, {1, 0}});
    SumScratch scratch;
    sum_frequencies(echo, s, nullptr, simd::portable_kernels, scratch, sums);
    inverse.run(sums, work, signal.data());
    power.add({turns, {2, 0}}, sum);
    for (std::size_t n = 0; n < sum.size(); ++n)
      EXPECT_NEAR(sum[n], 2 * (signal[2 * n] * signal[2 * n] + signal[2 * n + 1] * signal[2 * n + 1]), 0.02) << row << " " << n;
  }
}

TEST(PaperCorrection, IsTheSameWithATransformForEvenAzimuths) {
  const double spacing = rad_from_deg(90.0 / 512);
  const PaperFan fan = make_paper_fan(paper_plan(), Mode::paper, 0);
  const auto even = even_correction(fan.azimuth_rad, spacing);
  ASSERT_NE(even, nullptr);
  constexpr int values = 64;
  std::vector<float> in(512 * values), fast(in.size()), slow(in.size());
  for (std::size_t i = 0; i < in.size(); ++i) in[i] = static_cast<float>(std::sin(0.37 * static_cast<double>(i * i % 1009)));
  Parallel pool(2);
  const simd::Kernels& kernels = simd::kernels_for(SimdLevel::automatic);
  correct(*even, in, values, kernels, pool, fast);
  correct(panels_of(make_correction(fan.azimuth_rad, spacing, false), 512, 512), 512, 512, in, values, kernels, pool, slow);
  double off = 0, all = 0;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const auto difference = static_cast<double>(fast[i] - slow[i]);
    off += difference * difference;
    all += static_cast<double>(slow[i] * slow[i]);
  }
  EXPECT_LT(std::sqrt(off / all), 1e-6);
  const PaperFan raster = make_paper_fan(paper_plan(), Mode::raster, 0);
  EXPECT_EQ(even_correction(raster.azimuth_rad, spacing), nullptr) << "pixels are not even in azimuth";
}

TEST(PaperCorrection, IsTheReferenceCodes) {
  const double spacing = rad_from_deg(90.0 / 512);
  const PaperFan fan = make_paper_fan(paper_plan(), Mode::paper, 0);
  const std::vector<float> v = make_correction(fan.azimuth_rad, spacing, false);
  ASSERT_EQ(v.size(), 512u * 512u);
  double energy = 0, row = 0;
  for (const float w : v) energy += static_cast<double>(w) * static_cast<double>(w);
  for (int k = 0; k < 512; ++k) row += static_cast<double>(v[static_cast<std::size_t>(255 * 512 + k)] / v[255 * 512 + 255]);
  EXPECT_NEAR(energy, 1, 1e-4);                                                       // energy of the whole matrix
  EXPECT_NEAR(20 * std::log10(v[255 * 512 + 256] / v[255 * 512 + 255]), -17.8, 0.1);  // width = spacing
  EXPECT_NEAR(20 * std::log10(static_cast<double>(v[0])), -27.2, 0.5);  // -27.6 dB by 512 alone, minus the neighbours
  EXPECT_GT(row, 2);                                                    // |sinc| adds its side lobes in phase
  const std::vector<float> squared = make_correction(fan.azimuth_rad, spacing, true);
  EXPECT_NEAR(squared[1], v[1] * v[1], 1e-9);
}

TEST(PaperCorrection, MultipliesMatrices) {
  const std::vector<float> weights{1, 2, 0, 0, 1, -1};  // 2 beams x 3 columns
  const std::vector<float> in{1, 10, 2, 20, 3, 30};     // 3 columns x 2 values
  std::vector<float> out(4);
  Parallel pool(1);
  for (const SimdLevel level : {SimdLevel::portable, SimdLevel::avx2, SimdLevel::avx512}) {
    std::fill(out.begin(), out.end(), 0.0f);
    correct(panels_of(weights, 2, 3), 2, 3, in, 2, simd::kernels_for(level), pool, out);
    EXPECT_EQ(out, (std::vector<float>{5, 50, -1, -10}));
  }
}

TEST(PaperFan, FanIsUniformInAnglesAndTwiceTheQuotedWidth) {
  const PaperFan fan = make_paper_fan(paper_plan(), Mode::paper, 0);
  EXPECT_EQ(fan.rows, 300);
  EXPECT_EQ(fan.columns(), 512);
  EXPECT_NEAR(fan.first_row, rad_from_deg(-20 + 20.0 / 300), 1e-6);
  const Vec3d d = fan.direction(0, 299);
  EXPECT_NEAR(std::asin(d.z), rad_from_deg(20 - 20.0 / 300), 1e-6);
  EXPECT_NEAR(std::atan2(d.y, d.x), rad_from_deg(45 - 45.0 / 512), 1e-6);
  double sum = 0;
  for (int column = 0; column < 512; ++column) sum += fan.solid_angle_sr(column, 7) * 300;
  EXPECT_NEAR(sum, rad_from_deg(90) * rad_from_deg(40), 1e-3);
}

TEST(PaperFan, GridIsUniformOnAnImagePlaneAndCoversItsSolidAngle) {
  const PaperFan grid = make_paper_fan(paper_plan(), Mode::raster, 0);
  EXPECT_EQ(grid.rows, 11);
  const PaperFan fine = make_paper_fan(paper_plan(), Mode::raster, 200);
  const Vec3d a = fine.direction(0, 0), b = fine.direction(1, 0), c = fine.direction(2, 0);
  EXPECT_NEAR(a.y / a.x - b.y / b.x, b.y / b.x - c.y / c.x, 1e-12);
  double sum = 0;
  for (int column = 0; column < fine.columns(); ++column)
    for (int row = 0; row < fine.rows; ++row) sum += fine.solid_angle_sr(column, row);
  // Half sides of a rectangle. Its solid angle is 4 asin(...).
  const double side = std::tan(rad_from_deg(45)), top = std::tan(rad_from_deg(20));
  EXPECT_NEAR(sum, 4 * std::atan(side * top / std::sqrt(1 + side * side + top * top)), 1e-4);
}

TEST(PaperCrossSection, IsLambertsTimesAnotherCosine) {
  for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
    const double cosine = std::cos(rad_from_deg(degrees));
    const double lambert = lambert_per_area(0.1, cosine) * footprint_area_m2(cosine, 3, 1e-4);
    EXPECT_NEAR(printed_cross_section_m2(0.1, cosine, 3, 1e-4) / lambert, cosine, 1e-12);
  }
}

}  // namespace
}  // namespace sonar::paper
