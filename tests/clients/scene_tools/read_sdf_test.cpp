#include <gmock/gmock.h>

#include "core/base/geometry.hpp"
#include "tests/clients/scene_tools/reading.hpp"

namespace sonar::scene_tools {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Vec3d where(const Result<ImportedWorld>& world, std::size_t shape = 0) {
  if (!world || shape >= world->shapes.size()) {
    ADD_FAILURE() << (world ? "no such shape" : world.error().text);
    return {};
  }
  return world->shapes[shape].in_world.position_m;
}

TEST(ReadSdf, PosesOfModelLinkAndVisualCompose) {
  Reading r;
  const auto world =
      r.read(sdf(model("m", std::string("<pose>10 0 0 0 0 1.5707963267948966</pose>") +
                                link("l", "<pose>1 0 0 0 0 1.5707963267948966</pose>", "<pose>1 0 0 0 0 0</pose>"))));
  // The link lies 1 m along the model's x, which points along the world's y. The link's x points along the world's -x.
  expect_near(where(world), {9, 1, 0});
  EXPECT_EQ(world->shapes[0].link, "l");
  EXPECT_EQ(world->models.at(0).path, "m");
  EXPECT_EQ(world->name, "w");
  EXPECT_EQ(world->format, "Gazebo SDF 1.9");
  EXPECT_EQ(world->shapes[0].shape.size_m.y, 2);
}

TEST(ReadSdf, AnglesTurnAboutFixedAxesRollFirst) {
  Reading r;
  const auto world = r.read(sdf(model("m", link("l", "<pose degrees='true'>0 0 0 90 0 90</pose>", "<pose>0 1 0 0 0 0</pose>"))));
  expect_near(where(world), {0, 0, 1});  // the roll turns y to z; the yaw does not change z
  const auto by_quaternion = r.read(
      sdf(model("m", link("l", "<pose rotation_format='quat_xyzw'>0 0 0 0.7071 0 0 0.7071</pose>", "<pose>0 1 0 0 0 0</pose>"))));
  expect_near(where(by_quaternion), {0, 0, 1});
}

TEST(ReadSdf, PosesMayBeRelativeToAnyFrame) {
  Reading r;
  const std::string frames = link("base", "<pose>1 0 0 0 0 0</pose>") +                                 //
                             "<joint name='j' type='revolute'><parent>base</parent><child>arm</child>"  //
                             "<pose>0 0 1 0 0 0</pose></joint>" +                                       //
                             link("arm", "<pose relative_to='base'>0 2 0 0 0 0</pose>") +               //
                             "<frame name='f' attached_to='arm'><pose>0 0 5 0 0 0</pose></frame>" +     //
                             link("tip", "<pose relative_to='f'/>") +
                             link("at_joint", "<pose relative_to='j'>0 0 1 0 0 0</pose>") +
                             link("of_model", "<pose relative_to='__model__'>7 0 0 0 0 0</pose>") +
                             link("odd", "", "<pose relative_to='base'>0 0 3 0 0 0</pose>");
  const auto world = r.read(sdf(model("m", std::string("<pose>0 0 -10 0 0 0</pose>") + frames)));
  expect_near(where(world, 0), {1, 0, -10});
  expect_near(where(world, 1), {1, 2, -10});
  expect_near(where(world, 2), {1, 2, -5});
  expect_near(where(world, 3), {1, 2, -8});  // a joint is at the pose of its child
  expect_near(where(world, 4), {7, 0, -10});
  expect_near(where(world, 5), {1, 0, -7});
}

TEST(ReadSdf, ModelsNestAndAreAddressedThroughTheirNames) {
  Reading r;
  const std::string crane = model("crane", std::string("<pose>0 0 2 0 0 0</pose>") + link("hook", "<pose>1 0 0 0 0 0</pose>"));
  const auto world = r.read(sdf(std::string("<frame name='quay'><pose>100 0 0 0 0 0</pose></frame>") +
                                model("ship", std::string("<pose relative_to='quay'>5 0 0 0 0 0</pose>") + crane +
                                                  link("load", "<pose relative_to='crane::hook'>0 0 -1 0 0 0</pose>")) +
                                model("buoy", std::string("<pose relative_to='ship::crane'>0 0 1 0 0 0</pose>") + link("l"))));
  ASSERT_TRUE(world) << world.error().text;
  ASSERT_EQ(world->models.size(), 3u);
  EXPECT_EQ(world->models[1].path, "ship/crane");
  expect_near(where(world, 0), {106, 0, 1});  // the load
  expect_near(where(world, 1), {106, 0, 2});  // the hook
  expect_near(where(world, 2), {105, 0, 3});
}

TEST(ReadSdf, PlacementFramesPutAnotherPointOfTheModelAtItsPose) {
  Reading r;
  const auto world =
      r.read(sdf(std::string("<model name='m' placement_frame='foot'><pose>0 0 0 0 0 3.141592653589793</pose>") +
                 link("foot", "<pose>1 0 0 0 0 0</pose>") + link("head", "<pose>1 0 2 0 0 0</pose>") + "</model>"));
  expect_near(where(world, 0), {0, 0, 0});
  expect_near(where(world, 1), {0, 0, 2});
}

TEST(ReadSdf, AnIncludeMayReplaceNamePoseAndStatic) {
  Reading r;
  r.files["model://crate"] = std::string("<sdf version='1.6'><model name='crate'><pose>9 9 9 0 0 0</pose><static>true</static>") +
                             link("l") + "</model></sdf>";
  r.files["model://stack"] =
      "<sdf version='1.6'><model name='stack'><include><uri>model://crate</uri><name>top</name><pose>0 0 1 0 0 0</pose></include>"
      "</model></sdf>";
  const auto world =
      r.read(sdf("<include><uri>model://crate</uri></include>"
                 "<include><uri>model://stack</uri><pose>5 0 0 0 0 0</pose><static>0</static></include>"
                 "<include merge='true'><uri>model://crate</uri><name>merged</name><pose>0 7 0 0 0 0</pose></include>" +
                 model("on_it", std::string("<pose relative_to='l'>0 0 1 0 0 0</pose>") + link("x"))));
  expect_near(where(world, 0), {9, 9, 9});
  expect_near(where(world, 1), {5, 0, 1});
  expect_near(where(world, 2), {0, 7, 0});
  expect_near(where(world, 3), {0, 7, 1});
  EXPECT_EQ(world->models[2].path, "stack/top");
  EXPECT_TRUE(world->models[0].is_static);
  EXPECT_FALSE(world->models[1].is_static);
}

TEST(ReadSdf, FramesOfModelsThatAreMergedInMergedModelsAreKnown) {
  Reading r;
  r.files["model://base"] =
      std::string("<sdf version='1.9'><model name='base'>") + link("base_link", "<pose>0 0 1 0 0 0</pose>") + "</model></sdf>";
  r.files["model://rov"] =
      "<sdf version='1.9'><model name='rov'><include merge='true'><uri>model://base</uri><pose>0 2 0 0 0 0</pose></include>"
      "</model></sdf>";
  const auto world =
      r.read(sdf(model("m", std::string("<include merge='true'><uri>model://rov</uri><pose>4 0 0 0 0 0</pose></include>") +
                                link("sonar", "<pose relative_to='base_link'>8 0 0 0 0 0</pose>") +
                                "<joint name='j' type='fixed'><parent>base_link</parent><child>sonar</child></joint>")));
  expect_near(where(world, 0), {12, 2, 1});
  expect_near(where(world, 1), {4, 2, 1});
}

TEST(ReadSdf, TwoModelsWithTheSameNameHaveTheirOwnPoses) {
  Reading r;
  const auto world = r.read(sdf(model("m", std::string("<pose>1 0 0 0 0 0</pose>") + link("l")) +
                                model("m", std::string("<pose>2 0 0 0 0 0</pose>") + link("l"))));
  EXPECT_EQ(where(world, 0).x, 1);
  EXPECT_EQ(where(world, 1).x, 2);
}

TEST(ReadSdf, EveryShapeIsRead) {
  Reading r;
  const auto part = [](const std::string& geometry) {
    return std::string("<visual name='v'><geometry>") + geometry + "</geometry></visual>";
  };
  const auto world =
      r.read(sdf(model("m", std::string("<link name='l'>") + part("<sphere><radius>2</radius></sphere>") +
                                part("<ellipsoid><radii>1 2 3</radii></ellipsoid>") +
                                part("<cylinder><radius>0.5</radius><length>4</length></cylinder>") +
                                part("<capsule><radius>0.5</radius><length>4</length></capsule>") +
                                part("<cone><radius>0.5</radius><length>4</length></cone>") +
                                part("<plane><normal>1 0 0</normal><size>3 4</size></plane>") +
                                part("<mesh><uri>model://a/b.stl</uri><scale>1 2 1</scale></mesh>") +
                                part("<heightmap><uri>h.png</uri><size>50 60 7</size><pos>1 2 3</pos></heightmap>") +
                                part("<empty/>") + "</link>")));
  ASSERT_TRUE(world) << world.error().text;
  const auto& shapes = world->shapes;
  ASSERT_EQ(shapes.size(), 8u);
  EXPECT_EQ(shapes[0].shape.radius_m, 2);
  EXPECT_EQ(shapes[1].shape.size_m.z, 6);
  EXPECT_EQ(shapes[2].shape.length_m, 4);
  EXPECT_EQ(shapes[3].shape.kind, Shape::Kind::capsule);
  EXPECT_EQ(shapes[4].shape.kind, Shape::Kind::cone);
  expect_near(rotate(shapes[5].in_world.orientation, {0, 0, 1}), {1, 0, 0});
  EXPECT_EQ(shapes[6].shape.uri, "model://a/b.stl");
  EXPECT_EQ(shapes[6].shape.scale.y, 2);
  expect_near(shapes[7].in_world.position_m, {1, 2, 3});
  EXPECT_THAT(r.findings.left_out(), ElementsAre());
}

TEST(ReadSdf, MissingLengthsAreTheDefaultsOfSdfAndAreReported) {
  Reading r;
  const auto part = [](const std::string& geometry) {
    return std::string("<visual name='v'><geometry>") + geometry + "</geometry></visual>\n";
  };
  const auto world = r.read(sdf(model("m", std::string("<link name='l'>") + part("<sphere><size>3 3 3</size></sphere>") +
                                               part("<box/>") + part("<capsule><length>4</length></capsule>") + "</link>")));
  ASSERT_TRUE(world) << world.error().text;
  ASSERT_EQ(world->shapes.size(), 3u);
  EXPECT_EQ(world->shapes[0].shape.radius_m, 1);
  EXPECT_EQ(world->shapes[1].shape.size_m.y, 1);
  EXPECT_EQ(world->shapes[2].shape.radius_m, 0.5);
  EXPECT_EQ(world->shapes[2].shape.length_m, 4);
  EXPECT_THAT(r.findings.left_out(), ElementsAre("w.sdf:3: radius of sphere: missing; SDF's default is used, 1 m",
                                                 "w.sdf:4: size of box: missing; SDF's default is used, 1 1 1 m",
                                                 "w.sdf:5: radius of capsule: missing; SDF's default is used, 0.5 m"));
}

TEST(ReadSdf, CollisionsCanReplaceVisuals) {
  Reading r;
  const std::string text = sdf(model("m",
                                     "<link name='l'><collision name='c'><geometry><sphere><radius>2</radius></sphere></geometry>"
                                     "</collision></link>" +
                                         link("seen")));
  EXPECT_EQ(r.read(text)->shapes.size(), 1u);
  EXPECT_THAT(r.findings.left_out(), ElementsAre(HasSubstr("link \"l\": has collision shapes only")));
  r.options.collisions = true;
  ASSERT_EQ(r.read(text)->shapes.size(), 1u);
  EXPECT_EQ(r.read(text)->shapes[0].shape.kind, Shape::Kind::sphere);
}

TEST(ReadSdf, UnsupportedElementsAreNamedOnceWithTheirLine) {
  Reading r;
  r.files["model://cam"] =
      "<sdf version='1.6'><model name='cam'><link name='l'>\n<sensor name='eye' type='camera'/></link></model></sdf>";
  const auto world = r.read(
      sdf(std::string("<light name='sun' type='directional'/>\n<actor name='walker'/><physics/><gravity>0 0 -9.8</gravity>\n") +
          model("m",
                "<plugin name='p' filename='x.so'/><joint name='j' type='prismatic'/><joint type='fixed'/>"
                "<link name='l'><inertial/><visual name='v'><geometry><polyline/></geometry></visual></link>") +
          "\n<include><uri>model://cam</uri></include><include><uri>model://cam</uri><name>b</name></include>"
          "<include><uri>model://sun</uri></include><include><uri>https://fuel.gazebosim.org/1.0/OpenRobotics/models/Sun/2</uri>"
          "</include><include><uri>https://fuel.gazebosim.org/1.0/OpenRobotics/models/Sun/tip/files/model.sdf</uri></include>"
          "<include><uri>https://fuel.gazebosim.org/1.0/hmoyen/models/North East Down frame</uri></include>"));
  ASSERT_TRUE(world) << world.error().text;
  EXPECT_THAT(r.findings.left_out(),
              ElementsAre("1 coordinate frame (North East Down frame), 4 lights: without an echo", "w.sdf:4: actor \"walker\"",
                          "w.sdf:5: plugin \"p\"", "w.sdf:5: joint \"j\" (prismatic): stays as it is drawn",
                          "w.sdf:5: geometry polyline: scenes have no such shape", "model:/cam:2: sensor \"eye\""));
}

TEST(ReadSdf, TheOriginOfAWorldIsReportedAsAConfigurationKey) {
  Reading r;
  ASSERT_TRUE(
      r.read(sdf("<spherical_coordinates><latitude_deg>56.71</latitude_deg><longitude_deg>-3.5</longitude_deg>"
                 "</spherical_coordinates>" +
                 model("m", link("l")))));
  EXPECT_THAT(r.findings.left_out(),
              ElementsAre("w.sdf:3: spherical_coordinates: in the configuration, world.origin: {lat: 56.71, lon: -3.5}"));
}

TEST(ReadSdf, MistakesAreReportedWithFileAndLine) {
  Reading r;
  EXPECT_THAT(r.error(sdf(model("m", link("base", "<pose relative_to='bse'/>")))),
              ::testing::AllOf(StartsWith("w.sdf:3: no frame \"bse\" in model \"m\""), HasSubstr("did you mean \"base\"?")));
  EXPECT_THAT(r.error(sdf(model("m", std::string("<pose relative_to='nowhere'/>") + link("l")))),
              HasSubstr("no frame \"nowhere\" in the world"));
  EXPECT_THAT(r.error(sdf(model("m", link("l", "<pose>1 2 3</pose>")))),
              StartsWith("w.sdf:3: pose: 6 numbers are needed here, not 3"));
  EXPECT_THAT(r.error(sdf(model("m", link("l", "<pose>1 2 3 0 0 x</pose>")))), HasSubstr("\"x\" is not a number"));
  EXPECT_THAT(r.error(sdf(model("m", link("l", "<pose>1 2 3 0 0 nan</pose>")))), HasSubstr("\"nan\" is not a number"));
  EXPECT_THAT(r.error(sdf(model("m", link("l") + link("l")))), HasSubstr("link \"l\": the name is used twice"));
  EXPECT_THAT(r.error(sdf("<include><uri>model://gone</uri></include>")),
              ::testing::AllOf(StartsWith("w.sdf:3:"), HasSubstr("--model-path")));
  EXPECT_THAT(r.error("<sdf><world>"), StartsWith("w.sdf:1: not well-formed XML"));
  EXPECT_THAT(r.error("<gazebo version='1.0'/>"), HasSubstr("neither <sdf> nor <robot>"));
  EXPECT_THAT(r.error(""), HasSubstr("is empty"));
  r.options.skip_missing = true;
  EXPECT_TRUE(r.read(sdf("<include><uri>model://gone</uri></include>")));
  EXPECT_THAT(r.findings.left_out(), Contains("w.sdf:3: include of model://gone: not found"));
}

TEST(ReadSdf, MissingModelsAreNamedOnceEachWithTheCommandThatFetchesThem) {
  Reading r;
  const std::string rock = "https://fuel.gazebosim.org/1.0/Cole/models/Ocean Rock 03";
  const std::string world = sdf("<include><uri> " + rock + " </uri></include>\n<include><uri>" + rock + "</uri></include>\n" +
                                "<include><uri>model://gone</uri></include>" + model("m", link("l")));
  EXPECT_EQ(r.error(world),
            "w.sdf:3: include: models were not found; fetch them, give the folder that holds them with --model-path, or continue "
            "without them with --skip-missing: gz fuel download --url '" +
                rock + "' (2 includes); model://gone");
  r.options.skip_missing = true;
  ASSERT_TRUE(r.read(world));
  EXPECT_THAT(r.findings.left_out(), ElementsAre("w.sdf:3: include of " + rock +
                                                     " (2 times): not found; fetch it: gz fuel "
                                                     "download --url '" +
                                                     rock + "'",
                                                 "w.sdf:5: include of model://gone: not found"));
}

TEST(ReadSdf, TheCommandHasAddressesOfTheServerAndNotOfWebPages) {
  Reading r;
  for (const char* page : {"app.gazebosim.org", "app.ignitionrobotics.org"})
    EXPECT_THAT(r.error(sdf("<include><uri>https://" + std::string(page) + "/Cole/fuel/models/Ocean Rock 03</uri></include>")),
                HasSubstr("gz fuel download --url 'https://fuel.gazebosim.org/1.0/Cole/models/Ocean Rock 03'"));
}

TEST(ReadSdf, NoCommandIsGivenForAddressesThatAShellWouldRun) {
  Reading r;
  for (const char* more : {"$(id)", "`id`", "x' ; id ; '", "x\" ; id ; \"", "a\nid", "a;id", "a|id", "a&amp;id", "a\\"}) {
    const std::string said =
        r.error(sdf(std::string("<include><uri>https://fuel.example/1.0/a/models/") + more + "</uri></include>"));
    EXPECT_THAT(said, HasSubstr("--skip-missing: https://fuel.example/1.0/a/models/")) << more;
    EXPECT_THAT(said, ::testing::Not(HasSubstr("gz fuel"))) << more;
  }
  EXPECT_THAT(r.error(sdf("<include><uri>https://fuel.example/" + std::string(300, 'a') + "</uri></include>")),
              ::testing::Not(HasSubstr("gz fuel")));
}

TEST(ReadSdf, ModelsNamedLikeFramesOrWaterAreReadWhereTheyAreFound) {
  Reading r;
  const std::vector<std::string> names{"a_frame", "axes", "ocean"};
  std::string includes;
  for (const std::string& name : names) {
    r.files["model://" + name] = "<sdf>" + model(name, link("l")) + "</sdf>";
    includes += "<include><uri>model://" + name + "</uri></include>";
  }
  const auto world = r.read(sdf(includes));
  ASSERT_TRUE(world) << world.error().text;
  EXPECT_EQ(world->shapes.size(), 3u);
  EXPECT_THAT(r.findings.left_out(), ElementsAre());
  r.files.clear();
  const auto without = r.read(sdf(includes + model("m", link("l"))));
  ASSERT_TRUE(without) << without.error().text;
  EXPECT_EQ(without->shapes.size(), 1u);
  EXPECT_THAT(r.findings.left_out(),
              ElementsAre("2 coordinate frames (a_frame, axes), 1 drawn water surface (ocean): without an echo"));
}

TEST(ReadSdf, CirclesAndDeepIncludesAreRefused) {
  Reading r;
  EXPECT_THAT(r.error(sdf(model("m", link("a", "<pose relative_to='b'/>") + link("b", "<pose relative_to='a'/>")))),
              HasSubstr("in a circle"));
  r.files["model://again"] =
      "<sdf><model "
      "name='again'><include><uri>model://again</uri></include><include><uri>model://again</uri></include></model></sdf>";
  EXPECT_THAT(r.error(sdf("<include><uri>model://again</uri></include>")), HasSubstr("more than 16 includes deep"));
  r.files["model://wide"] = "<sdf><model name='wide'>";
  for (int i = 0; i < 100; ++i) r.files["model://wide"] += "<include><uri>model://many</uri></include>";
  r.files["model://wide"] += "</model></sdf>";
  r.files["model://many"] = r.files["model://wide"];
  for (std::size_t at = 0; (at = r.files["model://many"].find("many", at)) != std::string::npos; ++at)
    r.files["model://many"].replace(at, 4, "leaf");
  r.files["model://leaf"] = "<sdf><model name='leaf'/></sdf>";
  EXPECT_THAT(r.error(sdf("<include><uri>model://wide</uri></include>")), HasSubstr("more than 4096 models"));
  std::string chain;
  const auto name = [](int i) {
    std::string text("l");
    return text.append(std::to_string(i));
  };
  for (int i = 1; i < 400; ++i) {
    std::string pose("<pose relative_to='");
    pose.append(name(i + 1)).append("'/>");
    chain += link(name(i), pose);
  }
  EXPECT_THAT(r.error(sdf(model("m", chain + link("l400")))), HasSubstr("256 deep"));
  for (const int depth : {101, 200, 2000}) {
    std::string deep("<sdf>");
    for (int i = 1; i < depth; ++i) deep += "<model>";
    for (int i = 1; i < depth; ++i) deep += "</model>";
    EXPECT_THAT(r.error(deep + "</sdf>"), HasSubstr("100 deep")) << depth;
  }
}

}  // namespace
}  // namespace sonar::scene_tools
