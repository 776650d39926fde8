// Oracles 10 to 12 and related tests: specular echoes of primitives and of their meshes, near and far, through the whole
// engine.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/scene/shapes/primitives.hpp"
#include "tests/core/pipeline/specular_worlds.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

class BothWays : public testing::TestWithParam<bool> {
 protected:
  bool as_meshes() const { return GetParam(); }
  /// Returns the tolerance: `exact` for exact shapes, 1 dB for shapes that are recovered from facets.
  double within_db(double exact) const { return as_meshes() ? 1.0 : exact; }
  void record(int number, const std::string& what, double expected_db, double measured_db, double tolerance_db) const {
    record_oracle(number, what + (as_meshes() ? ", as a mesh" : ""), expected_db, measured_db, within_db(tolerance_db), "dB");
  }
};
INSTANTIATE_TEST_SUITE_P(Mirrors, BothWays, testing::Bool(),
                         [](const auto& way) { return way.param ? std::string("mesh") : std::string("primitive"); });

TEST_P(BothWays, Oracle10_SphereAtAnyRange) {
  for (const double a : {0.05, 0.25, 1.0})
    for (const double r : {0.7, 3.013, 11.0}) {
      Mirror sphere = specular_sphere(a);
      sphere.in_world.position_m = {r + a, 0, 0};
      SpecularSounding s(world_of({sphere}, as_meshes()), p900(), native_rows(12, 0.0254));
      record(10, "sphere, eq. 7", db(1 / (2 * r * (1 + r / a))), db(s.strength_per_m(r)), 0.1);
    }
  Mirror small = specular_sphere(0.05);
  small.in_world.position_m = {34.05, 0, 0};
  SpecularSounding s(world_of({small}, as_meshes()), p900(), native_rows(35, 0.0254));
  record(10, "sphere, far: TS = 20 log(a / 2)", db(0.05 / 2), db(s.strength_per_m(34)) + 40 * std::log10(34.0), 0.1);
}

/// Returns the echo of a cylinder's wall of radius `a`. Its axis is at distance `axis_m`, its length along z about `z0_m`.
double rod_echo(double wavelength_m, double a, double length_m, double axis_m, double z0_m = 0) {
  return kirchhoff_per_m(wavelength_m, 4000, std::max(400, static_cast<int>(length_m * 4000)), [&](double u, double v) {
    const double angle = (u - 0.5) * 0.5 * pi;  // the quarter that faces the sonar
    const Vec3d out{-std::cos(angle), std::sin(angle), 0};
    return Patch{Vec3d{axis_m, 0, z0_m + (v - 0.5) * length_m} + a * out, (0.5 * pi * a * length_m) * out};
  });
}

TEST_P(BothWays, Oracle11_CylinderBroadside) {
  {
    Mirror far = specular_cylinder(0.05, 0.1);
    far.in_world = standing(34.05);
    SpecularSounding s(world_of({far}, as_meshes()), p900(), native_rows(35, 0.0254));
    const double sigma = 0.05 * 0.1 * 0.1 / (2 * s.wavelength_m());
    record(11, "cylinder, far: a L^2 / (2 lambda)", 10 * std::log10(sigma), db(s.strength_per_m(34)) + 40 * std::log10(34.0),
           0.5);
  }
  for (const double length_m : {0.1778, 0.6})
    for (const double r : {0.5, 2.0}) {
      Mirror near = specular_cylinder(0.0508, length_m);
      near.in_world = standing(r + 0.0508);
      SpecularSounding s(world_of({near}, as_meshes()), p900(), native_rows(12, 0.0254));
      record(11, "cylinder, near: Kirchhoff's integral", db(rod_echo(s.wavelength_m(), 0.0508, length_m, r + 0.0508)),
             db(s.strength_per_m(r)), 0.5);
    }
  Mirror rod = specular_cylinder(0.0508, 4);
  rod.in_world = standing(0.5508);
  SpecularSounding s(world_of({rod}, as_meshes()), oculus_high(), native_rows(2, 0.0054));
  record(11, "rod of the paper's tank at 0.5 m, long", -10.35, db(s.strength_per_m(0.5)), 0.5);
}

