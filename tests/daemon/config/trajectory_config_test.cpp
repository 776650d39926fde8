// The keys of trajectories in a configuration: what is read, and every refusal with file, line, column and key.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "daemon/config/load_config.hpp"
#include "daemon/config/products.hpp"

namespace sonar::trajectory_config_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Returns a folder with files of every kind.
std::string directory() {
  static const std::string made = [] {
    std::string d = ::testing::TempDir() + "trajectoriesXXXXXX";  // a folder of this process, because others run beside it
    EXPECT_NE(mkdtemp(d.data()), nullptr);
    std::filesystem::create_directories(d + "/missions");
    std::ofstream(d + "/scene.yaml") << "name: test\n";
    std::ofstream(d + "/missions/dive.tum") << "# frame: ENU_FLU\n0 1 2 -3 0 0 0 1\n60 1 2 -9 0 0 0 1\n";
    std::ofstream(d + "/missions/no-frame.tum") << "0 1 2 -3 0 0 0 1\n60 1 2 -9 0 0 0 1\n";
    std::ofstream(d + "/missions/broken.csv") << "# frame: ENU_FLU\nt,x,y,z\n1,1,2,3\n0,1,2,3\n";
    std::ofstream(d + "/fleet.csv") << "# frame: ENU_FLU\nbody,t,x,y,z\nrov,0,1,0,0\nauv,0,2,0,0\nrov,9,1,0,0\n";
    std::ofstream(d + "/kitti.txt") << "1 0 0 5 0 1 0 0 0 0 1 0\n1 0 0 6 0 1 0 0 0 0 1 0\n";
    return d;
  }();
  return made;
}
Result<Config> parse(const std::string& trajectory, const std::string& more = {}) {
  return parse_config("world: {scene: scene.yaml}\nvehicles:\n  - name: rov\n    trajectory: " + trajectory +
                          "\nsonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}]\n" + more,
                      "sonard.yaml", directory());
}
VehicleConfig vehicle(const std::string& trajectory) {
  const auto config = parse(trajectory);
  EXPECT_TRUE(config) << config.error().text;
  return config ? config->vehicles.at(0) : VehicleConfig{};
}
std::string why(const std::string& trajectory, const std::string& more = {}) {
  const auto config = parse(trajectory, more);
  return config ? "accepted" : config.error().text;
}

TEST(TrajectoryConfig, NoneOrbitAndFilesAreRead) {
  EXPECT_FALSE(vehicle("none").plan || vehicle("none").orbits);
  EXPECT_TRUE(vehicle("orbit").orbits);
  const motion::Plan plan = vehicle("missions/dive.tum").plan;
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan.file, "missions/dive.tum");
  EXPECT_EQ(plan.about, "missions/dive.tum: tum, ENU_FLU, 2 poses, 60.000 s");
  EXPECT_EQ(plan.rules, motion::PlaybackRules{});
  EXPECT_EQ(plan.trajectory->duration(), seconds(60));
  std::ofstream(directory() + "/equal.tum") << "# frame: ENU_FLU\n0 0 0 -3 0 0 0 1\n1 0 0 -3 0 0 0 1\n1 1 0 -3 0 0 0 1\n";
  EXPECT_EQ(vehicle("equal.tum").plan.about,
            "equal.tum: tum, ENU_FLU, 2 poses, 1.000 s, 1 pose replaced by the next of the same stamp");
  std::ofstream(directory() + "/ms.tum") << "# frame: ENU_FLU\n1305031102175 0 0 -3 0 0 0 1\n1305031103175 0 0 -3 0 0 0 1\n";
  EXPECT_EQ(vehicle("ms.tum").plan.about, "ms.tum: tum, ENU_FLU, 2 poses, 1.000 s, stamps in milliseconds");
}

TEST(TrajectoryConfig, AnotherOriginThanTheWorldsIsANote) {
  const auto notes = [](const std::string& comment, const std::string& origin) {
    std::ofstream(directory() + "/log.csv") << "# frame: ENU_FLU\n" << comment << "\nt,x,y,z\n0,0,0,-3\n1,0,0,-3\n";
    const auto config = parse_config("world: {scene: scene.yaml" + origin +
                                         "}\nvehicles: [{name: rov, trajectory: log.csv}]\n"
                                         "sonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}]\n",
                                     "sonard.yaml", directory());
    EXPECT_TRUE(config);
    return config ? notes_of_config(*config) : std::vector<std::string>{};
  };
  const std::string world = ", origin: {lat: 47.6, lon: -122.33}";
  EXPECT_THAT(notes("# origin: 47.61000000,-122.33000000,0.000", world),
              ::testing::ElementsAre(AllOf(StartsWith("vehicle rov: log.csv states an origin that is 1112 m from world.origin"),
                                           HasSubstr("--origin 47.6,-122.33,0"))));
  EXPECT_THAT(notes("# origin: 47.60000000,-122.33000000,10 (the first fix)", world), ::testing::IsEmpty());
  EXPECT_THAT(notes("# origin: 47.61,-122.33,0", ""), ::testing::IsEmpty());
  for (const char* other : {"# origin: quay", "# origin:", "# origin: 1", "# made by hand"})
    EXPECT_THAT(notes(other, world), ::testing::IsEmpty()) << other;
}

