#include "clients/scene_tools/import_scene.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "core/scene/files/load_scene.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::scene_tools {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr const char* harbour = R"(
materials:
  silt: {like: mud, lambert_db: -30}
  base: {lambert_db: -20}
  made: {like: base, law: gsab}
  spare: {lambert_db: -20}
objects:
  - {name: bed, type: plane, material: silt, size_m: [20, 20], pose: {xyz_m: [0, 0, -6]}}
  - {name: pile, type: box, material: made, size_m: [1, 2, 4], instances: [{xyz_m: [5, 0, -3]}, {xyz_m: [6, 0, -3], rpy_deg: [0, 0, 90]}]}
  - {name: diver, type: sphere, material: rubber, radius_m: 0.5, moving: true, pose: {xyz_m: [1, 2, -3]}}
  - {name: lamp, type: point, target_strength_db: -30, attached_to: diver, pose: {xyz_m: [0, 0, -1]}}
  - {name: ghost, type: sphere, material: rubber, radius_m: 0.5, visible: false, pose: {xyz_m: [1, 2, -3]}}
sea_surface: {size_m: [20, 20]}
)";

struct Files : ::testing::Test {
  sonar::tests::TemporaryFiles files;
  Result<SceneDescription> describe(std::string_view text) { return describe_scene(files.write("s.yaml", text)); }
  Remarks remarks(std::string_view text) {
    const auto scene = describe(text);
    if (!scene) ADD_FAILURE() << scene.error().text;
    return scene ? remarks_on(*scene) : Remarks{};
  }
};

using DescribeScene = Files;

TEST_F(DescribeScene, ListsObjectsAndMaterials) {
  const auto scene = describe(harbour);
  ASSERT_TRUE(scene) << scene.error().text;
  ASSERT_EQ(scene->objects.size(), 7u);
  const DescribedObject& turned = scene->objects[2];
  EXPECT_EQ(turned.name, "pile[1]");
  EXPECT_EQ(turned.kind, "box");
  EXPECT_THAT(turned.materials, ElementsAre("made"));
  EXPECT_NEAR(turned.own.size_m().y, 2, 1e-6);
  EXPECT_NEAR(turned.in_world.size_m().x, 2, 1e-6);
  EXPECT_NEAR(turned.in_world.centre_m().x, 6, 1e-6);
  EXPECT_EQ(scene->objects[3].moves_with, "diver");
  EXPECT_EQ(scene->objects[5].kind, "sea surface");
  const DescribedObject& lamp = scene->objects[6];
  EXPECT_EQ(lamp.kind, "point");
  EXPECT_EQ(lamp.in_world.centre_m().z, -4);
  EXPECT_EQ(lamp.moves_with, "diver");
  EXPECT_EQ(scene->materials.at(1).name, "made");
  EXPECT_EQ(scene->materials[1].objects, 2u);
  EXPECT_NEAR(scene->materials[1].strength_db, -7.89, 0.01);  // -8 and -24 dB together
  EXPECT_THAT(scene->unused_materials, ElementsAre("spare"));
  const std::string table = table_of(*scene);
  EXPECT_THAT(table, HasSubstr("pile[0]"));
  EXPECT_THAT(table, HasSubstr("20 x 20 x 0"));
  EXPECT_THAT(table, HasSubstr("with diver"));
  const auto json = nlohmann::json::parse(json_of(*scene));
  EXPECT_EQ(json["objects"].size(), 7u);
  EXPECT_EQ(json["objects"][3]["moves_with"], "diver");
  EXPECT_EQ(json["triangles"], scene->triangles);
  EXPECT_TRUE(json["volume_db"].is_null());
}

TEST_F(DescribeScene, AGoodSceneHasFewRemarks) {
  const Remarks r = remarks(harbour);
  EXPECT_THAT(r.warnings, ElementsAre("materials that nothing uses: spare"));
  EXPECT_THAT(r.notes, ElementsAre("not visible: ghost", "moved by poses that name them: diver"));
}

