// Trajectory files: all formats give the same poses, errors name their line, and an hour of poses is read quickly.
#include "core/motion/trajectory_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/base/memory_left.hpp"

namespace sonar::motion::trajectory_file_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::StartsWith;

const ReadOptions enu{.frame = Frame::enu_flu};

TrajectoryFile parsed(const std::string& text, const ReadOptions& options = enu) {
  auto file = parse_trajectories(text, "p.csv", options);
  EXPECT_TRUE(file) << (file ? "" : file.error().text) << " in " << text;
  return file.value_or(TrajectoryFile{{{"", std::make_shared<const Trajectory>(Points{{Ns{0}}, {{}}, {}, {}})}}});
}
std::string refusal(const std::string& text, const ReadOptions& options = enu) {
  const auto file = parse_trajectories(text, "p.csv", options);
  return file ? "accepted" : file.error().text;
}
void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}
Vec3d ahead(const Pose& pose) { return rotate(pose.orientation, Vec3d{1, 0, 0}); }
const Points& points(const TrajectoryFile& file, std::size_t body = 0) { return file.bodies.at(body).trajectory->points(); }

TEST(TrajectoryFile, AnEqualStampReplacesThePose) {
  const TrajectoryFile tum =
      parsed("10.5694 0 0 -3 0 0 0 1\n10.5760 0.1 0 -3 0 0 0 1\n10.5760 0.15 0 -3 0 0 0 1\n10.5827 0.2 0 -3 0 0 0 1\n");
  ASSERT_EQ(points(tum).times.size(), 3u);
  ASSERT_EQ(points(tum).poses.size(), 3u);
  EXPECT_EQ(points(tum).poses[1].position_m.x, 0.15);
  EXPECT_EQ(tum.replaced, 1u);
  const TrajectoryFile bodies = parsed(
      "body,t,x,y,z,vx,vy,vz\nrov,1,0,0,0,1,0,0\nbuoy,1,5,0,0,0,0,0\nrov,1,2,0,0,3,0,0\nrov,1,3,0,0,4,0,0\nbuoy,2,6,0,0,0,0,0\n");
  EXPECT_EQ(bodies.replaced, 2u);
  ASSERT_EQ(points(bodies).times.size(), 1u);
  EXPECT_EQ(points(bodies).velocities_mps, (std::vector<Vec3d>{{4, 0, 0}}));
  EXPECT_EQ(points(bodies, 1).times.size(), 2u);
  EXPECT_EQ(parsed("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n").replaced, 0u);
}

TEST(TrajectoryFile, AFirstStampBeyondSecondsDeterminesTheUnit) {
  const auto of = [](const std::string& first, const std::string& second) {
    return parsed(first + " 0 0 -3 0 0 0 1\n" + second + " 1 0 -3 0 0 0 1\n");
  };
  for (const auto& [first, second, unit] : {std::array{"1305031102175", "1305031102275", "milliseconds"},
                                            std::array{"1305031102175304", "1305031102275304", "microseconds"},
                                            std::array{"1305031102175304000", "1305031102275304000", "nanoseconds"},
                                            std::array{"1305031102.2", "1305031102.3", "seconds"}}) {
    const TrajectoryFile file = of(first, second);
    EXPECT_EQ(file.unit, unit);
    EXPECT_EQ(file.duration, milliseconds(100)) << first;
  }
  EXPECT_EQ(parsed("t_ms,x,y,z\n0,1,2,3\n1500,1,2,3\n").duration, milliseconds(1500));
  EXPECT_EQ(parsed("t_us,x,y,z\n0,1,2,3\n1500,1,2,3\n").duration, std::chrono::microseconds(1500));
  EXPECT_THAT(refusal("t_s,x,y,z\n1305031102175,1,2,3\n"), HasSubstr("\"1305031102175\" is not a time in seconds"));
}

