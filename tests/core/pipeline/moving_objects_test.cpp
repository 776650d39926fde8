// Objects that move, are hidden or float on the water, through the whole engine: their echoes and shadows.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/scene/files/load_scene.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"

namespace sonar::test {
namespace {

Mesh bed() {
  return height_field(-2, 30, -20, 20, 2, [](double, double) { return 0.0; });
}

/// Returns the mean power of the beams around `azimuth_deg` between two ranges.
double mean_power(const Sounding& s, double from_m, double to_m, double azimuth_deg = 0) {
  double sum = 0;
  int n = 0;
  const int middle = s.beam_at(rad_from_deg(azimuth_deg));
  for (int row = static_cast<int>(s.row_of_range(from_m)); row < s.row_of_range(to_m); ++row)
    for (int j = middle - 8; j <= middle + 8; ++j, ++n) sum += s.power(row, j);
  return sum / n;
}

std::vector<double> intensities(const Sounding& s) {
  std::vector<double> all;
  for (const float p : s.last().pressure_upa) all.push_back(static_cast<double>(p) * static_cast<double>(p));
  return all;
}

/// Returns the pose after a rotation about the vertical axis through the origin and a subsequent translation.
Pose carried(const Pose& by, const Pose& pose) {
  return {by.position_m + rotate(by.orientation, pose.position_m), by.orientation * pose.orientation};
}

TEST(Moving, SonarAndBodyCarriedTogetherSeeTheSame) {
  const Pose sonar{{0, 0, 0}, quat_from_rpy({0, 0.1, 0})}, body{{5, 0.7, -0.3}, quat_from_rpy({0.2, -0.1, 0.5})};
  SceneMaker maker;
  maker.add_body(box({0.5, 0.6, 0.4}), -15, body).add_body(sphere(0.4, 4), -15, {{7, -1.5, 0}, {}});
  Sounding s(maker.make(), p900(), default_rows(10, 394));
  const std::vector<Pose> bodies{body, {{7, -1.5, 0}, {}}};
  const auto ping_carried_by = [&](const Pose& by) {
    s.request.sonar_in_world = carried(by, sonar);
    s.request.bodies_in_world.clear();
    for (const Pose& b : bodies) s.request.bodies_in_world.push_back(carried(by, b));
    s.ping();
    return intensities(s);
  };
  const std::vector<double> here = ping_carried_by({});
  ASSERT_GT(*std::max_element(here.begin(), here.end()), 0);
  for (const Pose& by : {Pose{{1000.123, -2000.456, 0}, {}}, Pose{{3, 4, 0}, quat_from_rpy({0, 0, 2.1})}})
    EXPECT_GT(correlation(here, ping_carried_by(by)), 0.99) << by.position_m.x;
  // Control: if only the sonar moves, the picture is different.
  s.request.sonar_in_world.position_m = s.request.sonar_in_world.position_m + Vec3d{0, 0, 0.3};
  s.ping();
  EXPECT_LT(correlation(here, intensities(s)), 0.9);
}

TEST(Moving, ABodyFartherAwayEchoesFartherAndTakesItsShadowAlong) {
  SceneMaker maker;
  maker.add(bed(), -25).add_body(box({0.2, 0.5, 0.5}), -12, {{4, 0, 0.5}, {}});
  Sounding s(maker.make(), p900(), default_rows(10, 394));
  s.request.switches.expected_power = true;
  const auto look = [&](double x) {
    s.request.bodies_in_world = {{{x, 0, 0.5}, {}}};
    s.ping_from({0, 0, 1.5}, {0, 0.2, 0});
  };
  look(4);
  const auto row_of_face = [&] {  // the strongest row ahead, which belongs to the box's face, not to the bed before it
    return s.range_of_row(s.loudest_row(s.beam_at(0)));
  };
  const double near_face_m = row_of_face(), shadow_near = mean_power(s, 5.0, 6.2), open_near = mean_power(s, 5.0, 6.2, 20);
  EXPECT_LT(shadow_near, 0.02 * open_near);
  look(5);
  EXPECT_NEAR(row_of_face() - near_face_m, 1, 0.06);
  // Now 4.0 m is before the box. The bed that lay in shadow is as bright as the bed beside it.
  const double before = mean_power(s, 4.2, 4.6), beside = mean_power(s, 4.2, 4.6, 20);
  EXPECT_NEAR(10 * std::log10(before / beside), 0, 1.5);
  EXPECT_LT(mean_power(s, 6.2, 7.4), 0.02 * mean_power(s, 6.2, 7.4, 20));
  // If the box is far outside, the old shadow is also gone.
  look(25);
  EXPECT_NEAR(10 * std::log10(mean_power(s, 5.0, 6.2) / open_near), 0, 1);
}

/// Returns the objects of a scene file in front of a sonar at z = -2 that looks level along +x, 90 degrees wide.
Sounding sounding_of(const std::string& objects, double height_m = -2) {
  auto scene = parse_scene(objects, "test.yaml", {});
  EXPECT_TRUE(scene) << scene.error().text;
  Sounding s(*scene, p900(), default_rows(10, 394));
  s.request.switches.expected_power = true;
  s.ping_from({0, 0, height_m});
  return s;
}

TEST(Moving, AnInvisibleObjectHasNeitherEchoNorShadow) {
  const std::string front = "{name: front, type: box, material: rock, size_m: [0.2, 1, 1], pose: {xyz_m: [4, 0, -2]}";
  const std::string back = "  - {name: back, type: box, material: rock, size_m: [0.2, 1, 1], pose: {xyz_m: [6, 0, -2]}}\n";
  const Sounding both = sounding_of("objects:\n  - " + front + "}\n" + back);
  const Sounding hidden = sounding_of("objects:\n  - " + front + ", visible: false}\n" + back);
  const Sounding alone = sounding_of("objects:\n" + back);
  EXPECT_GT(mean_power(both, 3.8, 4.1), 0);
  EXPECT_LT(mean_power(both, 5.8, 6.1), 0.01 * mean_power(alone, 5.8, 6.1)) << "the back box is in the shadow of the front one";
  EXPECT_LT(mean_power(hidden, 3.8, 4.1), 1e-4 * mean_power(both, 3.8, 4.1));
  EXPECT_NEAR(mean_power(hidden, 5.8, 6.1) / mean_power(alone, 5.8, 6.1), 1, 0.1);
}

TEST(Moving, TheSeaSurfaceIsASheetAtZeroSeenFromBelow) {
  const auto with_surface = [](double lambert_db) {
    Sounding s = sounding_of("sea_surface: {size_m: [60, 60], lambert_db: " + std::to_string(lambert_db) + "}\nobjects: []\n");
    s.ping_from({0, 0, -1}, {0, -0.3, 0});  // nose up, one metre below
    return s;
  };
  const Sounding rough = with_surface(-20), rougher = with_surface(-10);
  EXPECT_EQ(mean_power(rough, 0.3, 0.9), 0) << "the surface overhead is the nearest object";
  const double level = mean_power(rough, 4, 6);
  EXPECT_GT(level, 0);
  EXPECT_NEAR(10 * std::log10(mean_power(rougher, 4, 6) / level), 10, 0.01);
  const Sounding none = sounding_of("objects: []\n", -1);
  EXPECT_EQ(mean_power(none, 4, 6), 0);
}

}  // namespace
}  // namespace sonar::test