TEST_F(DescribeScene, WarnsOfWhatLooksWrong) {
  files.write(
      "big.stl",
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 300 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
  const Remarks r = remarks(
      "objects:\n  - {name: cm, type: mesh, file: big.stl, material: steel}\n"
      "  - {name: mm, type: mesh, file: big.stl, material: steel, scale: 1e-05}\n"
      "  - {name: gull, type: sphere, material: air, radius_m: 1, pose: {xyz_m: [0, 0, 3]}}\n"
      "  - {name: far, type: sphere, material: air, radius_m: 1, pose: {xyz_m: [3000, 0, -3]}}\n");
  EXPECT_THAT(r.warnings,
              UnorderedElementsAre(HasSubstr("cm: big.stl is 300 m long; if the file is in centimetres"),
                                   HasSubstr("mm: big.stl is 3 mm long"), HasSubstr("more than 1 km from the origin"),
                                   HasSubstr("wholly above z = 0, the water's surface: gull"), HasSubstr("no seabed")));
  EXPECT_THAT(remarks("objects: []").warnings, ElementsAre(HasSubstr("the scene is empty")));
  // A mesh of the ground may be long.
  files.write("bed.obj", "v 0 0 -9\nv 300 0 -9\nv 300 250 -8\nf 1 2 3\n");
  EXPECT_THAT(remarks("objects: [{name: bed, type: mesh, file: bed.obj, material: sand}]").warnings, IsEmpty());
  EXPECT_THAT(remarks("objects: [{name: bed, type: mesh, file: bed.obj, material: sand, scale: 100}]").warnings,
              ElementsAre(HasSubstr("bed: bed.obj is 30000 m long")));
}

TEST_F(DescribeScene, WarnsOfGroundThatIsTinyOrUpsideDown) {
  // A grid of one arc second. The loader reads its header as metres and its depths as heights.
  files.write("g.asc", "ncols 2\nnrows 2\nxllcorner 5\nyllcorner 60\ncellsize 0.000277777778\n20 21 22 23\n");
  const Remarks tiny =
      remarks("objects: [{name: bed, type: heightmap, file: g.asc, material: sand, geographic: false, centred: true}]\n");
  EXPECT_THAT(tiny.warnings,
              ElementsAre(HasSubstr("bed: g.asc is 0.0003 x 0.0003 x 3 m; are its coordinates degrees"),
                          HasSubstr("wholly above z = 0, the water's surface: bed; if g.asc has depths, set z_scale: -1")));
  const Remarks right = remarks("objects: [{name: bed, type: heightmap, file: g.asc, material: sand, z_scale: -1}]\n");
  EXPECT_THAT(right.warnings, IsEmpty());
  EXPECT_THAT(right.notes,
              ElementsAre(HasSubstr("g.asc: its coordinates (5.00014, 60.0001, cells of 0.000277778) are read as degrees"),
                          HasSubstr("g.asc: x and y are relative to its middle, latitude 60.000278, longitude 5.000278")));
  files.write("km.asc", "ncols 2\nnrows 2\ncellsize 0.5\n-20 -40 -22 -23\n");
  EXPECT_THAT(remarks("objects: [{name: bed, type: heightmap, file: km.asc, material: sand, geographic: false}]\n").warnings,
              ElementsAre(HasSubstr("degrees (geographic: true), or kilometres?")));
  files.write("utm.asc", "ncols 2\nnrows 2\nxllcorner 5e5\nyllcorner 6.6e6\ncellsize 10\n-20 -40 -22 -23\n");
  EXPECT_THAT(remarks("objects: [{name: bed, type: heightmap, file: utm.asc, material: sand}]\n").warnings,
              ElementsAre(HasSubstr(
                  "every product: bed; centred: true brings the middle of utm.asc to its pose, and origin: {lat, lon}")));
  for (const char* height_m : {"-3000", "-10900", "-15000"}) {
    const std::string deep = height_m;
    files.write("deep.asc", "ncols 2\nnrows 2\ncellsize 100\n" + deep + " " + deep + " " + deep + " " + deep + "\n");
    const auto warnings = remarks("objects: [{name: bed, type: heightmap, file: deep.asc, material: sand}]\n").warnings;
    if (deep == "-15000")
      EXPECT_THAT(warnings, ElementsAre(HasSubstr("more than 1 km from the origin"))) << "deeper than any sea";
    else
      EXPECT_THAT(warnings, IsEmpty()) << deep;
  }
}

TEST_F(DescribeScene, WarnsOfGroundAndOfObjectsAtTheSurface) {
  const std::string below = "objects: [{name: bed, type: plane, size_m: [40, 40], material: sand, pose: {xyz_m: [0, 0, -4]}}, ";
  EXPECT_THAT(remarks(below + "{name: mast, type: box, size_m: [1, 1, 2], material: wood, pose: {xyz_m: [0, 0, 1]}}]\n").warnings,
              ElementsAre("wholly above z = 0, the water's surface: mast"));
  EXPECT_THAT(
      remarks(below + "{name: mast, type: box, size_m: [1, 1, 2], material: wood, pose: {xyz_m: [0, 0, 0.9]}}]\n").warnings,
      IsEmpty());
  const auto surface = ElementsAre(HasSubstr("ground at z = 0, the water's surface, with no water above it: bed; move it down"));
  files.write("flat.asc", "ncols 2\nnrows 2\ncellsize 30\n0 0 0 0\n");
  const std::string grid = "objects: [{name: bed, type: heightmap, file: flat.asc, material: sand, pose: {xyz_m: [0, 0, ";
  EXPECT_THAT(remarks(grid + "0]}}]\n").warnings, surface);
  EXPECT_THAT(remarks(grid + "-0.5]}}]\n").warnings, IsEmpty());
  files.write("hill.asc", "ncols 2\nnrows 2\ncellsize 30\n0 5 0 0\n");
  EXPECT_THAT(remarks("objects: [{name: bed, type: heightmap, file: hill.asc, material: sand}]\n").warnings, surface);
  EXPECT_THAT(remarks("objects: [{name: bed, type: plane, size_m: [40, 40], material: sand}]\n").warnings, surface);
  EXPECT_THAT(
      remarks("sea_surface: {}\nobjects: [{name: bed, type: plane, size_m: [40, 40], material: sand, pose: {xyz_m: [0, 0, "
              "-4]}}]\n")
          .warnings,
      IsEmpty());
}

TEST_F(DescribeScene, HasTheErrorsOfTheLoader) {
  const auto wrong = files.write("s.yaml", "objects: [{type: bix}]");
  EXPECT_EQ(describe_scene(wrong).error().text, load_scene(wrong).error().text);
  EXPECT_EQ(describe_scene(wrong).error().kind, ErrorKind::bad_data);
  EXPECT_EQ(describe_scene(files.path("none.yaml")).error().kind, ErrorKind::missing_file);
}

TEST_F(DescribeScene, RecognisesAConfiguration) {
  const auto config = files.write("sonard.yaml", "world: {scene: s.yaml}\nvehicles: [{name: rov}]\nsonars: []\n");
  const auto scene = describe_scene(config);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().kind, ErrorKind::bad_data);
  EXPECT_THAT(scene.error().text, HasSubstr("this is a configuration of sonard, not a scene; to check both: sonard check "));
}

TEST(DescribeShippedScenes, HaveNoWarnings) {
  for (const char* name : {"demo", "local-search", "tank-rod", "tank-two-cylinders"}) {
    const auto scene = describe_scene(std::filesystem::path(SONARD_SOURCE_DIR "/scenes") / (std::string(name) + ".yaml"));
    ASSERT_TRUE(scene) << scene.error().text;
    const Remarks r = remarks_on(*scene);
    if (std::string_view(name).starts_with("tank"))
      EXPECT_THAT(r.warnings, ::testing::SizeIs(::testing::Le(1u))) << name;  // a tank's floor is narrower than a seabed
    else
      EXPECT_THAT(r.warnings, IsEmpty()) << name;
  }
  const auto built_in = describe_scene("demo.yaml");
  ASSERT_TRUE(built_in) << built_in.error().text;
  EXPECT_GT(built_in->triangles, 100000u);
}

}  // namespace
}  // namespace sonar::scene_tools