TEST(TrajectoryFile, StepsDetermineTheUnitOfStampsFromZero) {
  /// Lines of a body at `m_s`, `steps_s` apart, with stamps in units of `unit_s`.
  const auto lines = [](double step_s, double unit_s, double m_s, bool euroc = false) {
    std::ostringstream out;
    out.precision(15);
    for (int i = 0; i < 50; ++i) {
      const double t = i * step_s / unit_s, x = i * step_s * m_s;
      euroc ? out << t << ',' << x << ",0,-3,1,0,0,0,0,0,0\n" : out << t << ' ' << x << " 0 -3 0 0 0 1\n";
    }
    return out.str();
  };
  const auto expect = [](const std::string& text, std::string_view unit, milliseconds duration, bool guessed) {
    const TrajectoryFile file = parsed(text);
    EXPECT_EQ(file.unit, unit) << text.substr(0, 80);
    EXPECT_EQ(std::chrono::round<milliseconds>(file.duration), duration) << text.substr(0, 80);
    EXPECT_EQ(file.unit_by_steps, guessed) << text.substr(0, 80);
  };
  for (const auto& [unit_s, unit] :
       {std::pair{1e-3, "milliseconds"}, std::pair{1e-6, "microseconds"}, std::pair{1e-9, "nanoseconds"}}) {
    expect(lines(0.1, unit_s, 0.5), unit, milliseconds(4900), true);
    expect(lines(0.04, unit_s, 0.05), unit, milliseconds(1960), true);
    expect("timestamp x y z qx qy qz qw\n" + lines(0.1, unit_s, 0.5), unit, milliseconds(4900), true);
    expect("t_s x y z qx qy qz qw\n" + lines(0.1, 1e-3, 0.5), "seconds", seconds(4900), false);
    expect(lines(0.1, unit_s, 0.5, true), unit, milliseconds(4900), unit_s != 1e-9);
  }
  expect(lines(0.1, 1, 0.5, true), "seconds", milliseconds(4900), true);  // EuRoC stamps are nanoseconds by definition
  expect(lines(0.1, 1, 0.5), "seconds", milliseconds(4900), false);
  expect(lines(60, 1, 0.5), "seconds", seconds(49 * 60), false);                                        // corners of a course
  expect("0 0 0 -3 0 0 0 1\n60 0 0 -3 0 0 0 1\n120 0 0 -3 0 0 0 1\n", "seconds", seconds(120), false);  // the body waits there
  for (const double m_s : {0.0, 1e-4})  // a vehicle at rest or adrift: the rate of its log decides
    for (const double step_s : {0.02, 0.1}) {
      expect(lines(step_s, 1e-3, m_s), "milliseconds", milliseconds(static_cast<int>(49e3 * step_s + 0.5)), true);
      expect(lines(step_s, 1e-6, m_s), "microseconds", milliseconds(static_cast<int>(49e3 * step_s + 0.5)), true);
      expect(lines(step_s, 1, m_s), "seconds", milliseconds(static_cast<int>(49e3 * step_s + 0.5)), false);
    }
  expect(lines(1, 1e-3, 0), "milliseconds", seconds(49), true);
  expect(lines(1, 1, 0), "seconds", seconds(49), false);
  expect("0 0 0 -3 0 0 0 1\n", "seconds", milliseconds(0), false);
  expect("5000000000000 0 0 -3 0 0 0 1\n5000100000000 0.05 0 -3 0 0 0 1\n", "nanoseconds", milliseconds(100),
         true);  // time since a start
  expect("1.403636580838555e+18,0,0,0,1,0,0,0\n1.403636580838556e+18,1,0,0,1,0,0,0\n", "nanoseconds", milliseconds(0), false);
}