TEST(TrajectoryConfig, EveryKeyIsRead) {
  const motion::Plan plan =
      vehicle("{file: missions/no-frame.tum, format: tum, frame: NED_FRD, speed: 2.5, loop: true, start_s: -1.5}").plan;
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan.trajectory->points().poses.at(0).position_m.z, 3) << "down is down";
  EXPECT_EQ(plan.rules.speed.millionths, 2'500'000);
  EXPECT_TRUE(plan.rules.loop);
  EXPECT_EQ(plan.rules.start, -milliseconds(1500));
  EXPECT_THAT(plan.about, HasSubstr(", from -1.5 s at 2.5 x, looped"));
  EXPECT_EQ(vehicle("{file: kitti.txt, frame: ENU_FLU, rate_hz: 4}").plan.trajectory->duration(), milliseconds(250));
}

TEST(TrajectoryConfig, BodiesOfOneFileAreFoundByName) {
  EXPECT_EQ(vehicle("fleet.csv").plan.trajectory->points().poses.at(0).position_m.x, 1)
      << "without `body`, the vehicle's own name is used";
  EXPECT_EQ(vehicle("{file: fleet.csv, body: auv}").plan.trajectory->points().poses.at(0).position_m.x, 2);
  const auto config = parse("fleet.csv", "objects:\n  - {name: auv, trajectory: fleet.csv}\n");
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_EQ(config->objects.at(0).plan.trajectory->points().poses.at(0).position_m.x, 2);
  EXPECT_EQ(config->objects.at(0).place, "sonard.yaml:7:12: objects[0].name");
}

/// The page's example, with files as it names them.
TEST(TrajectoryConfig, TheManualsExampleIsAConfiguration) {
  std::ofstream(directory() + "/missions/fleet.csv") << "body,t,x,y,z\nauv,0,1,2,3\nboat,0,4,5,6\nauv,99,1,2,3\n";
  std::ifstream page(std::string(SONARD_SOURCE_DIR) + "/docs/poses.md");
  std::string text((std::istreambuf_iterator<char>(page)), std::istreambuf_iterator<char>());
  const std::size_t begin = text.find("```yaml\nvehicles:") + 8;
  const std::string example = text.substr(begin, text.find("```", begin) - begin);
  const auto config = parse_config(
      "world: {scene: scene.yaml}\nsonars: [{name: a, profile: oculus-m1200d, vehicle: rov, bind_ip: 127.0.0.2}]\n" + example,
      "sonard.yaml", directory());
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_TRUE(config->vehicles.at(0).plan && config->vehicles.at(1).plan && config->objects.at(0).plan);
  EXPECT_EQ(config->vehicles.at(1).plan.rules.speed.factor(), 4);
  EXPECT_EQ(config->objects.at(0).plan.trajectory->points().poses.at(0).position_m.x, 5) << "east";
}

TEST(TrajectoryConfig, MistakesAreReportedWithTheirLine) {
  EXPECT_THAT(why("orbti"), AllOf(StartsWith("sonard.yaml:4:17: vehicles[0].trajectory: "), HasSubstr("\"orbit\"")));
  EXPECT_THAT(why("dive.tum"), AllOf(StartsWith("sonard.yaml:4:17: vehicles[0].trajectory: "),
                                     HasSubstr("no such file: \"dive.tum\"; looked in /")));
  EXPECT_THAT(why("missions/broken.csv"), HasSubstr("broken.csv:4: the time is earlier than the previous one"));
  EXPECT_THAT(why("missions/no-frame.tum"), HasSubstr("does not state the frame of its poses"));
  EXPECT_THAT(why("{file: missions/dive.tum, frame: NED_FRD}"), HasSubstr("the file states the frame ENU_FLU"));
  EXPECT_THAT(why("{file: missions/dive.tum, frame: NWU}"), StartsWith("sonard.yaml:4:50: vehicles[0].trajectory.frame: "));
  EXPECT_THAT(why("{file: missions/dive.tum, speed: 0}"), HasSubstr("vehicles[0].trajectory.speed"));
  EXPECT_THAT(why("{file: missions/dive.tum, speeed: 2}"), HasSubstr("did you mean \"speed\""));
  EXPECT_THAT(why("{file: missions/dive.tum, start_s: 61}"), HasSubstr("start_s: is beyond the end of the trajectory, 60.000 s"));
  EXPECT_THAT(why("{file: missions/dive.tum, format: csv}"), HasSubstr("dive.tum:2: a CSV file begins with"));
  EXPECT_THAT(why("{file: missions/dive.tum, rate_hz: 10}"), HasSubstr("remove rate_hz"));
  EXPECT_THAT(why("{file: kitti.txt, frame: ENU_FLU}"), HasSubstr("rate_hz"));
  EXPECT_THAT(why("{file: missions/dive.tum, body: rov}"), HasSubstr("remove the key \"body\""));
  EXPECT_THAT(why("{file: fleet.csv, body: avu}"), HasSubstr("did you mean \"auv\""));
  EXPECT_THAT(why("{speed: 2}"), HasSubstr("vehicles[0].trajectory.file"));
  EXPECT_THAT(why("[1]"), StartsWith("sonard.yaml:4:17: vehicles[0].trajectory: "));
  EXPECT_THAT(why("orbit", "objects: [{name: buoy}]\n"), HasSubstr("objects[0].trajectory"));
  EXPECT_THAT(why("orbit", "objects: [{name: buoy, trajectory: orbit}]\n"), HasSubstr("objects[0].trajectory"));
  EXPECT_THAT(why("orbit", "objects: [{name: a, trajectory: fleet.csv}]\n"), HasSubstr("no body is called \"a\""));
  EXPECT_THAT(why("orbit", "objects:\n  - {name: auv, trajectory: fleet.csv}\n  - {name: auv, trajectory: none}\n"),
              HasSubstr("\"auv\" is used twice"));
}

}  // namespace
}  // namespace sonar::trajectory_config_test