double plate_echo(double wavelength_m, double ly, double lz, double x, double y0 = 0, double tilt_rad = 0) {
  return kirchhoff_per_m(wavelength_m, 1500, 1500, [&](double u, double v) {
    const Vec3d across{std::sin(tilt_rad), std::cos(tilt_rad), 0};
    const Vec3d normal{-std::cos(tilt_rad), std::sin(tilt_rad), 0};
    return Patch{Vec3d{x, y0, (v - 0.5) * lz} + (u - 0.5) * ly * across, ly * lz * normal};
  });
}

TEST_P(BothWays, Oracle12_PlateFacingUs) {
  {
    Mirror far = specular_plane(0.1, 0.08);
    far.in_world = facing(34);
    SpecularSounding s(world_of({far}, as_meshes()), p900(), native_rows(35, 0.0254));
    record(12, "plate, far: (area / lambda)^2", db(0.1 * 0.08 / s.wavelength_m()),
           db(s.strength_per_m(34)) + 40 * std::log10(34.0), 0.5);
  }
  for (const double r : {0.8, 1.7, 4.0, 9.0}) {
    Mirror near = specular_plane(0.3, 0.5);  // along z and along y after the rotation
    near.in_world = facing(r);
    SpecularSounding s(world_of({near}, as_meshes()), p900(), native_rows(12, 0.0254));
    record(12, "plate, near: Kirchhoff's integral", db(plate_echo(s.wavelength_m(), 0.5, 0.3, r)), db(s.strength_per_m(r)), 0.5);
  }
}

TEST_P(BothWays, Oracle12_WallFarFromItsEdges) {
  Mirror wall = specular_plane(12, 14);
  wall.in_world = facing(3);
  SpecularSounding s(world_of({wall}, as_meshes()), p900(), native_rows(12, 0.0254));
  record(12, "wall: 1 / (2 r)", db(1 / 6.0), db(s.strength_per_m(3)), 0.3);
}

TEST_P(BothWays, AnEdgeEchoesWhenTheFootPointIsBesideThePlate) {
  // If the plate is turned a little, the foot of the perpendicular lies outside it, and the main lobe continues beyond its
  // edge.
  for (const double tilt : {0.0, 0.004, 0.008, 0.02}) {
    Mirror plate = specular_plane(0.3, 0.1);
    plate.in_world = facing(9, tilt);
    SpecularSounding s(world_of({plate}, as_meshes()), p900(), native_rows(12, 0.0254));
    const double expected = plate_echo(s.wavelength_m(), 0.1, 0.3, 9, 0, -tilt);
    EXPECT_NEAR(db(s.strength_per_m(9)), db(expected), 1.5) << tilt;
  }
}

TEST_P(BothWays, BoxShowsItsFaceLikeAPlate) {
  Mirror box = specular_box({0.4, 0.5, 0.3});
  box.in_world = {{2.2, 0, 0}, {}};
  SpecularSounding s(world_of({box}, as_meshes()), p900(), native_rows(12, 0.0254));
  EXPECT_NEAR(db(s.strength_per_m(2)), db(plate_echo(s.wavelength_m(), 0.5, 0.3, 2)), 0.5);
}

TEST_P(BothWays, TiltedPolishedRodLosesTensOfDecibels) {
  const auto level = [&](double tilt) {
    Mirror rod = specular_cylinder(0.0508, 0.1778);
    rod.in_world = standing(0.5508, tilt);
    SpecularSounding s(world_of({rod}, as_meshes()), oculus_low(), native_rows(2, 0.0054));
    return db(s.strength_per_m(0.5, 0.1));
  };
  const double upright = level(0);
  EXPECT_NEAR(upright, -10.35, 1.5);  // edge ripple
  EXPECT_LT(level(rad_from_deg(15)), upright - 20);
}

TEST_P(BothWays, TheCapOfACylinderEchoesLikeAPlate) {
  Mirror drum = specular_cylinder(0.09, 0.8);
  drum.in_world = facing(2.4);
  SpecularSounding s(world_of({drum}, as_meshes()), p900(), native_rows(12, 0.0254));
  // On the axis of a disc: |1 - exp(-i 2 k (edge - middle))| / (2 r), except for the range of the edge itself.
  const double edge = std::hypot(2.0, 0.09);
  const double expected = std::abs(1.0 - std::polar(1.0, -4 * pi / s.wavelength_m() * (edge - 2))) / 4;
  EXPECT_NEAR(db(s.strength_per_m(2)), db(expected), 1);
}

