// Detected points of an echo sounder, in pictures summed from point scatterers by code that shares nothing with the engine.
#include "core/sonar/detections.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <random>

#include "core/base/geometry.hpp"

namespace sonar::test {
namespace {

constexpr int beams = 64, directions = 16;
constexpr double above_db = 15, width_rad = 7 * pi / 180;

/// Returns the pattern of 21 elements with Hamming weights, 7 degrees wide at -3 dB, as a function of the difference of two
/// sines.
double pattern(double sines) {
  static const std::vector<double> table = [] {
    std::vector<double> values;
    for (int k = 0; k <= 2000; ++k) {
      double sum = 0, all = 0;
      for (int i = 0; i < 21; ++i) {
        const double w = 0.54 - 0.46 * std::cos(2 * pi * (i + 0.5) / 21);
        sum += w * std::cos(pi * (i - 10) * k / 1000);
        all += w;
      }
      values.push_back(sum / all);
    }
    return values;
  }();
  return table[static_cast<std::size_t>(std::lround(1000 * std::abs(sines)))];
}

struct Scatterer {
  double azimuth_rad, range_m;
  std::complex<double> amplitude;
};

class Sounding {
 public:
  explicit Sounding(double row_m, unsigned seed = 1) : random_(seed) {
    PingSettings& s = ping_.request.settings;
    s.beam_count = beams;
    s.range_m = 10;
    s.range_start_m = 0.5;
    s.range_bin_count = static_cast<int>(9.5 / row_m);
    s.range_bin_m = row_m;
    s.pulse_width_m = static_cast<float>(1.5 * row_m);
    s.format = {.bits = 16, .max_code = 65535, .scale = SampleFormat::Scale::logarithmic, .floor_db = -80, .ceiling_db = 80};
    for (int j = 0; j < beams; ++j)
      ping_.beam_azimuth_rad.push_back(static_cast<float>(rad_from_deg(40.0 * (1 - (2.0 * j + 1) / beams))));
    signal_.resize(static_cast<std::size_t>(s.range_bin_count * beams));
    for (auto& v : signal_) v = 1e-3 * draw();
  }
  std::complex<double> draw() { return {normal_(random_), normal_(random_)}; }
  void add(const Scatterer& s) {
    const PingSettings& settings = ping_.request.settings;
    const double row = (s.range_m - settings.range_of_row(0)) / settings.range_bin_m;
    for (int n = std::max(0, static_cast<int>(row) - 6); n < std::min(settings.range_bin_count, static_cast<int>(row) + 8); ++n) {
      const double pulse = std::exp(-std::log(2.0) * 2 * std::pow((n - row) / 1.5, 2));  // half of its power at half of its width
      for (int j = 0; j < beams; ++j)
        signal_[static_cast<std::size_t>(n * beams + j)] +=
            s.amplitude * pulse *
            pattern(std::sin(static_cast<double>(ping_.beam_azimuth_rad[static_cast<std::size_t>(j)])) - std::sin(s.azimuth_rad));
    }
  }
  /// Adds a surface that scatters evenly. `range_m` is a function of the azimuth.
  void add_floor(const std::function<double(double)>& range_m) {
    for (int i = -600; i <= 600; ++i) {
      const double azimuth = i * rad_from_deg(0.08);
      add({azimuth, range_m(azimuth), draw() * std::cos(azimuth)});
    }
  }
  std::vector<Detection> points() {
    ping_.samples.clear();
    for (const auto& v : signal_) {
      const auto code = static_cast<std::uint32_t>(std::clamp((20 * std::log10(std::abs(v)) + 80) / 160, 0.0, 1.0) * 65535);
      ping_.samples.push_back(static_cast<std::byte>(code & 255));
      ping_.samples.push_back(static_cast<std::byte>(code >> 8));
    }
    return detect_points(ping_, directions, above_db, width_rad);
  }

