// Compares range images with closed forms: positions of a plane, a sphere and a point, orientation, levels, sound speed,
// threads.
#include "tests/core/pipeline/range_image_sounding.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/base/units.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "core/sonar/water.hpp"

namespace sonar::test {
namespace {

std::shared_ptr<const Scene> plane_ahead(double x_m) { return SceneMaker().add(wall(40, 40), -20, {x_m, 0, 0}).make(); }

/// Returns the share of the pixels with a return that lie on the plane x = `x_m`, within 3 cm.
double share_on_plane(RangeImageSounding& s, double x_m) {
  int valid = 0, on = 0;
  for (int row = 0; row < 64; ++row)
    for (int column = 0; column < 256; ++column) {
      if (s.at(column, row).range == 0) continue;
      ++valid;
      if (std::abs(s.place(column, row).x - x_m) < 0.03) ++on;
    }
  EXPECT_GT(valid, 16384 / 2);
  return static_cast<double>(on) / valid;
}

TEST(RangeImage, PlaneIsFlat) {
  RangeImageSounding s(plane_ahead(5));
  s.ping();
  EXPECT_GT(share_on_plane(s, 5), 0.99);
  s.request().switches.noise = true;
  s.ping();
  EXPECT_GT(share_on_plane(s, 5), 0.99);
}

TEST(RangeImage, SphereIsWhereItIs) {
  const Vec3d centre{6, -1.5, 0.8};
  RangeImageSounding s(SceneMaker().add(sphere(0.5, 5), -10, centre).make());
  s.request().switches.expected_power = true;
  s.ping();
  const auto [column, row] = s.middle();
  EXPECT_NEAR(s.grid().azimuth_rad(column), std::atan2(centre.y, centre.x), rad_from_deg(0.3));
  EXPECT_NEAR(s.grid().elevation_rad(row), std::atan2(centre.z, std::hypot(centre.x, centre.y)), rad_from_deg(0.4));
  EXPECT_NEAR(s.range_m(static_cast<int>(std::lround(column)), static_cast<int>(std::lround(row))), length(centre) - 0.5, 0.02);
}

TEST(RangeImage, LeftIsTheFirstColumnAndUpTheLastRow) {
  RangeImageSounding s(SceneMaker().add_point({6, 1, 1}, -20).make());
  s.request().switches.expected_power = true;
  s.ping();
  const auto [column, row] = s.middle();
  EXPECT_LT(column, 127.5);
  EXPECT_GT(row, 31.5);
  EXPECT_NEAR(s.grid().azimuth_rad(column), std::atan2(1, 6), rad_from_deg(0.2));
  EXPECT_NEAR(s.range_m(static_cast<int>(std::lround(column)), static_cast<int>(std::lround(row))), std::sqrt(38.0), 0.005);
}

TEST(RangeImage, ReportsTheNearestOrTheStrongestReturn) {
  const auto scene = SceneMaker().add_point({5, 0, 0}, -40).add_point({8, 0, 0}, -20).make();
  RangeImageSounding s(scene);
  s.request().switches.expected_power = true;
  s.ping();
  EXPECT_NEAR(s.range_m(127, 32), 8, 0.02);
  s.wanted->nearest = true;
  s.ping();
  EXPECT_NEAR(s.range_m(127, 32), 5, 0.02);
}

TEST(RangeImage, BelievedSoundSpeedScalesRanges) {
  RangeImageSounding s(plane_ahead(5));
  s.request().switches.expected_power = true;
  s.ping();
  const double right = s.range_m(127, 32);
  s.request().settings.device_sound_speed_mps = 1450;
  s.ping();
  EXPECT_NEAR(s.range_m(127, 32) / right, 1450.0 / 1500, 1e-3);
}

TEST(RangeImage, AnglesFollowTheDevicesSoundSpeedIfConfigured) {
  const double c = 1412, azimuth = rad_from_deg(25), elevation = rad_from_deg(-12);
  const Vec3d there{6 * std::cos(elevation) * std::cos(azimuth), 6 * std::cos(elevation) * std::sin(azimuth),
                    6 * std::sin(elevation)};
  for (const Bearings bearings : {Bearings::are_true, Bearings::follow_device_speed}) {
    RangeImageSounding s(SceneMaker().add_point(there, 0).make());
    s.request().water.sound_speed_mps = c;
    s.request().bearings = bearings;
    s.ping();
    const double scale = bearings == Bearings::are_true ? 1 : 1500 / c;
    const auto [column, row] = s.middle();
    EXPECT_NEAR(s.grid().azimuth_rad(column), std::asin(std::sin(azimuth) * scale), s.grid().column_step_rad() / 2);
    EXPECT_NEAR(s.grid().elevation_rad(row), std::asin(std::sin(elevation) * scale), s.grid().row_step_rad() / 2);
  }
}

TEST(RangeImage, StrengthIsProportionalToAmplitude) {
  RangeImageSounding s(plane_ahead(5));
  s.request().switches.expected_power = true;
  s.ping();
  const double before = s.at(127, 32).strength;
  s.request().settings.gain_db += 20 * std::log10(2.0f);
  s.ping();
  EXPECT_NEAR(s.at(127, 32).strength / before, 2, 0.02);
}

/// On a uniform, extended target the mean power with speckle equals the expected power.
TEST(RangeImage, SpeckleHasTheExpectedPower) {
  RangeImageSounding s(plane_ahead(5));
  s.request().settings.gain_db = 40;
  s.wanted->least_strength = 1;
  s.request().switches.expected_power = true;
  const Ping expected = s.ping();
  s.request().switches.expected_power = false;
  s.ping();
  double ratio = 0, n = 0;
  for (int row = 10; row < 54; ++row)
    for (int column = 40; column < 216; ++column, ++n) {
      const double e = range_pixel(expected, static_cast<std::size_t>(row * 256 + column)).strength;
      ratio += std::pow(s.at(column, row).strength / e, 2);
    }
  EXPECT_NEAR(ratio / n, 1, 0.1);
}

TEST(RangeImage, NoiseAloneHasFewFalseAlarms) {
  RangeImageSounding s(SceneMaker().make());
  s.request().switches.noise = true;
  s.request().settings.gain_db = 150;
  s.ping();
  int alarms = 0;
  for (int i = 0; i < 16384; ++i) alarms += range_pixel(s.last(), static_cast<std::size_t>(i)).range != 0;
  EXPECT_LT(alarms, 16);
  // A pixel reports the strongest of about 777 range cells. In each, noise exceeds 8 times its mean with probability e^-8.
  // Therefore about a quarter of the pixels report a false alarm.
  s.wanted->detection = 8;
  s.ping();
  for (int i = alarms = 0; i < 16384; ++i) alarms += range_pixel(s.last(), static_cast<std::size_t>(i)).range != 0;
  EXPECT_NEAR(alarms / 16384.0, 1 - std::pow(1 - std::exp(-8), 777), 0.02);
}

/// Returns a picture of noise: a quarter of the pixels report random ranges.
RangeImageSounding of_noise() {
  RangeImageSounding s(SceneMaker().make());
  s.request().switches.noise = true;
  s.request().settings.gain_db = 150;
  s.wanted->detection = 8;
  return s;
}

TEST(RangeImage, ReturnsThatNothingConfirmsAreDropped) {
  RangeImageSounding s = of_noise();
  const auto count = [&s] {
    s.ping();
    int n = 0;
    for (int i = 0; i < 16384; ++i) n += range_pixel(s.last(), static_cast<std::size_t>(i)).range != 0;
    return n;
  };
  const int all = count();
  s.wanted->least_confirming = 2, s.wanted->confirming_m = 0.01;
  EXPECT_GT(all, 2000);
  EXPECT_LT(count(), all / 100);
  s.wanted->confirming_m = 15;
  EXPECT_GT(count(), all / 2);
}

TEST(RangeImage, MediansEndAtTheEdgesOfBlocks) {
  RangeImageSounding s = of_noise();
  s.wanted->detection = 4;
  s.wanted->median_passes = 2;
  const auto equal = [&s](int row) {  // compared with the row above
    int n = 0;
    for (int column = 0; column < 256; ++column)
      n += s.at(column, row).range != 0 && s.at(column, row).range == s.at(column, row + 1).range;
    return n;
  };
  s.ping();
  EXPECT_GT(equal(15), 40);
  s.wanted->block_rows = 16;
  s.ping();
  for (const int row : {15, 31, 47}) EXPECT_LT(equal(row), 5) << row;
  for (const int row : {0, 14, 16, 40, 62}) EXPECT_GT(equal(row), 40) << row;
}

TEST(RangeImage, FiltersAndSpeckleLeaveAPlaneWhereItIs) {
  RangeImageSounding s(plane_ahead(5));
  s.request().switches.noise = true;
  s.wanted->chosen_as_heard = true;
  s.wanted->range_sample_m = 0.005;
  s.wanted->block_rows = 16, s.wanted->least_confirming = 2, s.wanted->confirming_m = 0.1, s.wanted->median_passes = 2;
  s.ping();
  double squares = 0, n = 0;
  // Farther from the middle the plane is oblique, and a beam covers a wide interval of ranges.
  for (int row = 20; row < 44; ++row)
    for (int column = 112; column < 144; ++column)
      if (s.at(column, row).range != 0) squares += std::pow(s.place(column, row).x - 5, 2), ++n;
  EXPECT_GT(n, 0.95 * 24 * 32);
  EXPECT_LT(std::sqrt(squares / n), 0.015);
  for (int column = 0; column < 256; column += 5)
    EXPECT_NEAR(std::remainder(s.range_m(column, 31), 0.005), 0, s.wanted->range_unit_m) << column;
}

TEST(RangeImage, BeamsWithTheSameScattererReportTheSameRange) {
  RangeImageSounding s(plane_ahead(5));
  s.wanted->chosen_as_heard = true;
  const auto equal = [&s] {  // share of ranges that are equal to that of the neighbour
    s.ping();
    double same = 0, n = 0;
    for (int row = 20; row < 44; ++row)
      for (int column = 112; column < 144; ++column)
        if (s.at(column, row).range != 0) same += s.at(column, row).range == s.at(column + 1, row).range, ++n;
    return same / n;
  };
  EXPECT_LT(equal(), 0.2);  // next beam, next centre of the echo
  s.wanted->range_of_loudest = true;
  EXPECT_GT(equal(), 0.35);
  double squares = 0, sum = 0, n = 0;
  for (int row = 20; row < 44; ++row)
    for (int column = 112; column < 144; ++column) {
      if (s.at(column, row).range == 0) continue;
      const double beyond_m = s.place(column, row).x - 5;
      sum += beyond_m, squares += beyond_m * beyond_m, ++n;
    }
  EXPECT_GT(n, 0.95 * 24 * 32);
  EXPECT_NEAR(sum / n, 0, 0.005);
  EXPECT_LT(std::sqrt(squares / n), 0.015);
}

TEST(RangeImage, BlocksOfRowsHaveSpeckleOfTheirOwn) {
  RangeImageSounding s(plane_ahead(5));
  s.wanted->chosen_as_heard = true;
  s.request().settings.gain_db = 40;
  s.wanted->least_strength = 1;
  const auto alike = [&s](std::initializer_list<int> of_rows) {  // correlation of strengths with those of the row above
    std::vector<double> below, above;
    for (const int row : of_rows)
      for (int column = 80; column < 176; column += 2) {  // the plane is about as bright everywhere there
        below.push_back(s.at(column, row).strength);
        above.push_back(s.at(column, row + 1).strength);
      }
    return correlation(below, above);
  };
  s.ping();
  EXPECT_GT(alike({15, 31, 47}), 0.5);
  s.wanted->block_rows = 16;
  s.ping();
  EXPECT_LT(alike({15, 31, 47}), 0.25);
  EXPECT_GT(alike({14, 30, 46}), 0.5);
  EXPECT_GT(alike({16, 32, 48}), 0.5);
}

TEST(RangeImage, SameBytesOnAnyNumberOfThreadsAndAnotherPingHasOtherNoise) {
  const auto scene = SceneMaker().add(wall(3, 3), -20, {5, 0, 0}).add(sphere(0.5, 4), -15, {3, 1, 0}).make();
  RangeImageSounding one(scene, 1), three(scene, 3);
  for (RangeImageSounding* s : {&one, &three}) {
    s->wanted->chosen_as_heard = s->wanted->range_of_loudest = true;
    s->wanted->block_rows = 16, s->wanted->least_confirming = 1, s->wanted->confirming_m = 0.1, s->wanted->median_passes = 2;
  }
  one.request().switches.noise = three.request().switches.noise = true;
  const Ping first = one.ping();
  EXPECT_EQ(first.samples, three.ping().samples);
  one.request().number = PingNumber{7};
  EXPECT_NE(first.samples, one.ping().samples);
}

TEST(RangeImage, NothingBeyondTheRangeThatIsSet) {
  RangeImageSounding s(plane_ahead(9));
  s.request().settings.range_m = 10;
  s.request().settings.range_bin_m = 10.0 / 64;
  s.ping();
  double farthest = 0;
  for (int row = 0; row < 64; ++row)
    for (int column = 0; column < 256; ++column) farthest = std::max(farthest, s.range_m(column, row));
  EXPECT_LE(farthest, 10);
  EXPECT_GT(farthest, 9.9);
}

TEST(RangeImage, AStrongerEchoOutsideTheRangesHidesNone) {
  RangeImageSounding s(SceneMaker().add_point({1, 0, 0}, -10).add_point({5, 0, 0}, -30).add_point({8.2, 0, 0}, -10).make());
  s.request().switches.noise = false;
  s.request().settings.range_start_m = 2;
  s.request().settings.range_m = 8;
  s.ping();
  EXPECT_NEAR(s.range_m(127, 31), 5.0, 0.02);
}

TEST(RangeImage, KeepsPressureAndTruthOnRequest) {
  RangeImageSounding s(plane_ahead(5));
  s.request().switches.expected_power = s.request().switches.keep_pressure = s.request().switches.keep_truth = true;
  const Ping& ping = s.ping();
  ASSERT_EQ(ping.pressure_upa.size(), 16384u);
  EXPECT_GT(ping.pressure_upa[32 * 256 + 128], ping.pressure_upa[32 * 256 + 250]);
  ASSERT_EQ(ping.truth.size(), 256u);
  EXPECT_NEAR(static_cast<double>(ping.truth[127].range_m), 5, 0.01);
  EXPECT_EQ(ping.truth[127].object, 0u);
  s.request().switches.keep_beams = true;
  EXPECT_THROW(s.ping(), std::invalid_argument);
}

TEST(RangeImage, UnusableSettingsAreRefused) {
  RangeImageSounding s(plane_ahead(5));
  s.wanted->range_unit_m = 1e-4;
  EXPECT_THROW(s.ping(), std::invalid_argument);
}

}  // namespace
}  // namespace sonar::test