TEST(TrajectoryFile, FilesOfOtherProgramsAreRead) {
  for (const char* text :
       {"T_S;X_M;Y_M;Z_M;\n10.5;1;2;3;\n11;1;2;4;\n", "\"timestamp\",\"tx\",\"ty\",\"tz\"\n10.5,1,2,3\n11,1,2,4\n",
        "% made by hand\n// t x y z\ntime x y z\n10.5 1 2 3\n11 1 2 4\n", "t x y z\r10.5 1 2 3\r11 1 2 4\r",
        "10.5,1,2,3,0,0,0,1\n11.0,1,2,4,0,0,0,1\n"}) {
    const TrajectoryFile file = parsed(text);
    EXPECT_EQ(file.duration, milliseconds(500)) << text;
    EXPECT_EQ(points(file).poses.back().position_m.z, 4) << text;
    EXPECT_EQ(points(file).poses.back().orientation.w, 1) << text;
  }
  EXPECT_EQ(parsed("1.403636580838555648e+18,0,0,0,1,0,0,0\n").format, Format::euroc);
  EXPECT_EQ(parsed("0,0,0,0,1,0,0,0\n5000000,0,0,0,1,0,0,0\n").duration, milliseconds(5));
}

TEST(TrajectoryFile, EveryFormatGivesTheSamePoses) {
  const struct {
    Format format;
    std::string text;
  } files[] = {
      {Format::csv, "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0.5,1,2,-3,0.7071067811865476,0,0,0.7071067811865476\n1.5,1,4,-3,1,0,0,0\n"},
      {Format::csv, "time,x,y,z,yaw\n0.5,1,2,-3,90\n1.5,1,4,-3,0\n"},
      {Format::csv, "\xef\xbb\xbft, x, y, z, roll, pitch, yaw_deg\r\n0.5, 1, 2, -3, 0, 0, +90\r\n1.5, 1, 4, -3, 0, 0, 0\r\n"},
      {Format::csv, "yaw\tz y x t_ns\n090.0 -3 2 1 500000000\n0 -3 4 1 1500000000"},
      {Format::tum, "# t x y z qx qy qz qw\n0.5 1 2 -3 0 0 0.70710678 0.70710678\n\n1.5e0 1 4 -3 0 0 0 1\n"},
      {Format::euroc,
       "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
       "500000000,1,2,-3,0.70710678,0,0,0.70710678\n1500000000,1,4,-3,1,0,0,0\n"},
      {Format::kitti, "0 -1 0 1 1 0 0 2 0 0 1 -3\n1 0 0 1 0 1 0 4 0 0 1 -3\n"},
  };
  for (const auto& f : files) {
    ReadOptions options = enu;
    if (f.format == Format::kitti) options.rate_hz = 1;
    const TrajectoryFile file = parsed(f.text, options);
    EXPECT_EQ(file.format, f.format) << f.text;
    options.format = f.format;
    EXPECT_EQ(parsed(f.text, options).format, f.format);
    const Points& p = points(file);
    EXPECT_EQ(file.begins_at, f.format == Format::kitti ? Ns{0} : milliseconds(500)) << f.text;
    ASSERT_EQ(p.times, (std::vector<Ns>{Ns{0}, seconds(1)})) << f.text;
    expect_near(p.poses[0].position_m, {1, 2, -3});
    expect_near(ahead(p.poses[0]), {0, 1, 0});
    expect_near(p.poses[1].position_m, {1, 4, -3});
    expect_near(ahead(p.poses[1]), {1, 0, 0});
  }
}

TEST(TrajectoryFile, MatricesOfAllTurnsBecomeQuaternions) {
  for (const Vec3d& turn :
       {Vec3d{0, 0, 0}, {3.1, 0, 0}, {0, 3.1, 0}, {0, 0, 3.1}, {1, -2, 0.5}, {pi, 0, 0}, {0, pi, 0}, {0, 0, pi}}) {
    const Rotation r = rotation_from(turned_by(turn));
    std::ostringstream line;
    line.precision(17);
    for (int row = 0; row < 3; ++row) line << r.m[row][0] << ' ' << r.m[row][1] << ' ' << r.m[row][2] << ' ' << row << ' ';
    const Rotation got = rotation_from(points(parsed(line.str(), {.frame = Frame::enu_flu, .rate_hz = 10})).poses[0].orientation);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) EXPECT_NEAR(got.m[i][j], r.m[i][j], 1e-9);
  }
}

