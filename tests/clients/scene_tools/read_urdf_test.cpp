#include <gmock/gmock.h>

#include "tests/clients/scene_tools/reading.hpp"

namespace sonar::scene_tools {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string robot(const std::string& content) { return std::string("<robot name='arm'>\n") + content + "</robot>"; }
std::string part(const std::string& link, const std::string& origin = "", const std::string& geometry = "<box size='1 2 3'/>") {
  return std::string("<link name='") + link + "'><visual>" + origin + "<geometry>" + geometry +
         "</geometry><material name='steel'/></visual></link>\n";
}
std::string joint(const std::string& name, const std::string& parent, const std::string& child, const std::string& origin = "",
                  const std::string& type = "fixed") {
  return std::string("<joint name='") + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + child +
         "'/>" + origin + "</joint>\n";
}

TEST(ReadUrdf, LinksArePlacedByTheirJointsAtZero) {
  Reading r;
  const auto world =
      r.read(robot(joint("b", "upper", "hand", "<origin xyz='1 0 0'/>", "continuous") + part("base") +
                   part("hand", "<origin xyz='0 0 0.5'/>") + part("upper", "", "<cylinder radius='0.1' length='2'/>") +
                   joint("a", "base", "upper", "<origin xyz='0 0 1' rpy='0 0 1.5707963267948966'/>")));
  ASSERT_TRUE(world) << world.error().text;
  EXPECT_EQ(world->format, "URDF");
  EXPECT_EQ(world->models.at(0).path, "arm");
  ASSERT_EQ(world->shapes.size(), 3u);
  expect_near(world->shapes[0].in_world.position_m, {0, 0, 0});
  expect_near(world->shapes[1].in_world.position_m, {0, 1, 1.5});  // in the file's order: base, hand, upper
  EXPECT_EQ(world->shapes[2].shape.kind, Shape::Kind::cylinder);
  EXPECT_EQ(world->shapes[2].shape.length_m, 2);
  EXPECT_EQ(world->shapes[0].material, "steel");
  EXPECT_THAT(r.findings.left_out(), ElementsAre(HasSubstr("joint \"b\" (continuous): stays at zero")));
}

TEST(ReadUrdf, MeshesAreReadAndOtherElementsReported) {
  Reading r;
  const auto world = r.read(robot(part("base", "", "<mesh filename='package://arm/meshes/a.stl' scale='0.001 0.001 0.001'/>") +
                                  "<gazebo reference='base'/><transmission name='t'/><material name='steel'/>"));
  ASSERT_TRUE(world) << world.error().text;
  EXPECT_EQ(world->shapes.at(0).shape.uri, "package://arm/meshes/a.stl");
  EXPECT_EQ(world->shapes[0].shape.scale.x, 0.001);
  EXPECT_THAT(r.findings.left_out(), ElementsAre("w.sdf:3: gazebo", "w.sdf:3: transmission \"t\""));
}

TEST(ReadUrdf, MistakesAreReportedWithFileAndLine) {
  Reading r;
  EXPECT_THAT(r.error(robot(part("a") + joint("j", "a", "b"))), ::testing::StartsWith("w.sdf:3: joint \"j\": no link \"b\""));
  EXPECT_THAT(r.error(robot(part("a") + part("b") + joint("j", "a", "b") + joint("k", "b", "a"))), HasSubstr("form a circle"));
  EXPECT_THAT(r.error(robot(part("a") + part("b") + joint("j", "a", "b") + joint("k", "a", "b"))),
              HasSubstr("is the child of two joints"));
  EXPECT_THAT(r.error(robot(part("a") + part("b") + part("c") + joint("j", "a", "b"))),
              ::testing::StartsWith("w.sdf:1: links \"a\" and \"c\" are the children of no joint, but a robot has one root"));
  EXPECT_THAT(r.error(robot(part("a") + part("a"))), HasSubstr("used twice"));
  EXPECT_THAT(r.error(robot(part("a", "", "<sphere/>"))), HasSubstr("sphere radius: 1 number is needed here, not 0"));
  EXPECT_THAT(r.error(robot(part("a", "<origin xyz='1 2'/>"))), HasSubstr("origin xyz: 3 numbers are needed here, not 2"));
  EXPECT_THAT(r.error("<robot name='x' xmlns:xacro='u'>\n<xacro:arm/></robot>"), HasSubstr("w.sdf:2: this is xacro"));
  EXPECT_THAT(r.error(robot(part("a", "<xacro:shape/>"))), HasSubstr("this is xacro"));
  EXPECT_THAT(r.error(robot(part("a", "<origin xyz='${x} 0 0'/>"))), HasSubstr("is it xacro? Expand it first: xacro"));
  EXPECT_THAT(r.error(robot("<joint name='j' type='fixed'><parent/></joint>")), HasSubstr("needs <parent"));
}

}  // namespace
}  // namespace sonar::scene_tools
