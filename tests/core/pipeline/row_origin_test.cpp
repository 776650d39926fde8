// Position of a sample in its row (PingSettings::row_centre), through the whole engine.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

struct Case {
  const char* name;
  double row_centre;
  int at_0_3, at_0_7;  // row of a point 0.3 and 0.7 rows beyond the near edge of row 100, minus 100
};
constexpr Case cases[] = {{"middle", 0.5, 0, 0}, {"near edge", 0, 0, 1}, {"far edge", 1, -1, 0}};

TEST(RowOrigin, MovesAPointByHalfARow) {
  for (const int samples_per_row : {1, 4}) {
    PingSettings settings = default_rows(4, 200);
    settings.samples_per_row = samples_per_row;
    for (const double part : {0.3, 0.7}) {
      Sounding s(SceneMaker().add_point({(100 + part) * settings.range_bin_m, 0, 0}, -20).make(), p900(), settings);
      for (const Case& c : cases) {
        s.request.settings.row_centre = c.row_centre;  // the engine must notice the change
        s.ping();
        EXPECT_EQ(s.loudest_row(256) - 100, part < 0.5 ? c.at_0_3 : c.at_0_7) << c.name << " " << part << " " << samples_per_row;
        if (samples_per_row > 1) continue;
        const int row = s.loudest_row(256);
        const Peak peak = log_parabola(s.pressure(row - 1, 256), s.pressure(row, 256), s.pressure(row + 1, 256));
        EXPECT_NEAR(row + peak.offset, s.row_of_range((100 + part) * settings.range_bin_m), 0.1) << c.name;
      }
    }
  }
}

// A change of row_centre from one edge to the other moves bed and points by one row, from i + 1 to i.
TEST(RowOrigin, MovesTheBedWithThePoints) {
  const auto flat = [](double, double) { return -1.5; };
  for (const int samples_per_row : {1, 3}) {
    PingSettings settings = default_rows(4, 200);
    settings.samples_per_row = samples_per_row;
    Sounding s(SceneMaker().add(height_field(0, 6, -6, 6, 0.5, flat), -25).add_point({3, 0.4, 0}, -40).make(), p900(), settings);
    s.request.settings.row_centre = 0;
    const std::vector<float> near = s.ping().pressure_upa;
    s.request.settings.row_centre = 1;
    const std::vector<float> far = s.ping().pressure_upa;
    const float loudest = *std::max_element(near.begin(), near.end());
    ASSERT_GT(loudest, 0);
    const auto beams = static_cast<std::size_t>(s.beams());
    float worst = 0;
    for (std::size_t i = 0; i + beams < near.size(); ++i) worst = std::max(worst, std::abs(near[i + beams] - far[i]));
    EXPECT_LT(worst, 1e-3f * loudest);
  }
}

TEST(RowOrigin, TheTvgGoesWithTheRow) {
  PingSettings near = default_rows(10, 400), far = near, middle = near;
  near.row_centre = 0, far.row_centre = 1;
  const PingPlan a = make_plan(p900(), near, {}), b = make_plan(p900(), far, {}), m = make_plan(p900(), middle, {});
  for (std::size_t row = 100; row < 110; ++row) {
    EXPECT_EQ(a.row_power_factor[row + 1], b.row_power_factor[row]) << row;
    EXPECT_GT(m.row_power_factor[row], a.row_power_factor[row]) << row;
    EXPECT_LT(m.row_power_factor[row], b.row_power_factor[row]) << row;
  }
}

TEST(RowOrigin, OutsideTheRowIsRefused) {
  Sounding s(SceneMaker().make(), p900(), default_rows(4, 200));
  for (const double bad : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    s.request.settings.row_centre = bad;
    EXPECT_EQ(why_invalid(s.request), "row_centre must be from 0 to 1");
  }
}

}  // namespace
}  // namespace sonar::test
