// Beams at listed azimuths, with their own widths: the position of a target compared with that of uniform beams, and the fall
// of its level with the width.
#include <gtest/gtest.h>

#include <cmath>

#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "tests/core/pipeline/basin.hpp"
#include "tests/core/pipeline/scenes.hpp"

namespace sonar::test {
namespace {

constexpr int beams = 96;

FrequencyMode with_list(FrequencyMode mode, std::vector<double> azimuths_rad, std::vector<float> widths_rad = {}) {
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = std::move(azimuths_rad);
  mode.beam_widths_rad = std::move(widths_rad);
  return mode;
}
std::vector<double> even_azimuths(int count) {
  std::vector<double> azimuths;
  for (const double u : make_beam_sines(p900(), count)) azimuths.push_back(std::asin(u));
  return azimuths;
}
/// a x + b x^3: twice as dense in the middle as at the edges.
std::vector<double> uneven_azimuths() {
  std::vector<double> azimuths;
  for (int j = 0; j < beams; ++j) {
    const double x = 1 - (2.0 * j + 1) / beams;
    azimuths.push_back(rad_from_deg(32 * x + 11 * x * x * x));
  }
  return azimuths;
}
PingSettings settings() {
  PingSettings s = default_rows(4, 100);
  s.beam_count = beams;
  return s;
}

TEST(ListedBeams, EvenlyListedBeamsEqualEvenSpacing) {
  Parallel pool(2);
  const auto engine = make_cpu_engine(basin(), pool, {});
  for (const bool expected_power : {false, true}) {
    PingRequest r = low();
    r.switches.expected_power = expected_power;
    const Ping even = engine->run({&r, 1}).front();
    SonarModel model = *r.model;
    model.modes[0] = with_list(model.modes[0], even_azimuths(r.settings.beam_count));
    r.model = std::make_shared<const SonarModel>(std::move(model));
    const Ping listed = engine->run({&r, 1}).front();
    const double top = static_cast<double>(*std::max_element(even.pressure_upa.begin(), even.pressure_upa.end()));
    for (std::size_t i = 0; i < even.pressure_upa.size(); ++i)
      ASSERT_NEAR(even.pressure_upa[i], listed.pressure_upa[i], 1e-5 * top) << i;
    for (std::size_t j = 0; j < even.beam_azimuth_rad.size(); ++j)
      EXPECT_NEAR(even.beam_azimuth_rad[j], listed.beam_azimuth_rad[j], 1e-6);
  }
}

TEST(ListedBeams, PutATargetInTheBeamThatLooksAtIt) {
  const std::vector<double> azimuths = uneven_azimuths();
  for (const std::size_t j : {3u, 30u, 47u, 90u}) {
    Mesh ball = sphere(0.05, 2);
    const Vec3d at{3 * std::cos(azimuths[j]), 3 * std::sin(azimuths[j]), 0};
    Sounding s(SceneMaker().add(std::move(ball), -10, at).make(), with_list(p900(), azimuths), settings());
    s.request.switches.expected_power = true;  // with speckle, a neighbour may be stronger if the ball is wider than a beam
    s.ping();
    int best = 0;
    double most = 0;
    for (int beam = 0; beam < beams; ++beam) {
      double sum = 0;
      for (int row = 0; row < s.rows(); ++row) sum += s.power(row, beam);
      if (sum > most) most = sum, best = beam;
    }
    EXPECT_EQ(best, static_cast<int>(j));
  }
}

// A point at half of the beam's width off the axis is at -3 dB, both through columns (cells) and in its exact direction.
TEST(ListedBeams, HaveWidthsOfTheirOwn) {
  const std::vector<double> azimuths = uneven_azimuths();
  std::vector<float> widths;
  for (int j = 0; j < beams; ++j) widths.push_back(static_cast<float>(rad_from_deg(j % 2 == 0 ? 0.8 : 2.4)));
  for (const std::size_t j : {40u, 41u, 91u, 92u})
    for (const bool by_columns : {false, true}) {
      const auto height = [&](double aside_rad) {
        const Vec3d at{3 * std::cos(azimuths[j] + aside_rad), 3 * std::sin(azimuths[j] + aside_rad), 0};
        SceneMaker maker;
        if (by_columns)
          maker.add(sphere(0.01, 1), -10, at);
        else
          maker.add_point(at, -20);
        Sounding s(maker.make(), with_list(p900(), azimuths, widths), settings());
        s.request.switches.expected_power = true;
        s.ping();
        double sum = 0;
        for (int row = 0; row < s.rows(); ++row) sum += s.power(row, static_cast<int>(j));
        return sum;
      };
      const double half = static_cast<double>(widths[j]) / 2;
      EXPECT_NEAR(10 * std::log10((height(half) + height(-half)) / 2 / height(0)), -3.01, by_columns ? 0.7 : 0.1) << j;
    }
}

TEST(ListedBeams, AreChecked) {
  Sounding s(SceneMaker().make(), p900(), settings());
  const auto why = [&](std::vector<double> azimuths, std::vector<float> widths = {}) {
    SonarModel model = *s.request.model;
    model.modes[0] = with_list(p900(), std::move(azimuths), std::move(widths));
    s.request.settings.beam_count = 3;
    s.request.model = std::make_shared<const SonarModel>(std::move(model));
    return why_invalid(s.request);
  };
  EXPECT_EQ(why({0.2, 0, -0.1}), "");
  EXPECT_EQ(why({0.2, 0, -0.1}, {0.01f, 0.02f, 0.03f}), "");
  EXPECT_EQ(why({0.2, 0}), "beam_count is 3, but the number of listed beams is 2");
  EXPECT_EQ(why({0.2, -0.1, 0}), "listed beam 2 is not to starboard of the one before");
  EXPECT_EQ(why({0.9, 0, -0.1}), "listed beam 0 does not point into the sector");
  EXPECT_EQ(why({0.2, std::nan(""), -0.1}), "listed beam 1 does not point into the sector");
  EXPECT_EQ(why({0.2, 0, -0.1}, {0.1f}), "there must be as many beam widths as beams, or none");
  EXPECT_EQ(why({0.2, 0, -0.1}, {0.1f, 0, 0.1f}), "the width of listed beam 1 is impossible");
}

}  // namespace
}  // namespace sonar::test