 private:
  Ping ping_;
  std::vector<std::complex<double>> signal_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

int direction_of(const Detection& p) { return static_cast<int>(std::floor((40 - deg_from_rad(p.azimuth_rad)) / 5)); }

/// Expects a point on the floor in every direction. The error is at most two and a half pulses, usually half a pulse.
void expect_floor(double altitude_m, double slope_deg) {
  for (const double row_m : {0.012, 0.024, 0.048})
    for (unsigned seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(testing::Message() << altitude_m << " m, slope " << slope_deg << ", rows of " << row_m << " m, seed " << seed);
      Sounding s(row_m, seed);
      const double slope = rad_from_deg(slope_deg), pulse_m = 1.5 * row_m;
      s.add_floor([&](double azimuth) { return altitude_m * std::cos(slope) / std::cos(azimuth - slope); });
      const std::vector<Detection> points = s.points();
      EXPECT_EQ(points.size(), static_cast<std::size_t>(directions));
      double before = 1;
      double squares = 0;
      for (const Detection& p : points) {
        EXPECT_LT(p.azimuth_rad, before) << "most to port first";
        before = p.azimuth_rad;
        const double off = p.range_m * std::cos(p.azimuth_rad - slope) - altitude_m * std::cos(slope);
        EXPECT_LT(std::abs(off), 2.5 * pulse_m) << deg_from_rad(p.azimuth_rad);
        squares += off * off;
      }
      EXPECT_LT(std::sqrt(squares / directions), pulse_m);
    }
}

TEST(Detections, AFlatFloorGivesAPointInEachDirection) {
  for (const double altitude_m : {1.5, 5.0, 7.0}) expect_floor(altitude_m, 0);
}
TEST(Detections, ASlopeGivesAPointInEachDirection) {
  expect_floor(5, 10);
  expect_floor(5, -20);
}

TEST(Detections, ThePatternIsSevenDegreesWide) { EXPECT_NEAR(20 * std::log10(pattern(std::sin(rad_from_deg(3.5)))), -3, 0.3); }

TEST(Detections, OneTargetIsOnePoint) {
  for (const double row_m : {0.012, 0.048})
    for (const double level : {0.3, 10.0})
      for (double azimuth = -39; azimuth < 39.5; azimuth += 1.7) {
        SCOPED_TRACE(testing::Message() << azimuth << " degrees, level " << level << ", rows of " << row_m << " m");
        Sounding s(row_m);
        s.add({rad_from_deg(azimuth), 5.003, level});
        const std::vector<Detection> points = s.points();
        ASSERT_EQ(points.size(), 1u);
        EXPECT_NEAR(deg_from_rad(points[0].azimuth_rad), azimuth, 0.7);
        EXPECT_NEAR(points[0].range_m, 5.003, row_m / 2);
      }
}

TEST(Detections, TwoTargetsAreTwoPoints) {
  Sounding s(0.024);
  s.add({rad_from_deg(12.5), 5, 1});
  s.add({rad_from_deg(-17.5), 5.01, 1});
  const std::vector<Detection> points = s.points();
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(direction_of(points[0]), 5);
  EXPECT_EQ(direction_of(points[1]), 11);
}

// Between the targets there is no echo.
TEST(Detections, TargetsApartAreNoFloor) {
  Sounding s(0.024);
  for (const double azimuth_deg : {-37.5, -12.5, 12.5, 37.5}) s.add({rad_from_deg(azimuth_deg), 5, 1});
  EXPECT_EQ(s.points().size(), 4u);
}

TEST(Detections, ATargetOverAFloorIsThePointOfItsDirection) {
  Sounding s(0.024);
  s.add_floor([](double azimuth) { return 7 / std::cos(azimuth); });
  s.add({rad_from_deg(12.5), 5, 10});
  const std::vector<Detection> points = s.points();
  ASSERT_EQ(points.size(), static_cast<std::size_t>(directions));
  for (const Detection& p : points)
    if (direction_of(p) == 5)
      EXPECT_NEAR(p.range_m, 5, 0.012);
    else
      EXPECT_NEAR(p.range_m * std::cos(p.azimuth_rad), 7, 0.1) << deg_from_rad(p.azimuth_rad);
}

TEST(Detections, FewBeamsGiveNoPoint) {
  Ping ping;
  EXPECT_TRUE(detect_points(ping, directions, above_db, width_rad).empty());
}

TEST(Detections, NoiseAloneGivesNoPoint) { EXPECT_TRUE(Sounding(0.024).points().empty()); }

}  // namespace
}  // namespace sonar::test
