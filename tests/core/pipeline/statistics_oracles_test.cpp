// Oracles on random parts: receiver noise, statistics of speckle, and motion of speckle with the sonar.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

std::shared_ptr<const Scene> flat_bed() {
  return SceneMaker().add(height_field(-5, 40, -40, 40, 2.5, [](double, double) { return 0.0; }), -15).make();
}
std::shared_ptr<const Scene> rough_bed() {
  return SceneMaker().add(height_field(-2, 14, -10, 10, 0.1, rough_relief(0.03, 40)), -15).make();
}

TEST(StatisticsOracles, Oracle30_NoiseLevelWithoutAScene) {
  for (const FrequencyMode& mode : {p900(), oculus_low(), oculus_high()}) {
    for (const PingSettings& settings : {native_rows(10, 0.0254), default_rows(10, 720)}) {
      Sounding s(SceneMaker().make(), mode, settings);
      s.request.switches.noise = true;
      double sum = 0;
      for (const std::uint32_t number : {1u, 2u, 3u}) {
        s.request.number = PingNumber{number};
        s.ping();
        for (const float p : s.last().pressure_upa) sum += static_cast<double>(p) * static_cast<double>(p);
      }
      const double level_db = 10 * std::log10(sum / (3.0 * s.rows() * s.beams()));
      record_oracle(30, "level over NL, no scene", 0, level_db - noise_level_db(mode, noise_bandwidth_hz(s.envelope_hz())), 0.2,
                    "dB");
    }
  }
}

TEST(StatisticsOracles, NoiseBelongsToPingSonarAndSeed) {
  Sounding s(SceneMaker().make(), p900(), default_rows(10, 200));
  s.request.switches.noise = true;
  const std::vector<float> first = s.ping().pressure_upa;
  EXPECT_EQ(s.ping().pressure_upa, first);
  const auto differs = [&](auto&& change) {
    const PingRequest kept = s.request;
    change();
    const std::vector<float> other = s.ping().pressure_upa;
    s.request = kept;
    const std::vector<double> a(first.begin(), first.end()), b(other.begin(), other.end());
    EXPECT_LT(std::abs(correlation(a, b)), 0.05);
  };
  differs([&] { s.request.number = PingNumber{7}; });
  differs([&] { s.request.sonar_id = 3; });
  differs([&] { s.request.seed = Seed{99}; });
}

/// Returns |rho| of the complex samples of a Gaussian field, from the correlation of their intensities: corr(I1, I2) = |rho|^2.
double coherence(const std::vector<double>& power_a, const std::vector<double>& power_b) {
  return std::sqrt(std::max(0.0, correlation(power_a, power_b)));
}

TEST(StatisticsOracles, Oracle31_NoiseCorrelationOfNeighbouringBeams) {
  for (const FrequencyMode& mode : {p900(), oculus_low()}) {
    Sounding s(SceneMaker().make(), mode, native_rows(10, 0.0254));
    s.request.switches.noise = true;
    const double aperture = aperture_in_wavelengths(Taper::taylor30, static_cast<double>(mode.pattern.azimuth_width_rad));
    s.ping();
    for (const int apart : {1, 2, 4, 8}) {
      std::vector<double> a, b;
      double product = 0, square = 0;
      for (int j = 200; j < 312 - apart; ++j) {
        for (int row = 0; row < s.rows(); row += 2) a.push_back(s.power(row, j)), b.push_back(s.power(row, j + apart));
      }
      const double ua = s.beam_sine(256), ub = s.beam_sine(256 + apart);
      for (double u = -0.9; u < 0.9; u += 1e-4) {
        const double wa = directivity(Taper::taylor30, aperture, u - ua), wb = directivity(Taper::taylor30, aperture, u - ub);
        product += wa * wb, square += wa * wa;
      }
      const std::string what = std::to_string(apart) + (apart > 1 ? " beams apart" : " beam apart");
      record_oracle(31, what, std::abs(product / square), coherence(a, b), 0.05, "");
    }
  }
}

TEST(StatisticsOracles, NoiseGrainsHaveThePulsesLength) {
  for (const PingSettings& settings : {native_rows(10, 0.0254), default_rows(10, 400)}) {
    Sounding s(SceneMaker().make(), p900(), settings);
    s.request.switches.noise = true;
    s.ping();
    for (const int apart : {1, 2}) {
      std::vector<double> a, b;
      for (int row = 0; row + apart < s.rows(); ++row) {
        for (int j = 0; j < s.beams(); j += 3) a.push_back(s.power(row, j)), b.push_back(s.power(row + apart, j));
      }
      const double seconds = apart * 2 * settings.range_bin_m / 1500;
      // sqrt() enlarges a correlation near zero. Therefore the square is compared.
      EXPECT_NEAR(correlation(a, b), std::pow(noise_correlation(s.envelope_hz(), seconds), 2), 0.05) << apart;
    }
  }
}

