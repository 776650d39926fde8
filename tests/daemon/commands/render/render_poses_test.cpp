// The vehicle of a rendered ping rests, moves on a circle, or follows a file in the file's own time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {
namespace {

using testing::HasSubstr;

RenderJob job_of(std::string_view text, const std::string& body = {}) {
  const auto file = motion::parse_trajectories(text, "p.csv", {.frame = motion::Frame::enu_flu});
  EXPECT_TRUE(file) << (file ? "" : file.error().text);
  RenderJob job;
  job.scene = std::make_shared<const Scene>();
  EXPECT_TRUE(file && follow(job, *file, "p.csv", body));
  return job;
}
bool snapshots(std::string_view text) { return job_of(text).snapshots; }
Pose vehicle_at(const RenderJob& job, Time t) { return make_request(job, world_of(job), PingNumber{1}, t).vehicle_in_world; }
Twist sonar_twist_at(RenderJob job, const Pose& mount, Time t) {
  job.sonar().mount = mount;
  return make_request(job, world_of(job), PingNumber{1}, t).sonar_moves;
}
Time at(double s) { return Time{} + nanoseconds_from(s); }
Vec3d ahead(const Pose& pose) { return rotate(pose.orientation, Vec3d{1, 0, 0}); }
void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(RenderPoses, InterpolatesBetweenLinesAndHasTheirMotion) {
  const RenderJob job = job_of("t,x,y,z,yaw\n0,0,0,0,0\n2,1,0,0,90\n3,1,0,0,90\n");
  expect_near(vehicle_at(job, at(1)).position_m, {0.5, 0, 0});
  expect_near(ahead(vehicle_at(job, at(1))), {std::sqrt(0.5), std::sqrt(0.5), 0});
  expect_near(vehicle_at(job, at(-1)).position_m, {0, 0, 0});
  expect_near(vehicle_at(job, at(9)).position_m, {1, 0, 0});
  const Twist moving = sonar_twist_at(job, {}, at(1)), resting = sonar_twist_at(job, {}, at(3));
  expect_near(moving.velocity_mps, {0.5, 0, 0}, 1e-12);
  expect_near(moving.angular_rate_radps, {0, 0, pi / 4}, 1e-12);
  expect_near(resting.velocity_mps, {0, 0, 0}, 1e-12);
  // A sonar a metre ahead of the turning vehicle swings.
  const Twist swinging = sonar_twist_at(job, {{1, 0, 0}, {}}, at(0));
  expect_near(swinging.velocity_mps, {0.5, pi / 4, 0}, 1e-12);
}

TEST(RenderPoses, AJumpBetweenLinesIsNoMotion) {
  RenderJob job = job_of("t,x,y,z,yaw\n0,0,0,0,0\n1,29,0,0,0\n2,60,0,0,0\n2.1,60,0,0,90\n3,60,0,0,90\n");
  job.snapshots = false;  // as with --motion on
  expect_near(sonar_twist_at(job, {}, at(0.5)).velocity_mps, {29, 0, 0});
  const Twist far = sonar_twist_at(job, {{1, 0, 0}, {}}, at(1.5)), turned = sonar_twist_at(job, {{1, 0, 0}, {}}, at(2.05));
  expect_near(far.velocity_mps, {0, 0, 0});
  expect_near(turned.velocity_mps, {0, 0, 0});
  expect_near(turned.angular_rate_radps, {0, 0, 0});
  expect_near(vehicle_at(job, at(1.5)).position_m, {44.5, 0, 0});  // the position is still that of the lines
}

std::string lines_of(int count, double step_m, double turn_deg, double period_s = 1) {
  std::string text = "t,x,y,z,yaw\n";
  for (int i = 0; i < count; ++i)
    text += std::to_string(i * period_s) + "," + std::to_string(i * step_m) + ",0,0," + std::to_string(i * turn_deg) + "\n";
  return text;
}

TEST(RenderPoses, PosesTooFarApartForAVehicleAreSnapshotsWithoutMotion) {
  struct Step {
    double step_m, turn_deg, period_s;
  };
  for (const auto& [step_m, turn_deg, period_s] : {Step{15.1, 0, 1}, Step{0, 144, 0.5}, Step{5, 0, 0.033}}) {
    const RenderJob job = job_of(lines_of(5, step_m, turn_deg, period_s));
    EXPECT_TRUE(job.snapshots) << step_m << " " << turn_deg;
    const Twist rests = sonar_twist_at(job, {{1, 0, 0}, {}}, at(2 * period_s));
    EXPECT_EQ(length(rests.velocity_mps) + length(rests.angular_rate_radps), 0) << step_m << " " << turn_deg;
    expect_near(vehicle_at(job, at(2 * period_s)).position_m, {2 * step_m, 0, 0});  // the position is still that of the lines
  }
  for (const auto& [step_m, turn_deg, period_s] : {Step{14.9, 0, 1}, Step{6.2, 0, 1}, Step{0, 143, 0.5}, Step{1, 45, 1}}) {
    const RenderJob job = job_of(lines_of(5, step_m, turn_deg, period_s));
    EXPECT_FALSE(job.snapshots) << step_m << " " << turn_deg;
    EXPECT_GT(length(sonar_twist_at(job, {{1, 0, 0}, {}}, at(2 * period_s)).velocity_mps), 0) << step_m << " " << turn_deg;
  }
}

TEST(RenderPoses, AFastLogWithJitterIsNotTreatedAsSnapshots) {
  std::string text = "t,x,y,z,yaw\n";
  for (int i = 0; i <= 100; ++i)
    text += std::to_string(0.01 * i) + "," + std::to_string(0.015 * i + (i % 3 == 0 ? 0.2 : 0)) + ",0,0," +
            std::to_string(i % 2 == 0 ? 6 : 0) + "\n";
  const RenderJob job = job_of(text);  // from line to line 20 m/s and 10 rad/s
  EXPECT_FALSE(job.snapshots);
  EXPECT_EQ(steps_of(*job.vehicle().plan.trajectory).all, 10u);
  EXPECT_TRUE(snapshots("t,x,y,z\n0,0,0,0\n0.01,3,0,0\n")) << "a file shorter than a step counts as one step";
}

TEST(RenderPoses, AMissionWithAFewJumpsIsNotTreatedAsSnapshots) {
  const std::string slow = lines_of(20, 1, 0);  // 19 steps
  EXPECT_FALSE(snapshots(slow + "20,40,0,0,0\n")) << "1 of 20 steps";
  EXPECT_FALSE(snapshots(slow + "20,40,0,0,0\n21,80,0,0,0\n")) << "2 of 21";
  EXPECT_TRUE(snapshots(slow + "20,40,0,0,0\n21,80,0,0,0\n22,120,0,0,0\n")) << "3 of 22";
  EXPECT_THAT(note_of_snapshots(*job_of("t,x,y,z\n0,0,0,0\n1,20,0,0\n2,21,0,0\n").vehicle().plan.trajectory),
              HasSubstr("1 of 2 steps"));
}

TEST(RenderPoses, VelocitiesOfAFileAreUsed) {
  EXPECT_FALSE(snapshots("t,x,y,z,vx,vy,vz\n0,0,0,0,20,0,0\n1,20,0,0,20,0,0\n2,40,0,0,20,0,0\n"));
  EXPECT_TRUE(snapshots("t,x,y,z\n0,0,0,0\n1,20,0,0\n2,40,0,0\n"));
}

TEST(RenderPoses, KeepsTheTimesOfItsFile) {
  const RenderJob job = job_of("1403636579.763555584 1 0 0 0 0 0 1\n1403636580.763555584 3 0 0 0 0 0 1\n");
  const std::vector<Time> times = pose_times(job);
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times[0].time_since_epoch().count(), 1403636579763555584);
  expect_near(vehicle_at(job, times[0]).position_m, {1, 0, 0});
  expect_near(vehicle_at(job, times[1]).position_m, {3, 0, 0});
  expect_near(sonar_twist_at(job, {}, times[1]).velocity_mps, {2, 0, 0});  // still moving at the last line
  EXPECT_TRUE(pose_times(RenderJob{}).empty());
}

