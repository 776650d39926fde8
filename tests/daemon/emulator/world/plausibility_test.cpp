// Notes on probable mistakes: each common mistake has its note, and a right value has none. A running daemon logs each kind of
// note once and keeps it in its status as long as the mistake lasts.
#include "daemon/emulator/world/plausibility.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "core/scene/files/load_scene.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/mavlink/frames.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

Config config_with(const std::string& vehicle, const std::string& mount = "{frame: FLU}", const std::string& more = {}) {
  auto config =
      parse_config("world: {scene: demo.yaml}\nvehicles: [{name: rov" + vehicle +
                       "}]\nsonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2, mount: " + mount + "}]\n" + more,
                   "test.yaml", {});
  if (!config) throw std::runtime_error(config.error().text);
  return *std::move(config);
}

/// Returns a bed of 40 x 30 m at z = -5, and further objects.
Scene bed_scene(std::vector<Object> more = {}) {
  auto mesh = std::make_shared<Mesh>();
  mesh->vertices = {{-20, -15, 0}, {20, -15, 0}, {20, 15, 0}, {-20, 15, 0}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->material = {0, 0};
  Scene scene;
  scene.materials = {Material{.name = "mud"}};
  scene.objects = {Object{.name = "bed", .mesh = mesh, .in_world = {{0, 0, -5}, {}}}};
  for (Object& o : more) scene.objects.push_back(std::move(o));
  return scene;
}
/// Returns a box with edges of this size around this position.
Object box(const std::string& name, Vec3 size_m, Vec3d at_m) {
  auto mesh = std::make_shared<Mesh>();
  mesh->vertices = {-0.5f * size_m, 0.5f * size_m, {0, 0, 0}};
  mesh->triangles = {{0, 1, 2}};
  mesh->material = {0};
  return Object{.name = name, .mesh = mesh, .in_world = {at_m, {}}};
}

Note note_from(const v1::Note& note) { return {note.vehicle(), note.text(), note.cure()}; }
const Note& note_from(const Note& note) { return note; }
std::vector<std::string> texts_of(const auto& notes) {
  std::vector<std::string> texts;
  for (const auto& n : notes) texts.push_back(text_of(note_from(n)));
  return texts;
}
std::vector<std::string> notes(const Config& config, const Scene& scene = bed_scene()) {
  return texts_of(notes_on(config, scene, surroundings_of(config, scene)));
}
std::vector<std::string> at(const std::string& initial_pose) {
  return notes(config_with(", initial_pose: {frame: ENU_FLU, " + initial_pose + "}"));
}

TEST(Plausibility, IntendedConfigurationsHaveNoNotes) {
  EXPECT_THAT(at("xyz_m: [-7, 0, -3], rpy_deg: [0, 20, 270]"), IsEmpty());
  EXPECT_THAT(at("xyz_m: [-7, 0, 0]"), IsEmpty()) << "at the surface";
  EXPECT_THAT(at("xyz_m: [-50, 0, -3]"), IsEmpty()) << "30 m outside, within the range of 40 m";
  EXPECT_THAT(notes(*demo_config()), IsEmpty());
  EXPECT_THAT(notes(config_with("", "{frame: FRD, xyz_m: [0, 0, 0.1], rpy_deg: [0, -15, 180]}")), IsEmpty()) << "looking aft";
  EXPECT_THAT(notes(config_with("", "{frame: FRD, xyz_m: [0, 0, 0.1], rpy_deg: [90, -90, 0]}")), IsEmpty())
      << "mounted on its side, looks down";
}

TEST(Plausibility, AVehicleAboveTheWaterIsNoted) {
  EXPECT_THAT(at("xyz_m: [-7, 0, 3]"),
              ElementsAre(AllOf(HasSubstr("the sonar of rov is 3.0 m above the water's surface (z = 0); "),
                                HasSubstr("was NED taken for ENU, or the reverse?"))));
  // A boat at the surface with its sonar below the keel is correct; a sonar on the mast is a mistake.
  EXPECT_THAT(notes(config_with(", initial_pose: {frame: NED_FRD, xyz_m: [0, 0, -0.3]}", "{frame: FRD, xyz_m: [0, 0, 0.6]}")),
              IsEmpty());
  EXPECT_THAT(notes(config_with(", initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, 0]}", "{frame: FLU, xyz_m: [0, 0, 2]}")),
              ElementsAre(HasSubstr("is 2.0 m above")));
  EXPECT_THAT(at("xyz_m: [-7, 0, 0.0009]"), IsEmpty()) << "pings also treat so small a height as the surface";
}

TEST(Plausibility, ADefaultPositionIsNotChecked) {
  const std::string up = "{frame: FLU, xyz_m: [0, 0, 0.2]}";
  EXPECT_THAT(notes(config_with("", up)), IsEmpty());
  EXPECT_THAT(notes(config_with(", trajectory: orbit", up)), ElementsAre(HasSubstr("is 0.2 m above")));
}

Scene scene_of(const std::string& yaml) {
  auto scene = parse_scene(yaml, "scene.yaml", {});
  if (!scene) throw std::runtime_error(scene.error().text);
  return **scene;
}

TEST(Plausibility, TheSeaSurfaceIsNeitherGroundNorSomethingToSee) {
  const Config config = config_with(", initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, -2]}");
  EXPECT_THAT(notes(config, scene_of("sea_surface: {}\nobjects: []\n")), IsEmpty());
  EXPECT_THAT(
      notes(config, scene_of("sea_surface: {}\nmaterials: {bright: {lambert_db: -10}}\nobjects:\n"
                             "  - {name: bed, type: plane, material: bright, size_m: [40, 40], pose: {xyz_m: [0, 0, 1]}}\n")),
      ElementsAre(HasSubstr("nothing of the scene lies below"),
                  HasSubstr("is 3.0 m below the lowest point of the ground (z = 1.0)")));
}

TEST(Plausibility, NedReadAsEnuBelowTheBedOrFarAwayIsNoted) {
  EXPECT_THAT(at("xyz_m: [3, 0, -9]"), ElementsAre(AllOf(HasSubstr("is 4.0 m below the lowest point of the ground (z = -5.0)"),
                                                         HasSubstr("the origin that depths are counted from"))));
  Scene strip = bed_scene();
  strip.objects[0].in_world.position_m = {0, 500, -5};
  EXPECT_THAT(notes(config_with(", initial_pose: {frame: ENU_FLU, xyz_m: [500, 0, -2]}"), strip),
              ElementsAre(AllOf(HasSubstr("m from everything in the scene, but its range is at most 40 m"),
                                HasSubstr("it is in the scene with x and y exchanged"))));
  EXPECT_THAT(at("xyz_m: [3000, 0, -3]"), ElementsAre(HasSubstr("positions are metres from the world's 0, 0, 0")));
}

TEST(Plausibility, ASceneFarFromTheOriginIsNotedBeforeTheFirstPose) {
  Config config = config_with("");
  Scene far = bed_scene();
  far.objects[0].in_world.position_m = {500'000, 6'651'411, -5};
  EXPECT_THAT(notes(config, far), IsEmpty()) << "poses may be in metres from the same far origin";
  config.origin = Geodetic{rad_from_deg(60), rad_from_deg(15), 0};
  EXPECT_THAT(notes(config, far),
              ElementsAre(AllOf(HasSubstr("the scene is 6670.2 km from world.origin; vehicles with latitudes"),
                                HasSubstr("a height map in degrees or UTM without `origin` and `centred`"))));
  EXPECT_THAT(notes(config, bed_scene()), IsEmpty());
  far.objects[0].in_world.position_m = {900, 0, -5};
  EXPECT_THAT(notes(config, far), IsEmpty()) << "900 m can be driven";
}

TEST(Plausibility, OnlyASonarBelowGroundIsNoted) {
  const auto below = [](double z_m, std::vector<Object> things) {
    Scene scene = bed_scene(std::move(things));
    scene.objects.erase(scene.objects.begin());  // no bed
    return notes(config_with(", initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, " + std::to_string(z_m) + "]}"), scene);
  };
  EXPECT_THAT(below(-8, {box("hull", {20, 5, 5}, {0, 0, -2.5})}), IsEmpty());
  EXPECT_THAT(below(-4, {box("buoy", {1, 1, 1}, {-3, 0, -2}), box("buoy 2", {1, 1, 1}, {3, 0, -2})}), IsEmpty());
  Object shelf = bed_scene().objects[0], bed = shelf;
  shelf.in_world.position_m.z = -2;
  EXPECT_THAT(below(-4, {shelf, bed}), IsEmpty()) << "the sonar is under an overhang";
  EXPECT_THAT(below(-6, {shelf, bed}), ElementsAre(HasSubstr("is 1.0 m below the lowest point of the ground (z = -5.0)")));
  bed.in_world.orientation = quat_from_rpy({rad_from_deg(90), 0, 0});
  EXPECT_THAT(below(-25, {bed}), IsEmpty()) << "a wall is no ground";
}

TEST(Plausibility, ASceneAboveTheWaterIsNotedInsteadOfTheVehicle) {
  Scene dry = bed_scene();
  dry.sea_surface.present = true;
  dry.objects[0].in_world.position_m = {0, 0, 0};
  EXPECT_THAT(notes(config_with(", initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, 2]}"), dry),
              ElementsAre(HasSubstr("nothing of the scene lies below the water's surface, z = 0; lower the scene")));
  dry.sea_surface.present = false;
  EXPECT_THAT(notes(config_with(", initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, 2]}"), dry), IsEmpty())
      << "a tank that stands on the ground";
}

TEST(Plausibility, AnUpsideDownMountIsNoted) {
  for (const char* mount :
       {"{frame: FLU, rpy_deg: [180, 0, 0]}", "{frame: FRD, rpy_deg: [-170, 10, 0]}", "{frame: FLU, rpy_deg: [0, 165, 0]}"})
    EXPECT_THAT(notes(config_with("", mount)),
                ElementsAre(HasSubstr("sonar front is mounted upside down on rov; rpy_deg is [roll, pitch, yaw]")));
}

TEST(Plausibility, AMeshInMillimetresIsNoted) {
  const Config config = config_with(", initial_pose: {frame: ENU_FLU, xyz_m: [-7, 0, -3]}");
  EXPECT_THAT(notes(config, bed_scene({box("wreck", {1200, 300, 250}, {0, 0, -5})})),
              ElementsAre(HasSubstr("wreck is 1200 m long, but no sonar has a range above 40 m; if the file is in centimetres or "
                                    "millimetres, set scale: 0.01 or 0.001")));
  EXPECT_THAT(notes(config, bed_scene({box("wreck", {120, 30, 25}, {0, 0, -5})})), IsEmpty());
  EXPECT_THAT(notes(config, bed_scene({box("survey", {1200, 900, 12}, {0, 0, -5})})), IsEmpty()) << "ground may be long";
  Object ridge = bed_scene().objects[0];
  auto relief = std::make_shared<Mesh>(*ridge.mesh);
  relief->vertices = {{-600, -400, 0}, {600, -400, 200}, {600, 400, 0}, {-600, 400, 200}};
  ridge.name = "ridge", ridge.mesh = relief, ridge.in_world.position_m.z = -210;
  EXPECT_THAT(notes(config, bed_scene({ridge})), IsEmpty()) << "ground with relief may be long, too";
  Object quay = box("quay", {1200, 300, 250}, {0, 0, -5});
  quay.primitive.kind = Primitive::Kind::box;
  EXPECT_THAT(notes(config, bed_scene({quay})), IsEmpty()) << "the scene file gives the size of a box in metres";
}

// ---- trajectories

Config playing(const std::string& lines, const std::string& name = "dive.tum") {
  const std::string folder = ::testing::TempDir() + "plausibility-" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/" + name) << lines;
  auto config = parse_config("world: {scene: demo.yaml}\nvehicles: [{name: rov, trajectory: " + name +
                                 "}]\nsonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}]\n",
                             "test.yaml", folder);
  std::filesystem::remove_all(folder);
  if (!config) throw std::runtime_error(config.error().text);
  return *std::move(config);
}
/// Lines of a turn of 360 deg on the spot with small roll and pitch. The quaternion's w is first or last. In FRD the body's z is
/// down, as in NED.
std::string turning(bool w_first, const char* frame, double z_m, const char* comma = " ", const char* unit = "") {
  std::string lines = std::string("# frame: ") + frame + "\n";
  for (int i = 0; i < 36; ++i) {
    const Quatd q = quat_from_rpy({0.05, 0.1, rad_from_deg(10 * i)});
    const std::array<double, 4> in_order = w_first ? std::array{q.w, q.x, q.y, q.z} : std::array{q.x, q.y, q.z, q.w};
    lines += std::to_string(i) + unit;
    for (const double v : {1.0, 2.0, z_m, in_order[0], in_order[1], in_order[2], in_order[3]}) lines += comma + std::to_string(v);
    lines += "\n";
  }
  return lines;
}

TEST(Plausibility, AQuaternionWithWAtTheWrongEndIsNoted) {
  for (const char* frame : {"ENU_FLU", "NED_FRD"}) {
    const double z_m = std::string(frame) == "ENU_FLU" ? -3 : 3;
    EXPECT_THAT(notes(playing(turning(false, frame, z_m))), IsEmpty());
    EXPECT_THAT(notes(playing(turning(true, frame, z_m))),
                ElementsAre(HasSubstr(
                    "the quaternions of dive.tum turn rov over, but would not if w were at the other end; write w where "
                    "the format has it: last in a TUM line")));
    EXPECT_THAT(notes(playing(turning(true, frame, z_m, ",", "000000000"), "dive.csv")), IsEmpty()) << "EuRoC";
    EXPECT_THAT(notes(playing(turning(false, frame, z_m, ",", "000000000"), "dive.csv")),
                ElementsAre(HasSubstr("if w were at the other end")));
  }
}

/// Lines of a camera that turns and looks down by up to 50 deg, with the axes of pictures or, as in EuRoC, of an IMU beside it.
std::string looking_around(Quatd body_in_flu, bool w_first, const char* comma = " ", const char* unit = "") {
  std::string lines = "# frame: ENU_FLU\n";
  for (int i = 0; i < 36; ++i) {
    const Quatd q = quat_from_rpy({0.05, rad_from_deg(10 + 40 * (i % 2)), rad_from_deg(10 * i)}) * body_in_flu;
    const std::array<double, 4> in_order = w_first ? std::array{q.w, q.x, q.y, q.z} : std::array{q.x, q.y, q.z, q.w};
    lines += std::to_string(i) + unit;
    for (const double v : {1.0, 2.0, -3.0, in_order[0], in_order[1], in_order[2], in_order[3]})
      lines += comma + std::to_string(v);
    lines += "\n";
  }
  return lines;
}

TEST(Plausibility, ATrajectoryOfACameraIsNoted) {
  const Quatd picture{0.5, -0.5, 0.5, -0.5}, imu{0, std::sqrt(0.5), 0, std::sqrt(0.5)};
  ASSERT_NEAR(rotate(picture, Vec3d{0, 0, 1}).x, 1, 1e-9);
  ASSERT_NEAR(rotate(picture, Vec3d{1, 0, 0}).y, -1, 1e-9);
  ASSERT_NEAR(rotate(imu, Vec3d{1, 0, 0}).z, 1, 1e-9);
  ASSERT_NEAR(rotate(imu, Vec3d{0, 1, 0}).y, -1, 1e-9);
  EXPECT_THAT(
      notes(playing(looking_around(picture, false))),
      ElementsAre(AllOf(HasSubstr("the poses of dive.tum have the axes of a camera"), HasSubstr("rpy_deg: [0, -90, 90]"))));
  EXPECT_THAT(notes(playing(looking_around(imu, true, ",", "000000000"), "dive.csv")),
              ElementsAre(AllOf(HasSubstr("of an IMU beside a camera"), HasSubstr("rpy_deg: [0, -90, 180]"))));
  EXPECT_THAT(notes(playing(looking_around(Quatd{}, false))), IsEmpty());

  // With the mount that the note suggests the sonar looks where the camera looks, and there is no note.
  const struct {
    Quatd body;
    RollPitchYaw mount;
  } cures[] = {{picture, {0, -pi / 2, pi / 2}}, {imu, {0, -pi / 2, pi}}};
  for (const auto& [body, mount] : cures) {
    Config config = playing(looking_around(body, false));
    config.sonars[0].mount.orientation = quat_from_rpy(mount);
    EXPECT_THAT(notes(config), IsEmpty());
    const Quatd sonar = body * config.sonars[0].mount.orientation;
    EXPECT_NEAR(rotate(sonar, Vec3d{1, 0, 0}).x, 1, 1e-9);
    EXPECT_NEAR(rotate(sonar, Vec3d{0, 0, 1}).z, 1, 1e-9);
  }
}

TEST(Plausibility, ATrajectoryAboveTheWaterOrUpsideDownIsNoted) {
  EXPECT_THAT(notes(playing("# frame: ENU_FLU\n0 0 0 -1 0 0 0 1\n1 0 0 2 0 0 0 1\n2 0 0 3 0 0 0 1\n")),
              ElementsAre(HasSubstr("is 2.0 m above the water's surface (z = 0), in 2 of 3 poses of dive.tum; was NED")));
  EXPECT_THAT(notes(playing("# frame: ENU_FLU\nt,x,y,z,roll_deg,pitch_deg\n0,0,0,-3,170,40\n", "dive.csv")),
              ElementsAre(AllOf(HasSubstr("rov is upside down"), HasSubstr("in 1 of 1 poses of dive.csv"))));
}

/// Circles of 5 m radius with the bow ahead, or a turn on the spot; the yaw column holds degrees or radians.
std::string circling(const char* frame, double z_m, double unit_per_rad, double radius_m) {
  std::string lines = std::string("# frame: ") + frame + "\nt_s,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg\n";
  for (int i = 0; i < 400; ++i) {
    const double angle = 0.0321 * i, yaw = std::remainder(angle + pi / 2, 2 * pi);
    const double x = radius_m * std::cos(angle), y = radius_m * std::sin(angle);  // in NED this path turns clockwise
    for (const double v : {0.1 * i, x, y, z_m, 0.05 * std::sin(angle) * unit_per_rad, 0.0}) lines += std::to_string(v) + ",";
    lines += std::to_string(yaw * unit_per_rad) + "\n";
  }
  return lines;
}

TEST(Plausibility, RadiansInColumnsOfDegreesAreNoted) {
  for (const char* frame : {"ENU_FLU", "NED_FRD"}) {
    const double z_m = std::string(frame) == "ENU_FLU" ? -3 : 3;
    for (const double radius_m : {0.0, 5.0}) {
      EXPECT_THAT(notes(playing(circling(frame, z_m, deg_from_rad(1), radius_m), "dive.csv")), IsEmpty()) << frame << radius_m;
      EXPECT_THAT(notes(playing(circling(frame, z_m, 1, radius_m), "dive.csv")),
                  ElementsAre(AllOf(HasSubstr("the headings of dive.csv stay within 6.3 deg, and "),
                                    HasSubstr(radius_m > 0 ? "would follow the course" : "jump by 6.28 deg"),
                                    HasSubstr("call the columns roll_rad, pitch_rad and yaw_rad"))))
          << frame << radius_m;
    }
  }
}

TEST(Plausibility, DegreesInColumnsOfRadiansAreNoted) {
  const auto with = [](const std::string& columns, const std::string& values) {
    return playing("# frame: ENU_FLU\nt_s,x_m,y_m,z_m," + columns + "\n0,0,0,-3,0,0,0\n1,0,0,-3," + values + "\n", "dive.csv");
  };
  const std::string radians = "roll_rad,pitch_rad,yaw_rad";
  EXPECT_THAT(
      notes(with(radians, "0,-10,90")),
      ElementsAre("dive.csv has an angle of 90 rad; were degrees written? Call the columns roll_deg, pitch_deg and yaw_deg"));
  EXPECT_THAT(notes(with(radians, "0,0,270")), ElementsAre(HasSubstr("an angle of 270 rad")));
  EXPECT_THAT(notes(with(radians, "0,0.2,-7.5")), IsEmpty()) << "a heading that is not wrapped";
  EXPECT_THAT(notes(with("roll_deg,pitch_deg,yaw_deg", "0,-10,90")), IsEmpty());
}

TEST(Plausibility, AVehicleThatHoldsItsHeadingHasDegrees) {
  // A survey in lanes with the bow always north, and small swings of the heading.
  std::string lanes = "# frame: ENU_FLU\nt_s,x_m,y_m,z_m,yaw_deg\n", ferry = lanes;
  for (int i = 0; i < 400; ++i) {
    const int lane = i / 50, along = lane % 2 == 0 ? i % 50 : 49 - i % 50;
    const double swing = 2.5 * std::sin(0.7 * i);
    lanes += std::to_string(0.1 * i) + "," + std::to_string(0.2 * along) + "," + std::to_string(lane) + ",-3," +
             std::to_string(swing) + "\n";
    ferry += std::to_string(0.1 * i) + "," + std::to_string(0.1 * i) + ",0,-3," + std::to_string(swing) + "\n";
  }
  EXPECT_THAT(notes(playing(lanes, "dive.csv")), IsEmpty());
  EXPECT_THAT(notes(playing(ferry, "dive.csv")), Not(testing::Contains(HasSubstr("radians"))));
}

TEST(Plausibility, SomePosesOfALongTrajectoryAreChecked) {
  std::string lines = "# frame: ENU_FLU\n";
  for (int i = 0; i < 25000; ++i) lines += std::to_string(i) + " 0 0 2 0 0 0 1\n";
  EXPECT_THAT(notes(playing(lines)), ElementsAre(HasSubstr("in 8334 of 8334 checked poses of dive.tum")));
}

// ---- a running daemon

TEST(Plausibility, TheLastPoseIsCheckedAgainWhenTheSceneChanges) {
  const Config config = config_with("");
  Scene elsewhere = bed_scene();
  elsewhere.objects[0].in_world.position_m.x = 500;
  Plausibility plausibility;
  EXPECT_THAT(plausibility.use(config, bed_scene()), IsEmpty());
  control::PoseSample sample;
  sample.name = "rov", sample.pose.position_m = {480, 0, -3};
  EXPECT_THAT(texts_of(plausibility.use(sample, {})), ElementsAre(HasSubstr("m from everything in the scene")));
  EXPECT_THAT(plausibility.use(config, elsewhere), IsEmpty());
  EXPECT_THAT(plausibility.all(), IsEmpty());
  sample.pose.position_m = {480, 0, -9};
  EXPECT_EQ(plausibility.use(sample, {}).size(), 1u) << "below the ground of the other scene";
  EXPECT_THAT(plausibility.use(config, bed_scene()), IsEmpty()) << "the note that the vehicle is far away is not new";
  EXPECT_THAT(texts_of(plausibility.all()), ElementsAre(HasSubstr("m from everything in the scene")));
}

TEST(Plausibility, AboveTheWaterAndBelowTheGroundAreTwoMistakes) {
  Plausibility plausibility;
  EXPECT_THAT(plausibility.use(config_with(""), bed_scene()), IsEmpty());
  control::PoseSample sample;
  sample.name = "rov", sample.pose.position_m = {0, 0, -30};
  EXPECT_THAT(texts_of(plausibility.use(sample, {})), ElementsAre(HasSubstr("below the lowest point of the ground")));
  sample.pose.position_m.z = 3;
  EXPECT_THAT(texts_of(plausibility.use(sample, {})), ElementsAre(HasSubstr("above the water's surface")));
}

TEST(Plausibility, ATrajectoryIsCheckedAgainWhenTheSceneChanges) {
  const Config config = playing("# frame: ENU_FLU\n0 480 0 -3 0 0 0 1\n");
  Scene elsewhere = bed_scene();
  elsewhere.objects[0].in_world.position_m.x = 500;
  Plausibility plausibility;
  EXPECT_THAT(plausibility.use(config, elsewhere), IsEmpty());
  EXPECT_EQ(plausibility.use(config, bed_scene()).size(), 1u);
  EXPECT_EQ(plausibility.all().size(), 1u);
  EXPECT_THAT(plausibility.use(config, elsewhere), IsEmpty());
  EXPECT_THAT(plausibility.all(), IsEmpty());
}

struct RunningNotes : ::testing::Test {
  void send(const std::string& pose) {
    const std::uint64_t before = daemon.status().poses().accepted();
    send_udp(daemon.address(), daemon.app().poses().json().port, bytes_of(pose));
    ASSERT_TRUE(eventually([&] { return daemon.status().poses().accepted() > before; }));
  }
  std::size_t times_logged(const std::string& words) {
    const std::string log = daemon.log_text();
    std::size_t times = 0;
    for (std::size_t i = log.find(words); i != std::string::npos; i = log.find(words, i + 1)) ++times;
    return times;
  }
  Daemon daemon;
};

TEST_F(RunningNotes, APoseAboveTheWaterIsLoggedOnceAndInTheStatusWhileItHolds) {
  EXPECT_THAT(daemon.status().notes(), IsEmpty());
  for (int i = 0; i < 5; ++i) send(R"({"position":[0,0,-3],"attitude":[0,0,0]})");  // ENU's z, with NED's frame
  EXPECT_EQ(times_logged("the sonar of rov is 3.0 m above the water's surface"), 1u);
  const auto notes = daemon.status().notes();
  ASSERT_EQ(notes.size(), 1);
  EXPECT_EQ(notes[0].vehicle(), "rov");
  EXPECT_THAT(notes[0].cure(), HasSubstr("state the frame that was sent"));
  send(R"({"position":[0,0,3],"attitude":[0,0,0]})");
  EXPECT_THAT(daemon.status().notes(), IsEmpty());
  send(R"({"position":[0,0,-4],"attitude":[0,0,0]})");
  EXPECT_EQ(times_logged("above the water's surface"), 1u) << "once";
  EXPECT_EQ(daemon.status().notes_size(), 1);
}

TEST_F(RunningNotes, DegreesSentAsRadiansAreNoted) {
  send(R"({"position":[0,0,3],"attitude":[0,0,7.1]})");  // a heading of more than a whole turn
  EXPECT_THAT(daemon.status().notes(), IsEmpty());
  send(R"({"position":[0,0,3],"attitude":[0,-10,-90]})");
  EXPECT_THAT(
      texts_of(daemon.status().notes()),
      ElementsAre("the attitude of rov has an angle of 90 rad; angles must be in radians: were degrees sent? Multiply them by "
                  "0.0174533"));
  send(R"({"position":[0,0,3],"quaternion":[0,0.9848077530122081,0.17364817766693033,0]})");
  EXPECT_THAT(texts_of(daemon.status().notes()), ElementsAre(HasSubstr("rov is upside down, 180 deg from upright")));
}

TEST(StartNotes, NotesOnTheConfigurationEndWithTheFirstPose) {
  DaemonSetup setup;
  setup.sonar_lines = "    mount: {frame: FLU, xyz_m: [0, 0, 4], rpy_deg: [180, 0, 0]}\n";
  Daemon daemon(setup);
  EXPECT_THAT(daemon.log_text(),
              AllOf(HasSubstr("sonar front is mounted upside down on rov"), HasSubstr("1.0 m above the water")));
  EXPECT_EQ(daemon.status().notes_size(), 2);
  send_udp(daemon.address(), daemon.app().poses().json().port, bytes_of(R"({"position":[0,0,6],"attitude":[0,0,0]})"));
  EXPECT_TRUE(eventually([&] { return daemon.status().notes_size() == 1; })) << "notes on the initial pose have ended";
}

TEST(MavlinkNotes, ALinkIsInTheStatusUntilUsablePosesCome) {
  DaemonSetup setup;
  setup.more = "poses: {protobuf: off, json: off, mavlink: 'udpin:" + setup.address + ":0'}\n";
  Daemon daemon(setup);
  const auto note = [&] {
    const auto notes = daemon.status().notes();
    return notes.empty() ? v1::Note() : notes[0];
  };
  EXPECT_EQ(note().vehicle(), "rov");
  EXPECT_THAT(note().text(), HasSubstr("no poses yet: no message received"));
  const std::uint16_t port = daemon.app().mavlink().listens_at(0).port;
  mavlink::Identity autopilot{1, 1, 0};
  mavlink::Attitude attitude;
  attitude.boot_ms = 1000;
  send_udp(daemon.address(), port, framed(attitude, autopilot));
  EXPECT_TRUE(
      eventually([&] { return note().text().find("a position or depth is missing (LOCAL_POSITION_NED") != std::string::npos; }));
  mavlink::LocalPositionNed place;
  place.boot_ms = 1000, place.down_m = 3;
  send_udp(daemon.address(), port, framed(place, autopilot));
  EXPECT_TRUE(eventually([&] { return daemon.status().notes().empty(); }));
}

}  // namespace
}  // namespace sonar::testing_daemon