/// Intensities of independent cells of a flat bed, divided by the level of the closed form. The cells are at least 3.5 beam
/// widths and 2 dr apart.
std::vector<double> independent_intensities(const FrequencyMode& mode, const PingSettings& settings, double height, double tilt,
                                            int seeds, double from_m = 0) {
  std::vector<double> all;
  Sounding s(flat_bed(), mode, settings);
  const double width = static_cast<double>(mode.pattern.azimuth_width_rad);
  for (int seed = 1; seed <= seeds; ++seed) {
    s.request.seed = Seed{static_cast<std::uint64_t>(seed)};
    s.ping_from({0, 0, height}, {0, tilt, 0});
    const reference::SeabedLevel bed(mode, s.medium(), s.envelope_hz(), -15, height, tilt);
    double last_sine = 2;
    for (int j = 0; j < s.beams(); ++j) {
      const double u = s.beam_sine(j);
      if (last_sine - u < 3.5 * width || std::abs(u) > 0.6) continue;
      last_sine = u;
      const int step = static_cast<int>(std::ceil(2 * static_cast<double>(settings.pulse_width_m) / settings.range_bin_m));
      for (int row = 0; row < s.rows(); row += step) {
        const double r = s.range_of_row(row), pulse = static_cast<double>(settings.pulse_width_m);
        if (r < from_m || !(r - 2 * pulse > height / std::sqrt(1 - u * u))) continue;
        if (!(bed.pattern(r - 2 * pulse, u) > 0.2)) continue;
        all.push_back(s.power(row, j) / power_from_db(bed.db(r, u)));
      }
    }
  }
  return all;
}

double scintillation_index(const std::vector<double>& intensity) {
  double mean = 0, square = 0;
  for (const double i : intensity) mean += i, square += i * i;
  const auto n = static_cast<double>(intensity.size());
  return square / n / (mean / n * mean / n) - 1;
}

TEST(StatisticsOracles, Oracle23_SpeckleIsRayleigh) {
  std::vector<double> intensity = independent_intensities(p900(), native_rows(10, 0.0254), 2, 0.25, 1);
  ASSERT_GE(intensity.size(), 2000u);
  std::sort(intensity.begin(), intensity.end());
  const auto n = static_cast<double>(intensity.size());
  double worst = 0;
  for (std::size_t i = 0; i < intensity.size(); ++i) {
    const double cumulative = 1 - std::exp(-intensity[i]);  // |s| has a Rayleigh distribution, its square an exponential one
    worst = std::max(
        {worst, std::abs(cumulative - static_cast<double>(i) / n), std::abs(cumulative - static_cast<double>(i + 1) / n)});
  }
  record_below(23, "greatest distance D of " + std::to_string(intensity.size()) + " cells", 1.63 / std::sqrt(n), worst, "");
}

TEST(StatisticsOracles, Oracle24_ScintillationIndexIsOne) {
  struct Case {
    FrequencyMode mode;
    PingSettings settings;
    double height, tilt;
    int seeds;
  };
  for (const Case& c :
       {Case{p900(), native_rows(10, 0.0254), 2, 0.25, 3}, Case{p900(), default_rows(10, 394), 2, 0.25, 3},
        Case{oculus_high(), default_rows(10, 720), 2, 0.25, 1}, Case{oculus_low(), default_rows(30, 720), 3, 0.15, 1}}) {
    const std::vector<double> intensity = independent_intensities(c.mode, c.settings, c.height, c.tilt, c.seeds);
    ASSERT_GE(intensity.size(), 5000u) << c.mode.name;
    record_oracle(24, "of at least 5000 cells", 1, scintillation_index(intensity), 0.1, "");
    double mean = 0;
    for (const double i : intensity) mean += i / static_cast<double>(intensity.size());
    EXPECT_NEAR(10 * std::log10(mean), 0, 0.3) << c.mode.name;
  }
}

// The last third of the range. There the cells of the default lattice are largest compared with the beam and the pulse.
TEST(StatisticsOracles, ScintillationIndexIsOneFarOutAtDefaultQuality) {
  struct Case {
    const char* name;
    FrequencyMode mode;
    PingSettings settings;
    double height, tilt;
    int seeds;
  };
  for (const Case& c : {Case{"P900 10 m, 394 rows", p900(), default_rows(10, 394), 2, 0.2, 4},
                        Case{"M1200d HF 10 m, 720 rows", oculus_high(), default_rows(10, 720), 2, 0.2, 2},
                        Case{"M1200d HF 10 m, 437 rows", oculus_high(), default_rows(10, 437), 2, 0.2, 2},
                        Case{"M1200d LF 30 m, 720 rows", oculus_low(), default_rows(30, 720), 5, 0.2, 1}}) {
    const auto cells = independent_intensities(c.mode, c.settings, c.height, c.tilt, c.seeds, 0.667 * c.settings.range_m);
    EXPECT_GE(cells.size(), 2000u) << c.name;
    record_oracle(no_number, std::string("scintillation index of the last third, ") + c.name, 1, scintillation_index(cells), 0.1,
                  "");
  }
}

