// A sonar that moves during its ping: bearings are those at the time of reception, ranges those at the time of scattering.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

/// Returns the azimuth of the beam with the highest level near a range, interpolated between beams [deg].
double bearing_deg(const Sounding& s, double range_m) {
  const int row = static_cast<int>(std::lround(s.row_of_range(range_m)));
  const int beam = s.loudest_beam(row);
  const Peak peak = log_parabola(s.pressure(row, beam - 1), s.pressure(row, beam), s.pressure(row, beam + 1));
  const double step = s.beam_sine(beam + 1) - s.beam_sine(beam);
  return deg_from_rad(std::asin(s.beam_sine(beam) + peak.offset * step));
}

/// Returns the mean azimuth of all power from slightly before a range on [deg].
double centroid_deg(const Sounding& s, double range_m) {
  double sum = 0, turned = 0;
  for (int row = static_cast<int>(s.row_of_range(range_m - 0.1)); row < s.row_of_range(range_m + 0.3); ++row)
    for (int j = 0; j < s.beams(); ++j) sum += s.power(row, j), turned += s.power(row, j) * std::asin(s.beam_sine(j));
  return deg_from_rad(turned / sum);
}

/// Returns an upright, round, closed surface about the origin.
Mesh pole(double radius_m, double half_height_m) {
  constexpr std::uint32_t sides = 64;
  Mesh mesh;
  for (std::uint32_t i = 0; i < sides; ++i)
    for (const double z : {-half_height_m, half_height_m}) {
      const double a = 2 * pi * i / sides;
      mesh.vertices.push_back(to_float({radius_m * std::cos(a), radius_m * std::sin(a), z}));
    }
  for (std::uint32_t i = 0; i < 2 * sides; i += 2) {
    const std::uint32_t n = (i + 2) % (2 * sides);
    mesh.triangles.insert(mesh.triangles.end(), {{i, n, n + 1}, {i, n + 1, i + 1}});
    if (i > 0 && n > 0) mesh.triangles.insert(mesh.triangles.end(), {{n, i, 0}, {i + 1, n + 1, 1}});
  }
  return mesh;
}

/// Returns two upright poles, 2 cm thick, on boresight at 2 and 10 m. The far pole is visible above the near one.
std::shared_ptr<const Scene> two_poles() {
  SceneMaker maker;
  maker.add(box({0.01, 0.01, 0.1}), -10, {2.01, 0, -0.15});
  maker.add(box({0.01, 0.01, 0.3}), -10, {10.01, 0, 0.35});
  return maker.make();
}

Sounding looking_at(std::shared_ptr<const Scene> scene) {
  PingSettings settings = default_rows(11, 480);
  settings.beam_count = 512;
  return Sounding(std::move(scene), oculus_high(), settings);
}

constexpr double yaw_rate_deg_per_s = 40;
const Twist turning_to_port{{}, {0, 0, rad_from_deg(yaw_rate_deg_per_s)}};

TEST(Motion, O40APoleFartherAwayIsTurnedFartherByAYaw) {
  const double expected = yaw_rate_deg_per_s * 2 * 8 / 1500;
  for (const bool points : {false, true}) {
    SceneMaker maker;
    maker.add_point({2, 0, 0}, -20).add_point({10, 0, 0}, 0);
    Sounding s = looking_at(points ? maker.make() : two_poles());
    s.request.switches.expected_power = true;
    s.ping();
    EXPECT_NEAR(bearing_deg(s, 2), 0, 0.02);
    EXPECT_NEAR(bearing_deg(s, 10), 0, 0.02);
    s.request.sonar_moves = turning_to_port;
    s.ping();
    // The sonar turns to port, so objects appear farther to starboard the later their echoes are received.
    record_oracle(40, points ? "yaw during the ping, points at 2 and 10 m" : "yaw during the ping, poles at 2 and 10 m", expected,
                  bearing_deg(s, 2) - bearing_deg(s, 10), 0.1 * expected, "deg");
    EXPECT_NEAR(bearing_deg(s, 10), -yaw_rate_deg_per_s * 2 * 10 / 1500, 0.1 * expected);
  }
}

// Objects are hidden in the directions of the rays, not in those of reception.
TEST(Motion, O40TurnsShowNoFarSides) {
  constexpr double near_m = 2, far_m = 10;
  for (const double deg_per_s : {-40.0, 40.0, 60.0, 120.0}) {
    for (const double radius : {0.01, 0.025, 0.05, 0.1, 0.2}) {
      SceneMaker maker;
      maker.add(pole(radius, 0.1), -10, {near_m + radius, 0, -0.15});
      maker.add(pole(radius, 0.3), -10, {far_m + radius, 0, 0.35});
      Sounding s = looking_at(maker.make());
      s.request.switches.expected_power = true;
      s.request.sonar_moves = {{}, {0, 0, rad_from_deg(deg_per_s)}};
      s.ping();
      const double expected = deg_per_s * 2 * (far_m - near_m) / 1500;
      record_oracle(40, "poles of 2 to 40 cm, yaw of 40 to 120 degrees/s", expected,
                    centroid_deg(s, near_m) - centroid_deg(s, far_m),
                    std::abs(deg_per_s) > 100 ? 0.05 : 0.05 * std::abs(expected), "deg");
    }
  }
}

