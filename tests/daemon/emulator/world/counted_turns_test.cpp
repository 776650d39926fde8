// A heading in radians that grows beyond whole turns, as in dead reckoning, is not mistaken for degrees.
#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "core/motion/trajectory_file.hpp"
#include "daemon/config/load_config.hpp"
#include "daemon/emulator/world/plausibility.hpp"

namespace sonar::counted_turns_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string line_of(double t_s, double yaw, double roll = 0) {
  return std::to_string(t_s) + ",0,0,-3," + std::to_string(roll) + ",0," + std::to_string(yaw) + "\n";
}
constexpr int spiral_steps = 2000;
/// Returns lines of a turn at 0.5 rad/s, ten poses per second, by default over 100 rad from `begin_rad`.
std::string spiral(double begin_rad, double roll = 0, double unit = 1, int steps = spiral_steps) {
  std::string lines;
  for (int i = 0; i < steps; ++i) lines += line_of(0.1 * i, unit * (begin_rad + 0.05 * i), roll);
  return lines;
}

std::vector<std::string> notes(const std::string& lines) {
  const auto file =
      motion::parse_trajectories("# frame: ENU_FLU\nt_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad\n" + lines, "dive.csv", {});
  if (!file) throw std::runtime_error(file.error().text);
  motion::Plan plan;
  plan.trajectory = file->bodies.front().trajectory;
  plan.largest_angle = file->bodies.front().largest_angle;
  plan.file = "dive.csv";
  std::vector<std::string> texts;
  for (const Note& note : notes_on_trajectory({"rov", {Pose{}}}, plan, {})) texts.push_back(text_of(note));
  return texts;
}

TEST(CountedTurns, CountedTurnsOfATrajectoryAreNotMistakenForDegrees) {
  EXPECT_THAT(notes(spiral(0)), IsEmpty());
  EXPECT_THAT(notes(spiral(4.7)), IsEmpty()) << "the first angle is below a turn";
  EXPECT_THAT(notes(spiral(-150, 0, 1, 8000)), IsEmpty()) << "the file begins after many turns";
  const auto are_degrees = HasSubstr("were degrees written?");
  EXPECT_THAT(notes(spiral(-150)), ElementsAre(are_degrees)) << "the file has too few turns for its first angle";
  EXPECT_THAT(notes(spiral(0, 0, deg_from_rad(1))), ElementsAre(are_degrees));
  EXPECT_THAT(notes(line_of(0, 270) + line_of(1, 270)), ElementsAre(are_degrees));
  EXPECT_THAT(notes(spiral(0) + line_of(200, 300)), ElementsAre(are_degrees)) << "a jump";
  std::string wrapped;
  for (int i = 0; i < spiral_steps; ++i) wrapped += line_of(0.1 * i, std::remainder(i, 360));
  EXPECT_THAT(notes(wrapped), ElementsAre(are_degrees)) << "10 degrees per second";
}

TEST(CountedTurns, AreNotFoundInASlowTurnInDegrees) {
  const auto are_degrees = HasSubstr("were degrees written?");
  std::string slow, through_north, often;
  for (int i = 0; i < spiral_steps; ++i) {
    slow += line_of(0.1 * i, 90 + 0.1 * i);
    through_north += line_of(0.1 * i, std::fmod(350 + 0.1 * i, 360));
    often += line_of(0.01 * i, 0.04 * i);
  }
  EXPECT_THAT(notes(slow), ElementsAre(are_degrees)) << "1 degree per second";
  EXPECT_THAT(notes(through_north), ElementsAre(are_degrees));
  EXPECT_THAT(notes(often), ElementsAre(are_degrees)) << "4 degrees and a hundred poses per second";
}

TEST(CountedTurns, HideNoOtherNoteOnTheAttitude) {
  const auto is_over = HasSubstr("rov is upside down");
  EXPECT_THAT(notes(spiral(0, 3)), ElementsAre(is_over));
  EXPECT_THAT(notes(line_of(0, 270, 3) + line_of(1, 270, 3)), ElementsAre(HasSubstr("were degrees written?"), is_over));
  EXPECT_THAT(notes(line_of(0, 270, 170)), ElementsAre(HasSubstr("an angle of 270 rad"))) << "the roll is in degrees too";
}

TEST(CountedTurns, CountedTurnsOfASenderAreNotMistakenForDegrees) {
  const auto config = parse_config(
      "world: {scene: demo.yaml}\nvehicles: [{name: rov}]\nsonars: [{name: front, profile: "
      "oculus-m1200d, bind_ip: 127.0.0.2}]\n",
      "test.yaml", {});
  ASSERT_TRUE(config) << config.error().text;
  for (const bool is_stamped : {false, true}) {
    Plausibility plausibility;
    plausibility.use(*config, Scene{});
    control::PoseSample sample;
    sample.pose.position_m.z = -3;
    const auto send = [&](double t_s, const RollPitchYaw& sent) {
      const Time at(nanoseconds_from(t_s));
      sample.sent_angles = sent;
      sample.pose.orientation = quat_from_rpy(sent);
      if (is_stamped) sample.stamp = {control::ClockDomain::sim, at.time_since_epoch().count()};
      plausibility.use(sample, is_stamped ? Time() : at);
      std::vector<std::string> texts;
      for (const Note& note : plausibility.all())
        if (note.vehicle == "rov") texts.push_back(text_of(note));
      return texts;
    };
    for (int i = 0; i < spiral_steps; ++i) ASSERT_THAT(send(0.1 * i, {0, 0, 0.05 * i}), IsEmpty()) << i;
    const auto are_degrees = HasSubstr("were degrees sent?");
    EXPECT_THAT(send(200, {0, 0, 300}), ElementsAre(are_degrees)) << "a jump";
    EXPECT_THAT(send(201, {3, 0, 300}), ElementsAre(HasSubstr("rov is upside down"), are_degrees));
    EXPECT_THAT(send(202, {170, 0, 300}), ElementsAre(are_degrees));
    EXPECT_THAT(send(203, {0, 0, 1}), IsEmpty());
    for (int i = 0; i < spiral_steps; ++i) send(204 + 0.1 * i, {0, 0, std::fmod(350 + 0.1 * i, 360)});
    EXPECT_THAT(send(404, {0, 0, 190}), ElementsAre(are_degrees)) << "a slow turn through north";
  }
}

}  // namespace
}  // namespace sonar::counted_turns_test