TEST(TrajectoryFile, TakesTheFrameFromTheFileOrTheCaller) {
  const std::string line = "t,x,y,z,yaw_deg\n0,10,20,3,90\n";  // 10 m north, 20 m east, 3 m deep, heading east
  for (const TrajectoryFile& file :
       {parsed("# frame: NED_FRD\n" + line, {}), parsed(line + "# and the frame: ned_frd", {}),
        parsed(line, {.frame = Frame::ned_frd}), parsed("# frame: NED_FRD\n" + line, {.frame = Frame::ned_frd})}) {
    EXPECT_EQ(file.frame, Frame::ned_frd);
    expect_near(points(file).poses[0].position_m, {20, 10, -3});
    expect_near(ahead(points(file).poses[0]), {1, 0, 0});
  }
  EXPECT_THAT(refusal(line, {}),
              HasSubstr("p.csv: the file does not state the frame of its poses; begin it with a line \"# frame: "
                        "ENU_FLU\" or \"# frame: NED_FRD\""));
  EXPECT_THAT(refusal("# frame: ENU_FLU\n" + line, {.frame = Frame::ned_frd}),
              "p.csv:1: the file states the frame ENU_FLU, but NED_FRD was requested");
  EXPECT_THAT(refusal("# frame: ENU_FLU\n# frame: NED_FRD\n" + line, {}),
              "p.csv:2: an earlier comment names another frame; a file has one frame");
  EXPECT_THAT(refusal("# frame: NWU\n"), StartsWith("p.csv:1: the frame must be"));
}

TEST(TrajectoryFile, ReadsVelocitiesInBothFrames) {
  const std::string euroc = "0,1,2,3,1,0,0,0,0.1,0.2,0.3,9,9,9,9,9,9\n";
  expect_near(points(parsed(euroc)).velocities_mps.at(0), {0.1, 0.2, 0.3});
  EXPECT_TRUE(points(parsed(euroc)).angular_velocities_radps.empty());
  const TrajectoryFile ned = parsed("t,x,y,z,vx,vy,vz,wx,wy,wz\n0,1,2,3,0.1,0.2,0.3,1,2,3\n", {.frame = Frame::ned_frd});
  expect_near(points(ned).velocities_mps.at(0), {0.2, 0.1, -0.3});
  expect_near(points(ned).angular_velocities_radps.at(0), {1, -2, -3});
}

TEST(TrajectoryFile, HoldsSeveralBodiesOnOneClock) {
  const TrajectoryFile file = parsed("body,t,x,y,z\nrov,10,0,0,0\nbuoy,12,5,5,0\nrov,14,1,0,0\nbuoy,20,5,6,0\n");
  ASSERT_EQ(file.bodies.size(), 2u);
  EXPECT_EQ(file.begins_at, seconds(10));
  EXPECT_EQ(points(file, 0).times, (std::vector<Ns>{seconds(0), seconds(4)}));
  EXPECT_EQ(points(file, 1).times, (std::vector<Ns>{seconds(2), seconds(10)}));
  for (const auto& b : file.bodies) EXPECT_EQ(b.trajectory->duration(), seconds(10));
  EXPECT_EQ(trajectory_of(file, "p.csv", "buoy").value(), file.bodies[1].trajectory);
  EXPECT_THAT(trajectory_of(file, "p.csv", "bouy").error().text, HasSubstr("did you mean \"buoy\""));
  EXPECT_THAT(trajectory_of(file, "p.csv", "").error().text,
              HasSubstr("the file has several bodies; choose one with the key \"body\"; there are: rov, buoy"));
  const TrajectoryFile nameless = parsed("t,x,y,z\n0,1,2,3\n");
  EXPECT_TRUE(trajectory_of(nameless, "p.csv", ""));
  EXPECT_THAT(trajectory_of(nameless, "p.csv", "rov").error().text, HasSubstr("remove the key \"body\""));
  EXPECT_THAT(refusal("body,t,x,y,z\nrov,1,0,0,0\nbuoy,0,0,0,0\nrov,0.5,0,0,0\n"),
              "p.csv:4: the time is earlier than the previous one for \"rov\"");
  EXPECT_THAT(refusal("body,t,x,y,z\n,1,0,0,0\n"), "p.csv:2: a body's name must have 1 to 64 printable characters");
}

