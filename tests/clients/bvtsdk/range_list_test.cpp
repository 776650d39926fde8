// Tests the range profile and the range data: one range for each bearing.
#include "clients/bvtsdk/core/range_list.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/clients/bvtsdk/made_ping.hpp"

namespace sonar::bvt {
namespace {

RangeList list_of(const PolarPing& ping, const RangeListSettings& settings = {}) {
  RangeList list;
  EXPECT_EQ(make_range_list(ping, settings, list), success);
  return list;
}

/// Returns a ping with two echoes in beam 3 of 8: 20000 in bin 10, 40000 in bin 50.
PolarPing two_echoes() {
  return make_ping(8, 100, 1, 0.1f, [](int j, int k) { return j != 3 ? 5 : k == 10 ? 20000 : k == 50 ? 40000 : 5; });
}

TEST(RangeList, FindsATargetAtItsRangeAndBearing) {
  RangeListSettings settings;
  settings.threshold = 1000;
  const RangeList list = list_of(make_ping_with_target(6, 20, 60000, 512, 400, 1, 0.025f, 3, 1), settings);
  EXPECT_EQ(list.count(), 512);
  EXPECT_EQ(list.valid_count(), 3);
  for (int i = 0; i < list.count(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (!list.valid(i)) {
      EXPECT_GT(list.range_m[at], 999);
      EXPECT_EQ(list.intensity[at], 0);
      EXPECT_EQ(list.x_m(i), 0);
      continue;
    }
    EXPECT_NEAR(list.range_m[at], 6, 0.02);
    EXPECT_NEAR(list.bearing_deg[at], 20, 0.4);
    EXPECT_EQ(list.intensity[at], 60000);
    EXPECT_NEAR(list.x_m(i), 6 * std::sin(20 / 57.29578), 0.05);
    EXPECT_NEAR(list.y_m(i), 6 * std::cos(20 / 57.29578), 0.05);
  }
}

TEST(RangeList, NamesBearingsFromTheLeftEdge) {
  const RangeList list = list_of(two_echoes());
  EXPECT_EQ(list.bearing_deg.front(), -45);
  EXPECT_FLOAT_EQ(list.bearing_deg.back(), 45 - 90.0f / 8);
  EXPECT_DOUBLE_EQ(list.bearing_resolution_deg, 90.0 / 8);
  EXPECT_EQ(list.fov_max_deg, 45);
  EXPECT_NEAR(list.range_resolution_m, 0.1, 1e-6);
}

TEST(RangeList, SelectsTheStrongestOrTheNearest) {
  RangeListSettings settings;
  settings.threshold = 1000;
  EXPECT_NEAR(list_of(two_echoes(), settings).range_m[3], 1 + 50.5 * 0.1, 1e-4);
  settings.policy = RangeListSettings::Policy::nearest;
  const RangeList nearest = list_of(two_echoes(), settings);
  EXPECT_NEAR(nearest.range_m[3], 1 + 10.5 * 0.1, 1e-4);
  EXPECT_EQ(nearest.intensity[3], 20000);
  EXPECT_EQ(nearest.valid_count(), 1);
}

TEST(RangeList, UsesOnlySamplesAboveTheThreshold) {
  RangeListSettings settings;
  settings.threshold = 39999;
  EXPECT_EQ(list_of(two_echoes(), settings).valid_count(), 1);
  settings.threshold = 40000;
  EXPECT_EQ(list_of(two_echoes(), settings).valid_count(), 0);
  settings.threshold = 65535;
  EXPECT_EQ(list_of(two_echoes(), settings).valid_count(), 0);
  settings.threshold = 4;
  EXPECT_EQ(list_of(two_echoes(), settings).valid_count(), 8);
  settings.noise_threshold = 0.01f;
  EXPECT_EQ(list_of(two_echoes(), settings).valid_count(), 1);
}

TEST(RangeList, IsEmptyForNoiseAtTheDefaultThreshold) {
  std::uint32_t state = 1;
  PolarPing noise = make_ping(64, 500, 1, 0.1f, [&](int, int) {
    state = state * 1664525u + 1013904223u;
    return 1 + static_cast<int>(state >> 19);  // to 8192
  });
  EXPECT_EQ(list_of(noise).valid_count(), 0);
  RangeListSettings settings;
  settings.threshold = 0;
  EXPECT_EQ(list_of(noise, settings).valid_count(), 64);
  noise.samples[30 * 500 + 200] = 12000;  // an echo
  EXPECT_EQ(list_of(noise).valid_count(), 1);
  EXPECT_NEAR(list_of(noise).range_m[30], 21.05, 1e-4);
}

TEST(RangeList, BeginsAtTheStartRange) {
  RangeListSettings settings;
  settings.threshold = 1000;
  settings.policy = RangeListSettings::Policy::nearest;
  settings.start_range_m = 2.04f;
  EXPECT_NEAR(list_of(two_echoes(), settings).range_m[3], 2.05, 1e-4);
  settings.start_range_m = 2.06f;
  EXPECT_NEAR(list_of(two_echoes(), settings).range_m[3], 6.05, 1e-4);
  settings.start_range_m = 1e30f;
  EXPECT_EQ(list_of(two_echoes(), settings).valid_count(), 0);
}

TEST(RangeList, ScalesItsRangesWithTheSoundSpeed) {
  RangeListSettings settings;
  settings.threshold = 1000;
  settings.sound_speed_override_mps = 1400;
  EXPECT_NEAR(list_of(two_echoes(), settings).range_m[3], 6.05 * 1400 / 1500, 1e-4);
}

TEST(RangeList, NeedsASignal) {
  PolarPing ping = two_echoes();
  ping.samples.clear();
  RangeList list;
  EXPECT_EQ(make_range_list(ping, {}, list), no_ping_signal);
  EXPECT_EQ(list.count(), 0);
}

}  // namespace
}  // namespace sonar::bvt
