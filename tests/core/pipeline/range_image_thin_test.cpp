// Poles, and other objects that lie between the rays of a range image.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "core/base/units.hpp"
#include "core/scene/shapes/primitives.hpp"
#include "core/sonar/water.hpp"
#include "tests/core/pipeline/range_image_sounding.hpp"

namespace sonar::test {
namespace {

/// A pole straight ahead. `turn_rad` makes it upright, level or oblique.
struct Pole {
  double radius_m = 0, length_m = 0, turn_rad = 0, range_m = 0;
};
constexpr double pole_lambert_db = -8;

/// Returns the power [uPa^2], by Lambert's law, that a beam receives from the pole when its axis points at the pole.
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
TEST(ThinRangeImage, ReportsThinPolesAtAnyPlace) {
  // The sum of the weights of the beams around a point. Each beam is at -3 dB at 0.75 degrees off its axis.
  const auto weights = [](double step_rad) {
    double sum = 0;
    for (int n = -20; n <= 20; ++n) {
      const double x = n * step_rad / rad_from_deg(1.5);
      if (std::abs(x) < 1.1) sum += std::exp2(-4 * x * x);
    }
    return sum;
  };
  for (const double range_m : {2.0, 4.0, 8.0, 12.0})
    for (const double diameter_m : {0.005, 0.02, 0.1})
      for (const double turn_rad : {0.0, std::numbers::pi / 2, 0.6}) {
        const Pole pole{diameter_m / 2, std::min(2.0, 0.4 * range_m), turn_rad, range_m};
        const Quatd turn{std::cos(turn_rad / 2), std::sin(turn_rad / 2), 0, 0};
        RangeImageSounding s(
            SceneMaker()
                .add(make_cylinder(pole.radius_m, pole.length_m, 48, Caps::none), pole_lambert_db, {range_m, 0, 0}, turn)
                .make());
        s.request().switches.expected_power = s.request().switches.keep_pressure = true;
        s.request().settings.pulse_width_m = static_cast<float>(range_m / 2.5);  // the whole pole in the third range cell
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

/// Returns the mean power of the picture of a pole of 2 cm at 4.5 m, and of the other objects that `add` adds.
double power_with_pole(const std::function<void(SceneMaker&)>& add, Bearings bearings = Bearings::are_true) {
  SceneMaker scene;
  add(scene);
  RangeImageSounding s(
      scene.add(make_cylinder(0.01, 1.8, 48, Caps::none), pole_lambert_db, {4.5, 0, 0}, {std::cos(0.3), std::sin(0.3), 0, 0})
          .make());
  s.request().switches.expected_power = s.request().switches.keep_pressure = true;
  s.request().settings.pulse_width_m = 1;
  s.request().water.sound_speed_mps = 1412;
  s.request().bearings = bearings;
  s.wanted->least_strength = 0;
  double sum = 0;
  for (int n = 0; n < 8; ++n) {
    s.request().sonar_in_world.position_m.y = 4.5 * n / 8 * s.grid().column_step_rad();
    for (const float p : s.ping().pressure_upa) sum += std::pow(static_cast<double>(p), 2);
  }
  return sum / 8;
}
const Mesh speck = make_cylinder(0.0005, 0.001, 4, Caps::both);

TEST(ThinRangeImage, ManySpecksTakeNoRaysFromAPole) {
  const double alone = power_with_pole([](SceneMaker&) {});
  const double among = power_with_pole([](SceneMaker& scene) {
    for (int i = 0; i < 400; ++i) scene.add(speck, -90, {7, -2.0 + 0.2 * (i % 20) + 0.1, -1.0 + 0.1 * (i / 20) + 0.05});
  });
  EXPECT_NEAR(10 * std::log10(among / alone), 0, 0.05);
}

TEST(ThinRangeImage, AnObjectBehindTheSonarIsNotInView) {
  const auto alone = power_with_pole([](SceneMaker&) {}, Bearings::follow_device_speed);
  const auto also = power_with_pole(
      [](SceneMaker& scene) {
        scene.add(make_cylinder(0.01, 1.8, 48, Caps::none), 0, {-4.5, 0.3, 0});
      },
      Bearings::follow_device_speed);
  EXPECT_EQ(alone, also);
}

}  // namespace
}  // namespace sonar::test
