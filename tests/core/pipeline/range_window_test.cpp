// Pictures that begin at a range: PingSettings::range_start_m through the whole engine. The oracle is the picture from range 0,
// whose rows the window must repeat.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "tests/core/pipeline/basin.hpp"
#include "tests/core/pipeline/scenes.hpp"

namespace sonar::test {
namespace {

constexpr int skipped = 37;  // rows before the window

PingSettings from_start(PingSettings s) {
  s.range_start_m = skipped * s.range_bin_m;
  s.range_bin_count -= skipped;
  return s;
}

struct Both {
  Ping whole, window;
};
Both both_of(PingEngine& engine, PingRequest r) {
  Both both;
  both.whole = std::move(engine.run({&r, 1}).front());
  r.settings = from_start(r.settings);
  both.window = std::move(engine.run({&r, 1}).front());
  return both;
}
/// Returns the relative L2 difference of the window's rows.
double apart(const Both& b) {
  const std::size_t before = skipped * b.whole.beam_azimuth_rad.size();
  double apart = 0, all = 0;
  for (std::size_t i = 0; i < b.window.pressure_upa.size(); ++i) {
    const auto whole = static_cast<double>(b.whole.pressure_upa[before + i]);
    apart += std::pow(whole - static_cast<double>(b.window.pressure_upa[i]), 2);
    all += whole * whole;
  }
  return std::sqrt(apart / all);
}

// Cells, points, specular echoes, mirrors, motion, another sonar, truth: all parts without draws for each sample.
TEST(RangeWindow, RepeatsTheRowsOfTheWholePicture) {
  Parallel pool(2);
  const auto engine = make_cpu_engine(basin(), pool, {});
  for (PingRequest r : {high(), low()}) {
    r.switches.noise = r.switches.leak = r.switches.volume = false;
    const Both b = both_of(*engine, r);
    EXPECT_LT(apart(b), 2e-3) << r.sonar_id;
    for (std::size_t j = 0; j < b.whole.truth.size(); ++j) EXPECT_EQ(b.whole.truth[j].range_m, b.window.truth[j].range_m);
    const PingPlan whole = make_plan(r.model->modes[0], r.settings, r.switches),
                   window = make_plan(r.model->modes[0], from_start(r.settings), r.switches);
    for (std::size_t row = 0; row < window.row_power_factor.size() && !r.settings.format.row_gains; ++row)
      EXPECT_NEAR(window.row_power_factor[row] / whole.row_power_factor[row + skipped], 1, 1e-6);
  }
}

// Noise, leak and volume, too, as mean powers.
TEST(RangeWindow, ExpectsTheSamePowers) {
  Parallel pool(2);
  const auto engine = make_cpu_engine(basin(), pool, {});
  for (PingRequest r : {high(), low()}) {
    r.switches.expected_power = true;
    EXPECT_LT(apart(both_of(*engine, r)), 2e-3) << r.sonar_id;
  }
}

TEST(RangeWindow, HasTheNoiseOfItsRows) {
  Sounding s(SceneMaker().make(), p900(), from_start(default_rows(10, 400)));
  s.request.switches.noise = true;
  const auto mean = [&s] {
    double sum = 0;
    for (const float p : s.ping().pressure_upa) sum += static_cast<double>(p) * static_cast<double>(p);
    return sum / static_cast<double>(s.last().pressure_upa.size());
  };
  const double window = mean();
  s.request.settings = default_rows(10, 400);
  EXPECT_NEAR(window / mean(), 1, 0.03);
}

TEST(RangeWindow, BeginsAtItsRangeWithTailsOfEarlierEchoes) {
  const PingSettings settings = from_start(default_rows(4, 200));
  const auto range_of = [&](double rows) { return settings.range_start_m + rows * settings.range_bin_m; };
  const auto loudest_at = [&](double rows_beyond_start) {
    Sounding s(SceneMaker().add_point({range_of(rows_beyond_start), 0, 0}, -20).make(), p900(), settings);
    s.ping();
    return std::array<double, 3>{s.pressure(0, 256), s.pressure(1, 256), s.pressure(2, 256)};
  };
  const auto inside = loudest_at(1.5), edge = loudest_at(-0.2), before = loudest_at(-10);
  EXPECT_GT(inside[1], 2 * inside[0]);
  EXPECT_GT(inside[1], 2 * inside[2]);
  // exp(-(b t)^2) at 0.7 rows from the middle of row 0. Half power is at 0.45 rows.
  EXPECT_NEAR(edge[0] / inside[1] * std::pow(range_of(-0.2) / range_of(1.5), 2), std::exp2(-0.5 * std::pow(0.7 / 0.45, 2)), 0.01);
  EXPECT_GT(edge[0], 5 * edge[1]);
  EXPECT_EQ(*std::max_element(before.begin(), before.end()), 0);
}

TEST(RangeWindow, TakesTimeInProportionToItsRows) {
  const auto flat = [](double, double) { return -3.0; };
  PingSettings settings = native_rows(32, 0.05), far = settings;
  settings.beam_count = far.beam_count = 64;
  far.range_start_m = 30;
  far.range_bin_count = static_cast<int>(2 / far.range_bin_m);
  Sounding s(SceneMaker().add(height_field(0, 40, -40, 40, 2, flat), -25).make(), p900(), settings);
  s.ping();
  const std::size_t whole = s.engine().statistics().cells;
  s.request.settings = far;
  s.ping();
  EXPECT_GT(s.pressure(s.rows() / 2, 32), 0);
  EXPECT_LT(s.engine().statistics().cells, whole / 3);
}

TEST(RangeWindow, BehindTheFarEndIsRefused) {
  Sounding s(SceneMaker().make(), p900(), default_rows(4, 200));
  for (const double bad : {-0.1, 4.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    s.request.settings.range_start_m = bad;
    EXPECT_EQ(why_invalid(s.request), "range_start_m must be from 0 to below range_m");
  }
}

}  // namespace
}  // namespace sonar::test