double differences(const std::vector<std::byte>& a, const std::vector<std::byte>& b) {
  if (a.size() != b.size()) return static_cast<double>(std::max(a.size(), b.size()));
  double n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) n += a[i] != b[i];
  return n;
}

TEST(StatisticsOracles, Oracle34_StillSceneStillPing) {
  SceneMaker maker;
  maker.add(height_field(-2, 14, -10, 10, 0.1, rough_relief(0.03, 40)), -20).add(sphere(0.4, 3), -10, {5, 1, 0.4});
  maker.add_body(box({0.2, 0.2, 0.3}), -15, {{4, -1, 0.3}, {}}).add_point({6, 0.5, 0.5}, -20);
  std::vector<float> first;
  for (const int threads : {1, 2, 4}) {
    Sounding s(maker.make(), p900(), default_rows(10, 394), {.threads = threads, .engine = {}});
    const Ping& a = s.ping_from({0, 0, 2}, {0.02, 0.25, 0.1});
    const std::vector<float> pressure = a.pressure_upa;
    const std::vector<std::byte> samples = a.samples;
    s.request.number = PingNumber{42};
    s.request.fired_at += std::chrono::seconds(3);
    EXPECT_EQ(s.ping().pressure_upa, pressure);
    record_oracle(34, "samples that differ", 0, differences(s.last().samples, samples), 0, "");
    // Moves to another position and back. Values that are kept between pings must not change the result.
    s.ping_from({1, 1, 3}, {0, 0.4, 1});
    EXPECT_EQ(s.ping_from({0, 0, 2}, {0.02, 0.25, 0.1}).pressure_upa, pressure);
    if (first.empty()) first = pressure;
    EXPECT_EQ(pressure, first) << threads << " threads";
  }
  EXPECT_GT(*std::max_element(first.begin(), first.end()), 0);
}

TEST(StatisticsOracles, Oracle26_CoherenceOfBeamsOnABed) {
  Sounding s(flat_bed(), p900(), native_rows(10, 0.0254));
  const ReceivePattern pattern = receive_pattern(p900().pattern);
  for (const int apart : {1, 3, 5, 8}) {
    std::vector<double> a, b;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      s.request.seed = Seed{seed};
      s.ping_from({0, 0, 2}, {0, 0.25, 0});
      const reference::SeabedLevel bed(s.mode(), s.medium(), s.envelope_hz(), -15, 2, 0.25);
      for (int row = static_cast<int>(s.row_of_range(4)); row < s.row_of_range(9.5); row += 4) {
        for (int j = 128; j < 384 - apart; ++j) {
          const double r = s.range_of_row(row);
          a.push_back(s.power(row, j) / power_from_db(bed.db(r, s.beam_sine(j))));
          b.push_back(s.power(row, j + apart) / power_from_db(bed.db(r, s.beam_sine(j + apart))));
        }
      }
    }
    // Off axis the spacing in the sine shrinks. Therefore the expected value is averaged over the same beams.
    double expected = 0;
    for (int j = 128; j < 384 - apart; ++j) {
      double product = 0, square = 0;
      for (double u = -0.1; u < 0.1; u += 5e-4) {
        const double far = pattern(u + s.beam_sine(j) - s.beam_sine(j + apart));
        product += pattern(u) * far, square += pattern(u) * pattern(u);
      }
      expected += std::pow(product / square, 2) / (256 - apart);
    }
    record_oracle(26, std::to_string(apart) + " beams apart", std::sqrt(expected), coherence(a, b), 0.1, "");
  }
}

// van Cittert-Zernike: if an untapered array of length L moves sideways by x, 1 - 2 x / L of its coherence is left.
TEST(StatisticsOracles, Oracle35_LateralShiftDecorrelates) {
  FrequencyMode mode = p900();
  mode.pattern.azimuth_taper = Taper::uniform;
  const double aperture_m = aperture_in_wavelengths(Taper::uniform, rad_from_deg(1)) * 1500 / 900e3;
  Sounding s(flat_bed(), mode, native_rows(10, 0.0254));
  for (const double part : {0.1, 0.25, 0.5}) {
    std::vector<double> a, b;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      s.request.seed = Seed{seed};
      const std::vector<float> before = s.ping_from({0, 0, 2}, {0, 0.25, 0}).pressure_upa;
      s.ping_from({0, part * aperture_m, 2}, {0, 0.25, 0});
      const reference::SeabedLevel bed(mode, s.medium(), s.envelope_hz(), -15, 2, 0.25);
      for (int row = static_cast<int>(s.row_of_range(4.5)); row < s.row_of_range(9.5); row += 2) {
        for (int j = 0; j < s.beams(); j += 2) {
          if (std::abs(std::asin(s.beam_sine(j))) > rad_from_deg(8)) continue;
          const double expected = power_from_db(bed.db(s.range_of_row(row), s.beam_sine(j)));
          const auto p = static_cast<double>(before[static_cast<std::size_t>(row * s.beams() + j)]);
          a.push_back(p * p / expected), b.push_back(s.power(row, j) / expected);
        }
      }
    }
    record_oracle(35, "coherence after " + std::to_string(part).substr(0, 4) + " L", 1 - 2 * part, coherence(a, b), 0.12, "");
  }
}