TEST(RenderPoses, OneBodyOfAFileIsFollowed) {
  const std::string two = "body,t,x,y,z\nrov,10,0,0,0\nbuoy,12,5,5,0\nbuoy,14,5,6,0\n";
  const RenderJob buoy = job_of(two, "buoy");
  EXPECT_EQ(pose_times(buoy), (std::vector<Time>{at(12), at(14)}));
  expect_near(vehicle_at(buoy, at(13)).position_m, {5, 5.5, 0});
  const auto file = motion::parse_trajectories(two, "p.csv", {.frame = motion::Frame::enu_flu});
  RenderJob job;
  EXPECT_THAT(follow(job, *file, "p.csv", {}).error().text, HasSubstr("several bodies"));
}

TEST(RenderPoses, RestsOrCircles) {
  RenderJob rest;
  rest.scene = std::make_shared<const Scene>();
  rest.vehicle().initial_pose = {{1, 2, -3}, {}};
  expect_near(vehicle_at(rest, at(100)).position_m, {1, 2, -3});
  expect_near(sonar_twist_at(rest, {}, at(5)).velocity_mps, {0, 0, 0});
  RenderJob circle = rest;
  circle.vehicle() = {.name = {}, .initial_pose = {{6, 0, -3}, {}}, .orbits = true};
  expect_near(vehicle_at(circle, at(0)).position_m, {6, 0, -3});
  expect_near(ahead(vehicle_at(circle, at(0))), {-1, 0, 0});
  expect_near(sonar_twist_at(circle, {}, at(0)).velocity_mps, {0, 0.5, 0}, 1e-12);
}

}  // namespace
}  // namespace sonar::render