TEST_P(BothWays, AMirrorBehindABoxIsSilent) {
  Mirror sphere = specular_sphere(0.25);
  sphere.in_world.position_m = {4.25, 0, 0};
  Mirror box = specular_box({0.2, 1, 1});
  box.in_world = {{2, 0, 0}, quat_from_rpy({0, 0.5, 0.5})};
  SpecularSounding open(world_of({sphere}, as_meshes()), p900(), native_rows(12, 0.0254));
  SpecularSounding hidden(world_of({sphere, box}, as_meshes()), p900(), native_rows(12, 0.0254));
  EXPECT_GT(open.strength_per_m(4), 0);
  EXPECT_LT(db(hidden.strength_per_m(4)), db(open.strength_per_m(4)) - 60);
}

TEST_P(BothWays, HalfHiddenIsHalfAsStrong) {
  // A screen whose edge crosses the line of sight. Half of every Fresnel zone is left, which is 6 dB less.
  Mirror wall = specular_plane(8, 8);
  wall.in_world = facing(4);
  Mirror screen = specular_box({0.02, 2, 2});
  screen.in_world = {{2, 1, 0}, quat_from_rpy({0, 0, 0})};
  screen.material.reflection = 0;
  SpecularSounding s(world_of({wall, screen}, as_meshes()), p900(), native_rows(12, 0.0254));
  EXPECT_NEAR(db(s.strength_per_m(4)), db(1 / 8.0) - 6.02, 1);
}

TEST(SpecularOracles, RoughnessTakesTheMirrorAway) {
  // Section 2.1.1 of the model: 0.6 dB at 0.05 mm, 2.5 dB at 0.1 mm, 9.9 dB at 0.2 mm, at 900 kHz and 1500 m/s.
  const auto level = [](double roughness_m) {
    Mirror sphere = specular_sphere(0.5);
    sphere.material.lambert_db = -80;
    sphere.material.roughness_m = static_cast<float>(roughness_m);
    sphere.in_world.position_m = {2.5, 0, 0};
    SpecularSounding s(world_of({sphere}), p900(), native_rows(12, 0.0254));
    return db(s.strength_per_m(2));
  };
  const double smooth = level(0);
  EXPECT_NEAR(smooth - level(5e-5), 0.62, 0.05);
  EXPECT_NEAR(smooth - level(1e-4), 2.47, 0.05);
  EXPECT_NEAR(smooth - level(2e-4), 9.87, 0.1);
  EXPECT_LT(level(5e-4), smooth - 50);
}

TEST(SpecularOracles, ReflectionScalesTheEcho) {
  Mirror weak = specular_sphere(0.5);
  weak.material.reflection = -0.1f;
  weak.in_world.position_m = {2.5, 0, 0};
  SpecularSounding s(world_of({weak}), p900(), native_rows(12, 0.0254));
  EXPECT_NEAR(db(s.strength_per_m(2)), db(0.1 / (4 * 5.0)), 0.1);
}

TEST_P(BothWays, WithoutTheSwitchThereIsNoEcho) {
  Mirror sphere = specular_sphere(0.5);
  sphere.in_world.position_m = {2.5, 0, 0};
  SpecularSounding s(world_of({sphere}, as_meshes()), p900(), native_rows(12, 0.0254));
  EXPECT_GT(s.strength_per_m(2), 0);
  s.sounding().request.switches.specular = false;
  s.sounding().request.switches.expected_power = true;
  s.turn(0);
  const double lambert = s.strength_per_m(2);
  EXPECT_GT(lambert, 0);  // the whole surface scatters
  EXPECT_LT(db(lambert), db(1 / 20.0) - 6);
}

