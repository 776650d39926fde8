#include "clients/scene_tools/write_scene.hpp"

#include <gmock/gmock.h>

#include "tests/clients/scene_tools/reading.hpp"

namespace sonar::scene_tools {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string written(const std::string& world, const WriteOptions& options = {}) {
  Reading r;
  auto read = r.read(sdf(world));
  EXPECT_TRUE(read) << read.error().text;
  for (PlacedShape& shape : read->shapes) shape.material = "sand";
  return scene_text(*read, r.findings.left_out(), options);
}

TEST(WriteScene, EachShapeBecomesAnObjectWithAShortName) {
  const std::string text = written(model("crate", std::string("<static>1</static><pose>1 2 -3 0 0 0.5</pose>") + link("link")) +
                                   model("arm", link("a") + link("b")));
  EXPECT_THAT(text, HasSubstr("  # crate (w.sdf:3)\n  - {name: crate, type: box, material: sand, size_m: [1, 2, 3], "
                              "pose: {xyz_m: [1, 2, -3], rpy_deg: [0, 0, 28.64789]}}\n"));
  EXPECT_THAT(text, HasSubstr("{name: arm/a, "));
  EXPECT_THAT(text, HasSubstr("{name: arm/b, "));
  EXPECT_THAT(text, HasSubstr("but fixed in this scene (--moving MODEL makes one move): arm\n"));
}

TEST(WriteScene, NamesAreUniqueAndShortEnough) {
  const std::string deep = model(std::string(70, 'x'), link("l"));
  const std::string text = written(model("m", link("l")) + model("m", link("l")) + deep + deep);
  EXPECT_THAT(text, HasSubstr("name: \"m 2\""));
  EXPECT_THAT(text, HasSubstr(std::string("name: \"...") + std::string(61, 'x') + "\""));
  EXPECT_THAT(text, HasSubstr(std::string("name: \"...") + std::string(59, 'x') + " 2\""));
}

TEST(WriteScene, MovingModelsCarryTheirParts) {
  const std::string at_rest =
      written(model("rov", std::string("<pose>1 0 -2 0 0 0</pose>") + link("hull") + link("arm", "<pose>1 0 0 0 0 0</pose>")),
              {.moving = {"rov"}, .offset_m = {0, 0, -5}, .command = "w.sdf"});
  EXPECT_THAT(at_rest,
              HasSubstr("{name: rov, type: box, material: sand, size_m: [1, 2, 3], moving: true, pose: {xyz_m: [1, 0, -7]}}"));
  EXPECT_THAT(
      at_rest,
      HasSubstr("{name: rov/arm, type: box, material: sand, size_m: [1, 2, 3], attached_to: rov, pose: {xyz_m: [1, 0, 0]}}"));
  const std::string carried = written(
      model("rov", std::string("<pose>1 0 -2 0 0 0</pose>") + link("hull", "<pose>0 0 1 0 0 0</pose>") + model("arm", link("l"))),
      {.moving = {"rov"}, .offset_m = {}, .command = ""});
  EXPECT_THAT(carried,
              HasSubstr("{name: rov, type: sphere, radius_m: 0.01, segments: 8, material: plastic, visible: false, moving: true, "
                        "pose: {xyz_m: [1, 0, -2]}}"));
  EXPECT_THAT(carried, HasSubstr("attached_to: rov, pose: {xyz_m: [0, 0, 1]}}"));
  EXPECT_THAT(
      carried,
      HasSubstr("name: rov/arm, type: box, material: sand, size_m: [1, 2, 3], attached_to: rov, pose: {xyz_m: [0, 0, 0]}}"));
  EXPECT_THAT(carried, Not(HasSubstr("standing still")));
}

TEST(WriteScene, WrittenAnglesGiveTheSameRotation) {
  for (const double pitch : {0.0, 0.3, -1.2, pi / 2, -pi / 2, pi / 2 - 1e-7})
    for (const double roll : {0.0, 2.0, -3.1})
      for (const double yaw : {0.0, 1.0, -2.5}) {
        const Quatd q = quat_from_rpy({roll, pitch, yaw});
        const Vec3d deg = rpy_deg_from(q);
        const Quatd back = quat_from_rpy({rad_from_deg(deg.x), rad_from_deg(deg.y), rad_from_deg(deg.z)});
        for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
          expect_near(rotate(back, axis), rotate(q, axis), 1e-5);
      }
}

TEST(WriteScene, AnEmptyWorldIsAnEmptyScene) { EXPECT_THAT(written(""), HasSubstr("objects: []\n")); }

}  // namespace
}  // namespace sonar::scene_tools
