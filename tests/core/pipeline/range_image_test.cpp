// Compares range images with closed forms: positions of a plane, a sphere and a point, orientation, levels, sound speed,
// threads.
#include "core/sonar/range_image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/base/units.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "core/sonar/water.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

constexpr std::uint32_t full_scale = 400;

struct Wanted final : RangeImageSettings {
  bool equals(const VendorSettings&) const override { return true; }
};

/// 256 x 64 beams of 1.5 degrees over 90 x 40 degrees, up to 15 m.
class RangeImageSounding {
 public:
  explicit RangeImageSounding(std::shared_ptr<const Scene> scene, int threads = 2)
      : sounding_(std::move(scene), mode(), settings(), {.threads = threads, .engine = {}}), wanted(std::make_shared<Wanted>()) {
    wanted->beam_height_rad = rad_from_deg(1.5);
    wanted->range_unit_m = 50.0 / 65536;
    wanted->least_strength = 31;
    request().vendor_settings = wanted;
    request().switches.keep_pressure = false;
  }
  PingRequest& request() { return sounding_.request; }
  const Ping& ping() { return sounding_.ping(); }
  const Ping& last() const { return sounding_.last(); }
  RangeImageGrid grid() { return RangeImageGrid(request()); }
  RangePixel at(int column, int row) const { return range_pixel(last(), static_cast<std::size_t>(row * 256 + column)); }
  double range_m(int column, int row) const { return at(column, row).range * wanted->range_unit_m; }
  /// Forward, left, up [m].
  Vec3d place(int column, int row) {
    const double a = grid().azimuth_rad(column), e = grid().elevation_rad(row), r = range_m(column, row);
    return {r * std::cos(e) * std::cos(a), r * std::cos(e) * std::sin(a), r * std::sin(e)};
  }
  /// Mean column and row of the pixels with a return.
  std::pair<double, double> middle() {
    double columns = 0, rows = 0, n = 0;
    for (int row = 0; row < 64; ++row)
      for (int column = 0; column < 256; ++column)
        if (at(column, row).range != 0) columns += column, rows += row, ++n;
    return n > 0 ? std::pair(columns / n, rows / n) : std::pair(-1.0, -1.0);
  }

 private:
  static FrequencyMode mode() {
    FrequencyMode m;
    m.name = "range image";
    m.centre_hz = 1.2e6f;
    m.horizontal_aperture_rad = static_cast<float>(rad_from_deg(90));
    m.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(40));
    m.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(1.5));
    m.beam_spacing = BeamSpacing::uniform_in_angle;
    m.max_range_m = 15;
    m.source_level_db = 200;
    m.receiver.tvg_slope_db = 20;
    m.receiver.full_scale_upa = 1e9f;
    return m;
  }
  static PingSettings settings() {
    PingSettings s;
    s.beam_count = 256;
    s.range_bin_count = 64;
    s.range_m = 15;
    s.range_bin_m = 15.0 / 64;
    s.pulse_width_m = 0.02f;
    s.gain_db = 30;
    s.device_sound_speed_mps = 1500;
    s.format = {.bits = 32, .max_code = range_image_max_code(full_scale)};
    return s;
  }
  Sounding sounding_;

 public:
  std::shared_ptr<Wanted> wanted;
};

std::shared_ptr<const Scene> plane_ahead(double x_m) { return SceneMaker().add(wall(40, 40), -20, {x_m, 0, 0}).make(); }

/// Share of the pixels with a return that lie on the plane x = `x_m`, within 3 cm.
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

/// A pole straight ahead. `turn_rad` makes it upright, level or oblique.
struct Pole {
  double radius_m = 0, length_m = 0, turn_rad = 0, range_m = 0;
};
constexpr double pole_lambert_db = -8;