TEST(TrajectoryFile, ReportsMistakesWithTheirLine) {
  const struct {
    const char *text, *says;
  } mistakes[] = {
      {"", "p.csv: the file has no poses"},
      {"t,x,y,z\n", "p.csv: the file has no poses"},
      {"t,x,y,z\n0,1,2\n", "p.csv:2: 3 values instead of 4"},
      {"t,x,y,z\n1,1,2,3\n0,1,2,3\n", "p.csv:3: the time is earlier than the previous one"},
      {"t,x,y,z\n0,1,two,3\n", "p.csv:2: \"two\" is not a number"},
      {"t,x,y,z\n0,1,nan,3\n", "p.csv:2: \"nan\" is not a number"},
      {"t,x,y,z\n0,1,-inf,3\n", "p.csv:2: \"-inf\" is not a number"},
      {"t,x,y,z\n0,1,1e400,3\n", "p.csv:2: \"1e400\" is not a number"},
      {"t,x,y,z\nnan,1,1,3\n", "p.csv:2: \"nan\" is not a time in seconds"},
      {"t_ns,x,y,z\n99999999999999999999,1,1,3\n", "p.csv:2: \"99999999999999999999\" is not a time in nanoseconds"},
      {"t,x,y,z\n0,1,0x10,3\n", "write it in decimal"},
      {"t,x,y,z\n0,1,\x01\x02,3\n", "p.csv:2: \"?\?\" is not a number"},
      {"t,x,y\n", "p.csv:1: column z_m is missing"},
      {"x,y,z\n", "p.csv:1: column t_s is missing"},
      {"t,t_ns,x,y,z\n", "p.csv:1: give the time once"},
      {"t,lat,lon,depth\n", "p.csv:1: column \"lat\": positions are metres; sonard_client.geodesy converts degrees"},
      {"Longitude,Latitude,t\n", "p.csv:1: column \"Longitude\": positions are metres"},
      {"t,x,y,z,yaw_dge\n", "did you mean \"yaw_deg\""},
      {"t,x,y,z,x_m\n", "p.csv:1: column x_m appears twice"},
      {"t,x,y,z,qw\n", "p.csv:1: a quaternion needs"},
      {"t,x,y,z,roll_rad,yaw\n", "p.csv:1: give all angles in one unit"},
      {"t,x,y,z,yaw_deg,yaw_rad\n", "p.csv:1: column yaw_rad appears twice"},
      {"t,x,y,z,qw,qx,qy,qz,yaw\n", "not both"},
      {"t,x,y,z,vx\n", "p.csv:1: a velocity needs"},
      {"t,x,y,z,wx,wy\n", "p.csv:1: an angular velocity needs"},
      {"0 1 2 3 0 0 0 0.5\n", "p.csv:1: the quaternion's norm is 0.5"},
      {"0 1 2 3 0 0 0 0\n", "p.csv:1: the quaternion is zero"},
      {"0 1 2 3\n", "p.csv:1: 4 values instead of 8 (TUM) or 12 (KITTI)"},
      {"0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0\n", "p.csv:2: 7 values instead of 8"},
      {"0,1,2,3,1,0,0\n", "p.csv:1: 7 values instead of 8, 11 or 17"},
      {"0.5 1 2 3 0 0 0 1 9 9 9 9\n", "p.csv:1: KITTI lines have no time"},
      {"t,x,y,z\n0,1e9,2,3\n", "p.csv:2: the position is beyond 1e8"},
      {"t,x,y,z,vx,vy,vz\n0,1,2,3,1e9,2,3\n", "p.csv:2: the velocity is beyond 1e8"},
      {"t,x,y,z,yaw\n0,1,2,3,1e9\n", "p.csv:2: an angle is beyond 1e8"},
  };
  for (const auto& m : mistakes) EXPECT_THAT(refusal(m.text), HasSubstr(m.says)) << m.text;
  EXPECT_THAT(refusal("0 1 2 3 0 0 0 1\n", {.format = Format::csv, .frame = Frame::enu_flu}),
              "p.csv:1: a CSV file begins with a line of column names: t_s,x_m,y_m,z_m,qw,qx,qy,qz");
  const ReadOptions ten_hz{.frame = Frame::enu_flu, .rate_hz = 10};
  EXPECT_THAT(refusal("0 1 2 3 0 0 0 1\n", ten_hz), "p.csv:1: the lines have times; remove rate_hz");
  EXPECT_THAT(refusal("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 -1 0\n", ten_hz),
              "p.csv:2: the first three columns of the matrix are not a rotation");
  EXPECT_THAT(refusal("2 0 0 0 0 2 0 0 0 0 2 0\n", ten_hz), HasSubstr("not a rotation"));
  EXPECT_THAT(refusal("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 0\n", {.frame = Frame::enu_flu, .rate_hz = 1e-300}),
              "p.csv:2: the time is beyond 146 years");
}