TEST_P(BothWays, ExpectedPowerHoldsTheSameEcho) {
  Mirror sphere = specular_sphere(0.5);
  sphere.in_world.position_m = {2.5, 0, 0};
  SpecularSounding s(world_of({sphere}, as_meshes()), p900(), native_rows(12, 0.0254));
  const double level = s.strength_per_m(2);
  s.sounding().request.switches.expected_power = true;
  s.turn(0);
  EXPECT_NEAR(db(s.strength_per_m(2)), db(level), 0.01);
  s.sounding().request.switches.conical = false;
  s.turn(0);
  EXPECT_NEAR(db(s.strength_per_m(2)), db(level), 0.01);
  s.sounding().request.switches.fixed_fan = 100;
  s.turn(0);
  EXPECT_NEAR(db(s.strength_per_m(2)), db(level), 0.01);
}

TEST_P(BothWays, ATankEchoesFromInside) {
  // The round wall, seen from a point beside its axis. In front 1 - r / a is negative, because the echo has passed a line of
  // focus.
  const double a = 1.1684, height = 1.2;
  Mirror tank = specular_cylinder(a, height);
  tank.primitive.inside = true;
  for (const double off : {0.4, 0.2, 0.02, 0.0}) {
    tank.in_world.position_m = {off, 0, 0};
    SpecularSounding s(world_of({tank}, as_meshes()), oculus_high(), native_rows(2, 0.0054));
    const double r = a + off;
    const double expected = 1 / (2 * r * std::sqrt(std::max(r / a - 1, 0.05)));
    const double measured = s.strength_per_m(r);
    if (off > 0.1) {
      EXPECT_NEAR(db(measured), db(expected), 1) << off;
    }
    EXPECT_GT(measured, 0) << off;
    EXPECT_LT(db(measured), db(1 / (2 * r * std::sqrt(0.05))) + 6) << off;
  }
}

TEST_P(BothWays, MovesWithItsBody) {
  Mirror sphere = specular_sphere(0.5);
  auto scene = std::make_shared<Scene>(*world_of({sphere}, as_meshes()));
  scene->objects[0].body = 0;
  scene->body_names = {"ball"};
  scene->bodies_in_world = {Pose{}};
  SpecularSounding s(scene, p900(), native_rows(12, 0.0254));
  for (const double r : {2.0, 5.0}) {
    s.sounding().request.bodies_in_world = {Pose{{r + 0.5, 0, 0}, quat_from_rpy({0.3, 0.2, 1})}};
    s.turn(0);
    EXPECT_NEAR(db(s.strength_per_m(r)), db(1 / (2 * r * (1 + r / 0.5))), within_db(0.1)) << r;
  }
}

TEST(SpecularOracles, AMeshOfASphereEchoesOnEverySide) {
  for (int i = 0; i < 10; ++i) {
    Mirror sphere = specular_sphere(0.25);
    sphere.in_world = {{3.25, 0, 0}, quat_from_rpy({0.61 * i, 0.37 * i, 1.13 * i})};
    SpecularSounding s(world_of({sphere}, true), p900(), native_rows(12, 0.0254));
    EXPECT_NEAR(db(s.strength_per_m(3)), db(1 / (6 * (1 + 3 / 0.25))), 0.5) << i;
  }
}

TEST(SpecularOracles, FacetsOfCapsuleAndTorusHaveTheirEcho) {
  // Shapes for which the engine has no closed form: radii a (half sphere, end-on), and a with R + a (torus, seen in its plane).
  Mirror capsule{.mesh = make_capsule(0.3, 0.8, segments_for(0.3))};
  capsule.in_world = facing(2.7);
  SpecularSounding end_on(world_of({capsule}), p900(), native_rows(12, 0.0254));
  EXPECT_NEAR(db(end_on.strength_per_m(2)), db(1 / (4 * (1 + 2 / 0.3))), 1);
  Mirror torus{.mesh = make_torus(0.5, 0.1, 128)};
  torus.in_world = {{2.6, 0, 0}, {}};
  SpecularSounding ring(world_of({torus}), p900(), native_rows(12, 0.0254));
  EXPECT_NEAR(db(ring.strength_per_m(2)), db(1 / (4 * std::sqrt((1 + 2 / 0.1) * (1 + 2 / 0.6)))), 1);
}

}  // namespace
}  // namespace sonar::test
