// Tests the beams of a DVL over ground at known positions, computed with the whole engine.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/protocol/dvl/dvl_testing.hpp"

namespace sonar::dvl {
namespace {

using namespace tests;
using namespace sonar::test;

/// A DVL that looks down, and the state of the device, which changes with each ping.
struct Dvl {
  explicit Dvl(std::shared_ptr<const Scene> scene, std::size_t model = 0) : state(device(model)) {
    sounding = std::make_unique<Sounding>(scene, state.model->modes[0], vendor().initial_settings(state).settings);
    sounding->request.model = state.model;
    sounding->request.switches.noise = true;
    sounding->request.water.sound_speed_mps = 1475;
    sounding->request.fired_at = Time(std::chrono::seconds(1'700'000'000));
    settings = vendor().initial_settings(state).settings;
  }
  Measurement ping(Vec3d at, RollPitchYaw vehicle = {}, Vec3d moves_mps = {}) {
    PingRequest& r = sounding->request;
    const Pose mount{{}, quat_from_rpy({0, pi / 2, 0})};
    r.sonar_in_world = compose({at, quat_from_rpy(vehicle)}, mount);
    r.sonar_moves.velocity_mps = moves_mps;
    r.settings = settings;
    r.vendor_settings = state.settings;
    r.number = PingNumber{++number};
    r.fired_at += std::chrono::milliseconds(100);
    const Ping& made = sounding->ping();
    const auto next = vendor().after_ping(made, state);
    const Measurement m = measure(made);
    state.settings = next->vendor_settings;
    settings = next->settings;
    return m;
  }
  /// Returns the measurement of the ninth ping at this position; the device may need eight to find the ground.
  Measurement settled(Vec3d at, RollPitchYaw vehicle = {}, Vec3d moves_mps = {}) {
    for (int i = 0; i < 8; ++i) ping(at, vehicle, moves_mps);
    return ping(at, vehicle, moves_mps);
  }
  int mode() const { return settings_from(state.settings.get()).mode; }

  protocol::DeviceState state;
  PingSettings settings;
  std::unique_ptr<Sounding> sounding;
  std::uint32_t number = 0;
};

std::shared_ptr<const Scene> bed(double z_m, double lambert_db = -25) {
  return SceneMaker().add(height_field(-150, 150, -150, 150, 10, [=](double, double) { return z_m; }), lambert_db).make();
}

TEST(DvlAcoustics, FindsTheGroundAtEveryAltitude) {
  const std::pair<double, int> altitudes[]{{0.2, 0}, {0.5, 0}, {1, 1}, {2.5, 2}, {8, 2}, {25, 3}, {45, 4}};
  for (const auto& [altitude_m, mode] : altitudes) {
    SCOPED_TRACE(altitude_m);
    Dvl dvl(bed(-altitude_m));
    const Measurement m = dvl.settled({}, {}, {0.5, -0.2, 0.1});
    ASSERT_TRUE(m.is_valid);
    EXPECT_NEAR(m.altitude_m, altitude_m, 0.01 + 0.01 * altitude_m);
    EXPECT_EQ(dvl.mode(), mode);
    EXPECT_NEAR(m.velocity_mps.x, 0.5, 0.03);
    EXPECT_NEAR(m.velocity_mps.y, 0.2, 0.03);
    EXPECT_NEAR(m.velocity_mps.z, -0.1, 0.01);
  }
}

TEST(DvlAcoustics, TheForwardBeamsReachTheGroundThatRisesAhead) {
  Dvl dvl(SceneMaker().add(height_field(-20, 20, -20, 20, 0.5, [](double x, double) { return -5 + 0.3 * x; }), -25).make());
  const Measurement m = dvl.settled({});
  ASSERT_TRUE(m.is_valid);
  EXPECT_LT(m.beams[2].distance_m, m.beams[0].distance_m - 0.5) << "the beam forward to port";
  EXPECT_LT(m.beams[3].distance_m, m.beams[1].distance_m - 0.5) << "the beam forward to starboard";
  EXPECT_NEAR(m.altitude_m, 5, 0.1);
}

TEST(DvlAcoustics, TheStarboardBeamsReachTheGroundThatRisesToStarboard) {
  Dvl dvl(SceneMaker().add(height_field(-20, 20, -20, 20, 0.5, [](double, double y) { return -5 - 0.3 * y; }), -25).make());
  const Measurement m = dvl.settled({});
  ASSERT_TRUE(m.is_valid);
  EXPECT_LT(m.beams[0].distance_m, m.beams[1].distance_m - 0.5) << "the ground rises to starboard";
  EXPECT_LT(m.beams[3].distance_m, m.beams[2].distance_m - 0.5);
}

TEST(DvlAcoustics, HasNoVelocityWithoutAnEchoOfTheGround) {
  for (const double altitude_m : {80.0, 0.02}) {
    Dvl dvl(bed(-altitude_m));
    int valid = 0;
    for (int i = 0; i < 20; ++i) valid += dvl.ping({}).is_valid;
    EXPECT_EQ(valid, 0) << altitude_m;
  }
  Dvl far(bed(-80), 1);
  EXPECT_TRUE(far.settled({}).is_valid) << "an A125 reaches the ground";
}

TEST(DvlAcoustics, SoftGroundIsLostAtLowerAltitudes) {
  const auto valid = [](double lambert_db) {
    Dvl dvl(bed(-40, lambert_db));
    int count = 0;
    for (int i = 0; i < 40; ++i) count += dvl.ping({}).is_valid;
    return count;
  };
  EXPECT_GT(valid(-25), 20);
  EXPECT_LT(valid(-55), 5);
}

TEST(DvlAcoustics, ABeamOverAnEdgeIsLostAndThreeRemain) {
  // The ground is missing ahead to starboard.
  Dvl dvl(SceneMaker()
              .add(height_field(-20, 0.3, -20, 20, 0.5, [](double, double) { return -5; }), -25)
              .add(height_field(0.3, 20, 0.3, 20, 0.5, [](double, double) { return -5; }), -25)
              .make());
  const Measurement m = dvl.settled({}, {}, {0.5, 0, 0});
  EXPECT_FALSE(m.beams[3].is_valid);
  EXPECT_TRUE(m.beams[0].is_valid && m.beams[1].is_valid && m.beams[2].is_valid);
  ASSERT_TRUE(m.is_valid);
  EXPECT_NEAR(m.velocity_mps.x, 0.5, 0.05);
}

}  // namespace
}  // namespace sonar::dvl
