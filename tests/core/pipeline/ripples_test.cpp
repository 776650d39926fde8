// Smooth ripples without shadows must not have false dark arcs. At any wavelength, phase and heading, the mean power of each
// row over 18 degrees must equal a sum over the surface in double precision.
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

namespace sonar::test::ripples_test {
namespace {

constexpr double height = 2, tilt = 0.25, lambert_db = -20, from_m = 4.8, to_m = 7.6;
// Half of the sonar's sector, and half of the sector of the mean [rad].
constexpr double half_sector = 0.1745, half_mean = 0.9 * half_sector;

struct Ripples {
  double wavelength, phase, heading;
  double along(double x, double y) const { return 2 * pi / wavelength * (x * std::cos(heading) + y * std::sin(heading)) + phase; }
  double z(double x, double y) const { return 0.02 * wavelength * std::cos(along(x, y)); }
  /// Points upwards and has any length.
  Vec3d normal(double x, double y) const {
    const double slope = -0.02 * 2 * pi * std::sin(along(x, y));
    return {-slope * std::cos(heading), -slope * std::sin(heading), 1};
  }
};

/// sinc^2 of transmitter and receiver as a power. At half of the quoted width the two-way power is one half.
double two_way_power(const FrequencyMode& mode, double psi_rad) {
  const double x = 0.31888 * std::sin(psi_rad) / std::sin(static_cast<double>(mode.pattern.elevation_width_rad) / 2);
  return std::abs(x) < 1e-9 ? 1 : std::pow(std::sin(pi * x) / (pi * x), 4);
}

/// Returns the beams that the mean includes.
std::vector<int> beams_of_mean(const Sounding& s) {
  std::vector<int> beams;
  for (int j = 0; j < s.beams(); ++j)
    if (std::abs(std::asin(s.beam_sine(j))) < half_mean) beams.push_back(j);
  return beams;
}

/// Mean power pattern of these beams in a direction of sine u.
class MeanPattern {
 public:
  MeanPattern(const Sounding& s, const std::vector<int>& beams) {
    const ReceivePattern pattern = receive_pattern(s.mode().pattern);
    for (double u = -reach; u <= reach; u += step) {
      double sum = 0;
      for (const int j : beams) sum += std::pow(pattern(u - s.beam_sine(j)), 2);
      power_.push_back(sum / static_cast<double>(beams.size()));
    }
  }
  double operator()(double u) const { return power_[static_cast<std::size_t>((u + reach) / step + 0.5)]; }

 private:
  static constexpr double reach = 0.2, step = 0.0005;
  std::vector<double> power_;
};

/// Returns the mean of E|s|^2 over some beams, for each row. The surface is divided into pieces of 4 mm by 0.003 rad. Their
/// power is summed by range and weighted by the squared pulse.
std::vector<double> arcs_of(const Sounding& s, const std::vector<int>& beams, const Ripples& ripples) {
  constexpr double step = 0.004, turn = 0.003, bin = 0.002;
  const MeanPattern heard(s, beams);
  std::vector<double> by_range(static_cast<std::size_t>(12 / bin));
  const double mu = lambert_coefficient(lambert_db);
  for (double azimuth = -half_sector + turn / 2; azimuth < half_sector; azimuth += turn)
    for (double ground = 3.8; ground < 8.2; ground += step) {
      const double x = ground * std::cos(azimuth), y = ground * std::sin(azimuth);
      const Vec3d p{x, y, ripples.z(x, y) - height}, n = ripples.normal(x, y);
      const double r = length(p), cosine = -dot(n, p) / (length(n) * r);
      // In the sonar's axes, with the nose down.
      const double ahead = p.x * std::cos(tilt) - p.z * std::sin(tilt), up = p.x * std::sin(tilt) + p.z * std::cos(tilt);
      const double sigma = lambert_per_area(mu, cosine) * length(n) * ground * turn * step;
      by_range[static_cast<std::size_t>(r / bin)] += sigma * heard(y / r) *
                                                     std::pow(two_way_transmission(r, s.medium().absorption_np_per_m), 2) *
                                                     two_way_power(s.mode(), std::atan2(up, ahead));
    }
  std::vector<double> arcs;
  for (int row = 0; row < s.rows(); ++row) {
    double sum = 0;
    const double at = s.range_of_row(row), reach = 0.06;
    for (auto b = static_cast<std::size_t>(std::max(0.0, (at - reach) / bin)); static_cast<double>(b) < (at + reach) / bin; ++b) {
      const double pulse = envelope(s.envelope_hz(), 2 * ((static_cast<double>(b) + 0.5) * bin - at) / 1500);
      sum += by_range[b] * pulse * pulse;
    }
    arcs.push_back(sum * s.medium().source_upa * s.medium().source_upa);
  }
  return arcs;
}

double worst_arc_db(const Ripples& ripples) {
  FrequencyMode mode = p900();
  mode.horizontal_aperture_rad = static_cast<float>(2 * half_sector);
  PingSettings settings = native_rows(to_m + 0.2, 0.0254);
  settings.beam_count = 80;
  const double step = ripples.wavelength / (ripples.wavelength > 0.2 ? 20 : 8);
  SceneMaker maker;
  maker.add(height_field(3.8, 8.2, -1.5, 1.5, step, [&](double x, double y) { return ripples.z(x, y); }), lambert_db);
  Sounding s(maker.make(), mode, settings);
  s.request.switches.expected_power = true;
  s.ping_from({0, 0, height}, {0, tilt, 0});
  const std::vector<int> beams = beams_of_mean(s);
  const std::vector<double> expected = arcs_of(s, beams, ripples);
  double worst = 0;
  for (int row = static_cast<int>(s.row_of_range(from_m)); row < s.row_of_range(to_m); ++row) {
    double sum = 0;
    for (const int j : beams) sum += s.power(row, j);
    const double off = 10 * std::log10(sum / static_cast<double>(beams.size()) / expected[static_cast<std::size_t>(row)]);
    if (std::abs(off) > std::abs(worst)) worst = off;
  }
  return worst;
}

void expect_no_arc(const Ripples& ripples) {
  record_oracle(no_number, "mean over 18 degrees of a row over ripples of 5 cm to 2 m, over the sum in double", 0,
                worst_arc_db(ripples), 0.5, "dB");
}

TEST(Ripples, ShowNoFalseArcs) {
  int cases = 0;
  for (const double wavelength : {0.05, 0.07, 0.1, 0.15, 0.2, 0.28, 0.4, 0.57, 0.8, 1.1, 1.5, 2.0}) {
    const int of_each = 9;
    for (int i = 0; i < of_each; ++i, ++cases)
      // Three headings, 0 to 0.7 rad. The phases are distributed by the golden section.
      expect_no_arc({wavelength, 2 * pi * std::fmod(0.618034 * cases, 1.0), (i % 3) * 0.35});
  }
  EXPECT_GE(cases, 100);
}

// There are one and a half ripples between two rays that both hit slopes of 0. Only the ray between them shows a slope.
TEST(Ripples, ShowNoFalseArcsInStepWithTheRays) {
  for (const Ripples& ripples : {Ripples{0.39, 0.138, 0}, Ripples{0.349, 4.922, 0}}) expect_no_arc(ripples);
}

}  // namespace
}  // namespace sonar::test::ripples_test