TEST(TrajectoryFile, AnglesMayBeRadians) {
  const auto yaw_deg = [](const std::string& text) {
    const Quatd q = points(parsed(text)).poses.back().orientation;
    return deg_from_rad(2 * std::atan2(q.z, q.w));
  };
  EXPECT_NEAR(yaw_deg("t,x,y,z,roll_rad,pitch_rad,yaw_rad\n0,1,2,3,0,0,1.5707963268\n"), 90, 1e-6);
  EXPECT_NEAR(yaw_deg("t,x,y,z,YAW_RAD\n0,1,2,3,-0.5235987756\n"), -30, 1e-6);
  EXPECT_NEAR(yaw_deg("t,x,y,z,yaw\n0,1,2,3,1.5707963268\n"), 1.5707963268, 1e-6);
}

TEST(TrajectoryFile, FindsAnglesThatAreNoRadians) {
  const auto largest = [](const std::string& unit, const std::string& values) {
    const std::string columns = "t_s,x_m,y_m,z_m,roll_" + unit + ",pitch_" + unit + ",yaw_" + unit + ",body\n";
    const TrajectoryFile file = parsed(columns + "0,0,0,0,0,0,1,a\n0,0,0,0,0,0,1,b\n1,0,0,0," + values + ",b\n");
    EXPECT_EQ(file.bodies.at(0).largest_angle.rad, 0) << "body a has no large angle";
    return file.bodies.at(1).largest_angle.rad;
  };
  EXPECT_EQ(largest("rad", "0,-10,90"), 90);
  EXPECT_EQ(largest("rad", "0,0.5,-7.5"), 0) << "a heading that is not wrapped";
  EXPECT_EQ(largest("deg", "0,-10,90"), 0);
}

TEST(TrajectoryFile, AMissingFileIsReported) {
  for (const char* place : {"no-such-file.csv", ".", "/dev/null"}) {
    const auto file = load_trajectories(place, enu);
    ASSERT_FALSE(file) << place;
    EXPECT_EQ(file.error().kind, ErrorKind::missing_file);
  }
}

TEST(TrajectoryFile, ErrorsForLogsNameTheConverter) {
  const std::filesystem::path file = testing::TempDir() + "poses-log-" + std::to_string(getpid());
  for (const std::string& bytes :
       {std::string("\0\5\xfd\x1c", 4), std::string("#ROSBAG V2.0\nE\0\0\0", 17), std::string("$GPGGA,1,2\n"),
        std::string("\xef\xbb\xbf<?xml version=\"1.0\"?><gpx>\n"), std::string("\n <kml>"), std::string("{\"poses\": []}\n")}) {
    std::ofstream(file, std::ios::binary) << bytes;
    const auto refused = load_trajectories(file, enu);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().text, HasSubstr("python3 -m sonard_client.convert FILE -o OUT.csv"));
    EXPECT_THAT(refused.error().text, HasSubstr("--dead-reckon M/S"));
  }
  std::filesystem::remove(file);
}