/// The power [uPa^2], by Lambert's law, that a beam receives from the pole when its axis points at the pole.
double power_of(const Pole& pole, const PingRequest& request) {
  constexpr int along = 200, around = 200;
  const double alpha_db = absorption_db_per_m(request.water, 0, 1.2e6);
  double sum = 0;
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < around; ++j) {
      const double t = ((i + 0.5) / along - 0.5) * pole.length_m, angle = ((j + 0.5) / around - 0.5) * std::numbers::pi;
      // `angle` is the angle of the surface normal, 0 where the surface faces the sonar. `t` is the position along the pole,
      // which is perpendicular to the direction of the sonar.
      const Vec3d place{pole.range_m - pole.radius_m * std::cos(angle), pole.radius_m * std::sin(angle), t};
      const double r = length(place), cosine = dot(Vec3d{std::cos(angle), -std::sin(angle), 0}, place) / r;
      if (cosine > 0) sum += cosine * cosine * std::pow(r, -4) * std::pow(10, -2 * alpha_db * r / 10);
    }
  const double area_m2 = std::numbers::pi * pole.radius_m * pole.length_m / (along * around);
  return std::pow(10, (200 + pole_lambert_db) / 10) * area_m2 * sum;
}

/// Compares the power that all beams receive from the pole with Lambert's law summed over its surface, for 64 positions of the
/// sonar within one cell of the beam grid.
TEST(RangeImage, HearsThinPolesWhereverTheyAre) {
  // The sum of the weights of the beams around a point. Each beam is at -3 dB at 0.75 degrees off its axis.
  const auto weights = [](double step_rad) {
    double sum = 0;
    for (int n = -20; n <= 20; ++n) {
      const double x = n * step_rad / rad_from_deg(1.5);
      if (std::abs(x) < 1.1) sum += std::exp2(-4 * x * x);
    }
    return sum;
  };
  for (const double range_m : {2.5, 4.5, 8.5, 12.5})  // centres of range cells
    for (const double diameter_m : {0.005, 0.02, 0.1})
      for (const double turn_rad : {0.0, std::numbers::pi / 2, 0.6}) {
        const Pole pole{diameter_m / 2, std::min(2.0, 0.4 * range_m), turn_rad, range_m};
        const Quatd turn{std::cos(turn_rad / 2), std::sin(turn_rad / 2), 0, 0};
        RangeImageSounding s(
            SceneMaker()
                .add(make_cylinder(pole.radius_m, pole.length_m, 48, Caps::none), pole_lambert_db, {range_m, 0, 0}, turn)
                .make());
        s.request().switches.expected_power = s.request().switches.keep_pressure = true;
        s.request().settings.pulse_width_m = 1;  // the whole pole in one cell
        s.wanted->least_strength = 0;
        const double expected =
            power_of(pole, s.request()) * weights(s.grid().column_step_rad()) * weights(s.grid().row_step_rad());
        double least_db = 1e9, most_db = -1e9, sum = 0;
        constexpr int places = 64;
        for (int n = 0; n < places; ++n) {
          const double part = (n + 0.5) / places;
          s.request().sonar_in_world.position_m = {0, range_m * part * s.grid().column_step_rad(),
                                                   range_m * part * s.grid().row_step_rad()};
          double heard = 0;
          for (const float p : s.ping().pressure_upa) heard += std::pow(static_cast<double>(p), 2);
          const double off_db = 10 * std::log10(heard / expected);
          least_db = std::min(least_db, off_db), most_db = std::max(most_db, off_db), sum += heard / expected;
        }
        SCOPED_TRACE(std::to_string(diameter_m) + " m thick at " + std::to_string(range_m) + " m, turned by " +
                     std::to_string(turn_rad));
        EXPECT_LT(most_db - least_db, 1);
        EXPECT_NEAR(10 * std::log10(sum / places), 0, 0.5);
      }
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

TEST(RangeImage, NearestOrStrongest) {
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

TEST(RangeImage, AnglesFollowTheBelievedSoundSpeedWhereAsked) {
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

/// A picture of noise: a quarter of the pixels report random ranges.
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

TEST(RangeImage, BeamsThatHearTheSameScattererReportItsRange) {
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

TEST(RangeImage, KeepsPressureAndTruthWhereAsked) {
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