// In a quick turn the directions of near cells at scattering differ much from those at reception, and lie outside the map of
// their group.
TEST(Motion, IsTheSameForAnyNumberOfThreads) {
  SceneMaker maker;
  for (const double y : {-0.15, -0.05, 0.05, 0.15}) maker.add(pole(0.02, 0.05), -10, {0.3, y, 0});
  maker.add(wall(6, 6), -15, {3, 0, 0});
  std::vector<std::byte> first;
  for (const int threads : {1, 2, 3}) {
    Sounding s(maker.make(), oculus_high(), native_rows(10, 0.1), {.threads = threads, .engine = {}});
    s.request.sonar_moves = {{0, 3, 0}, {0, 0, rad_from_deg(60)}};
    const Ping& ping = s.ping();
    if (first.empty()) first = ping.samples;
    EXPECT_TRUE(first == ping.samples) << threads << " threads";
  }
}

TEST(Motion, RangeIsThatOfTheBounce) {
  constexpr double speed = 12, range = 9;
  for (const Vec3d velocity : {Vec3d{speed, 0, 0}, Vec3d{-speed, 0, 0}, Vec3d{0, speed, 0}}) {
    for (const bool point : {true, false}) {
      SceneMaker maker;
      if (point)
        maker.add_point({range, 0, 0}, 0);
      else
        maker.add(wall(0.2, 0.2), -10, {range, 0, 0});
      Sounding s(maker.make(), oculus_high(), native_rows(10, 0.02));
      s.request.switches.expected_power = true;
      const auto place = [&] {
        s.ping();
        const int row = s.loudest_row(256);
        const Peak peak = log_parabola(s.pressure(row - 1, 256), s.pressure(row, 256), s.pressure(row + 1, 256));
        return s.range_of_row(row + peak.offset);
      };
      const double at_rest = place();
      s.request.sonar_moves = {velocity, {}};
      EXPECT_NEAR(place() - at_rest, -velocity.x * range / 1500, 2e-3) << velocity.x << " " << velocity.y << " " << point;
    }
  }
}

TEST(Motion, ChangesNoByteAtRestOrWithoutTheSwitch) {
  SceneMaker maker;
  maker.add(height_field(-2, 14, -8, 8, 2, [](double, double) { return 0.0; }), -20).add_point({6, 1, 1}, -20);
  Sounding s = looking_at(maker.make());
  s.request.sonar_in_world = {{0, 0, 1.5}, quat_from_rpy({0, 0.2, 0})};
  s.request.switches.noise = true;
  s.request.switches.motion = false;
  const Ping at_rest = s.ping();
  s.request.sonar_moves = {{1, 0.5, 0}, {0, 0, 0.5}};
  EXPECT_EQ(s.ping().samples, at_rest.samples) << "off";
  s.request.switches.motion = true;
  EXPECT_NE(s.ping().samples, at_rest.samples);
  s.request.sonar_moves = {};
  EXPECT_EQ(s.ping().samples, at_rest.samples) << "at rest";
}

TEST(Motion, AWorldThatMovesTheOtherWayLooksTheSame) {
  // Range and bearing depend only on relative motion. A sonar in steady motion sees at the far end the same as a sonar at the
  // position and heading at which that echo is received.
  SceneMaker maker;
  maker.add(height_field(-4, 16, -10, 10, 0.5, rough_relief(0.05, 12)), -20);
  Sounding s = looking_at(maker.make());
  s.request.switches.expected_power = true;
  const Pose start{{0, 0, 1.5}, quat_from_rpy({0, 0.2, 0})};
  const double at_m = 8, one_way_s = at_m / 1500;
  const Twist twist{{2, 0, 0}, {0, 0, rad_from_deg(20)}};
  s.request.sonar_in_world = start;
  s.request.sonar_moves = twist;
  s.ping();
  const auto rows_about = [&](const Sounding& from) {
    std::vector<double> all;
    const int middle = static_cast<int>(from.row_of_range(at_m));
    for (int row = middle - 4; row <= middle + 4; ++row)
      for (int j = 30; j < 482; ++j) all.push_back(std::log(from.power(row, j) + 1));
    return all;
  };
  const std::vector<double> moving = rows_about(s);
  s.request.sonar_in_world = {start.position_m + one_way_s * twist.velocity_mps,
                              start.orientation * turned_by(2 * one_way_s * twist.angular_rate_radps)};
  s.request.sonar_moves = {};
  s.ping();
  EXPECT_GT(correlation(moving, rows_about(s)), 0.98);
}

}  // namespace
}  // namespace sonar::test