TEST(TrajectoryFile, PosesThatTheMemoryDoesNotSufficeForAreRefused) {
  const std::filesystem::path root = testing::TempDir() + "poses-memory-" + std::to_string(getpid());
  std::filesystem::create_directories(root / "proc");
  std::ofstream(root / "proc/meminfo") << "MemAvailable: 1500 kB\n";
  std::ofstream out(root / "poses.csv");
  out << "t,x,y,z,roll,pitch,yaw\n";
  for (int i = 0; i < 10000; ++i) out << i << ",0,0,0,0,0,0\n";  // 170 kB of text
  out.close();
  memory_root() = root;
  const auto refused = load_trajectories(root / "poses.csv", enu);
  memory_root() = "/";
  const auto read = load_trajectories(root / "poses.csv", enu);
  std::filesystem::remove_all(root);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(refused.error().text, HasSubstr("poses.csv would take about 1 MiB of memory, and 1 MiB are left"));
  EXPECT_TRUE(read);
}

/// Reads the examples of the page: all blocks that are marked with a format.
TEST(TrajectoryFile, TheManualsExamplesAreRead) {
  std::ifstream in(std::string(SONARD_SOURCE_DIR) + "/docs/poses.md");
  std::string line, block, format;
  std::vector<std::string> read;
  while (std::getline(in, line)) {
    if (!line.starts_with("```")) {
      block += line + "\n";
    } else if (line.size() > 3) {
      format = line.substr(3);
      block.clear();
    } else {
      if (format != "csv" && format != "tum" && format != "euroc" && format != "kitti") continue;
      ReadOptions options;  // the example states the frame
      if (format == "kitti") options.rate_hz = 10;
      const TrajectoryFile file = parsed(block, options);
      EXPECT_EQ(name_of(file.format), format) << block;
      EXPECT_GE(file.bodies.front().trajectory->size(), 2u);
      read.push_back(format);
    }
  }
  EXPECT_EQ(read, (std::vector<std::string>{"csv", "csv", "tum", "euroc", "kitti"}));
}

/// An hour at 100 Hz. The deadline is about twenty times the time that a slow computer needs.
TEST(TrajectoryFile, AnHourAt100HzIsReadQuickly) {
  constexpr int lines = 360000;
  const std::string name = testing::TempDir() + "hour" + std::to_string(getpid()) + ".tum";
  {
    std::FILE* const out = std::fopen(name.c_str(), "w");
    ASSERT_NE(out, nullptr);
    std::fprintf(out, "# frame: ENU_FLU\n");
    for (int i = 0; i < lines; ++i) {
      const double t = 0.01 * i;
      std::fprintf(out, "%.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", 1403636579.0 + t, 10 * std::cos(t / 60),
                   10 * std::sin(t / 60), -5 + 0.1 * std::sin(t), 0., 0., std::sin(t / 120), std::cos(t / 120));
    }
    ASSERT_EQ(std::fclose(out), 0);
  }
  const auto begun = std::chrono::steady_clock::now();
  const auto file = load_trajectories(name, {});
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begun;
  std::remove(name.c_str());
  ASSERT_TRUE(file) << file.error().text;
  EXPECT_EQ(file->bodies.at(0).trajectory->size(), static_cast<std::size_t>(lines));
  EXPECT_EQ(file->duration, milliseconds(10) * (lines - 1));
  RecordProperty("seconds", std::to_string(taken.count()));
  std::printf("an hour of poses at 100 Hz was read in %.3f s\n", taken.count());
  EXPECT_LT(taken.count(), 20);
}

}  // namespace
}  // namespace sonar::motion::trajectory_file_test