/// Returns the correlation of intensities in a patch between two pings. The patch of the second ping is `shift` rows nearer
/// and `beams` beams farther along.
double patch_correlation(const Sounding& s, const std::vector<float>& before, const std::vector<float>& after, double from_m,
                         double to_m, double azimuth_deg, int row_shift, int beam_shift) {
  std::vector<double> a, b;
  const auto power = [&](const std::vector<float>& p, int row, int beam) {
    const auto v = static_cast<double>(p[static_cast<std::size_t>(row * s.beams() + beam)]);
    return v * v;
  };
  for (int row = static_cast<int>(s.row_of_range(from_m)); row < s.row_of_range(to_m); ++row) {
    for (int j = 0; j < s.beams(); ++j) {
      if (std::abs(std::asin(s.beam_sine(j))) > rad_from_deg(azimuth_deg)) continue;
      const double r = s.range_of_row(row), scale = std::pow(r, 4);  // even weight over the patch
      a.push_back(scale * power(before, row, j));
      b.push_back(scale * power(after, row - row_shift, j + beam_shift));
    }
  }
  return correlation(a, b);
}

TEST(StatisticsOracles, Oracle36_SpeckleRidesWithTheBedAhead) {
  const double height = 1.5, tilt = 0.25;
  for (const auto& [name, scene] : {std::pair{"plane", flat_bed()}, std::pair{"relief", rough_bed()}}) {
    Sounding s(scene, p900(), native_rows(10, 0.0254));
    const double one_row = 0.0254;
    for (const double range : {4.0, 6.0, 8.5}) {
      const double cosine = std::sqrt(1 - std::pow(height / range, 2));
      const int rows = static_cast<int>(std::lround(one_row / s.request.settings.range_bin_m));
      const double dx = rows * s.request.settings.range_bin_m / cosine;
      const std::vector<float> before = s.ping_from({0, 0, height}, {0, tilt, 0}).pressure_upa;
      const std::vector<float> after = s.ping_from({dx, 0, height}, {0, tilt, 0}).pressure_upa;
      record_at_least(36, name, 0.9, patch_correlation(s, before, after, range - 0.4, range + 0.4, 5, rows, 0), "");
      EXPECT_LT(patch_correlation(s, before, after, range - 0.4, range + 0.4, 5, 0, 0), 0.75)
          << name << ": unaligned must not match";
    }
  }
}

TEST(StatisticsOracles, Oracle37_SpeckleStaysWithTheBedInATurn) {
  for (const auto& [name, scene] : {std::pair{"plane", flat_bed()}, std::pair{"relief", rough_bed()}}) {
    FrequencyMode mode = p900();
    Sounding s(scene, mode, native_rows(10, 0.0254));
    const double spacing = rad_from_deg(90.0 / 512);
    struct Case {
      int beams_turned, beams_seen;
      double cos_phi;
    };
    // The bed at range r lies at elevation -asin(h / r). Therefore the pattern moves by n cos(phi) beams.
    for (const Case& c : {Case{10, 10, 0.9925}, Case{20, 19, 0.95}, Case{16, 15, 0.9375}}) {
      const double height = 1.0, range = height / std::sqrt(1 - c.cos_phi * c.cos_phi);
      const std::vector<float> before = s.ping_from({0, 0, height}, {0, 0, 0}).pressure_upa;
      // To port by n beams: the scene moves to starboard, to higher beam numbers.
      const std::vector<float> after = s.ping_from({0, 0, height}, {0, 0, c.beams_turned * spacing}).pressure_upa;
      const double aligned = patch_correlation(s, before, after, range - 0.1, range + 0.1, 5, 0, c.beams_seen);
      record_at_least(37, std::string(name) + ", conical beams", 0.9, aligned, "");
      EXPECT_LT(patch_correlation(s, before, after, range - 0.1, range + 0.1, 5, 0, 0), 0.4) << name << " " << range;
    }
  }
}

}  // namespace
}  // namespace sonar::test
