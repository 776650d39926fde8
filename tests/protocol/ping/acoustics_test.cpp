// Tests pings of a Ping360, an Omniscan, a Surveyor, a Ping1D and an S500 with bodies at known positions, computed with the
// engine and compared with closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "protocol/ping/omniscan.hpp"
#include "protocol/ping/ping1d.hpp"
#include "protocol/ping/ping360_settings.hpp"
#include "protocol/ping/s500.hpp"
#include "protocol/ping/surveyor.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/protocol/ping/ping_testing.hpp"

namespace sonar::ping {
namespace {

using namespace tests;
using namespace sonar::test;

struct Scanner {
  explicit Scanner(std::shared_ptr<const Scene> scene, double speed_mps = 1500, protocol::OptionValues options = {})
      : state(device("ping360", options)) {
    state.water.sound_speed_mps = speed_mps;
    const PingSettings s = ping360::ping_settings(ping360::settings_of(transducer), state);
    sounding = std::make_unique<Sounding>(scene, state.model->modes[0], s);
    sounding->request.water = state.water;
  }
  /// Returns the samples of a ping at this angle.
  std::vector<int> at(std::uint16_t angle) {
    const Ping& ping = sounding->ping_from({}, {0, 0, ping360::head_rad(angle, state.options)});
    std::vector<int> samples;
    for (const std::byte b : ping.samples) samples.push_back(std::to_integer<int>(b));
    return samples;
  }
  std::uint16_t brightest_angle() {
    std::uint16_t best = 0;
    int top = -1;
    for (std::uint16_t angle = 0; angle < 400; ++angle) {
      const auto samples = at(angle);
      if (const int most = *std::max_element(samples.begin(), samples.end()); most > top) top = most, best = angle;
    }
    return best;
  }

  Transducer transducer{1, 0, 0, 10, 88, 750, 1200, 1, 0};  // 1.65 mm per sample at 1500 m/s
  protocol::DeviceState state;
  std::unique_ptr<Sounding> sounding;
};

/// Returns the first sample of at least half the highest amplitude, 6 dB below it (255 codes are 60 dB).
int half_maximum(const std::vector<int>& samples) {
  const int top = *std::max_element(samples.begin(), samples.end());
  EXPECT_GT(top, 60);
  EXPECT_LT(top, 255) << "saturated";
  const auto first = std::find_if(samples.begin(), samples.end(), [&](int v) { return v >= top - 6 * 255 / 60; });
  return static_cast<int>(first - samples.begin());
}

std::shared_ptr<const Scene> wall_at(double x_m) { return SceneMaker().add(wall(1, 1), -25, {x_m, 0, 0}).make(); }
std::shared_ptr<const Scene> ball_at(Vec3d at) { return SceneMaker().add(sphere(0.03, 4), -10, at).make(); }

TEST(Ping360Acoustics, AWallIsAtTheRangeForTheHostsSoundSpeed) { EXPECT_NEAR(half_maximum(Scanner(wall_at(1.5)).at(0)), 908, 5); }

TEST(Ping360Acoustics, AnotherSoundSpeedMovesTheWall) {
  EXPECT_NEAR(half_maximum(Scanner(wall_at(1.5), 1450).at(0)), 1.5 / (88 * 25e-9 * 1450 / 2) - 1, 5);
}

TEST(Ping360Acoustics, ABallIsBrightestAtItsBearing) {
  EXPECT_NEAR(Scanner(ball_at({0, -1.2, 0})).brightest_angle(), 100, 1) << "a ball to starboard";
  EXPECT_NEAR(Scanner(ball_at({0, 1.2, 0})).brightest_angle(), 300, 1) << "a ball to port";
  EXPECT_NEAR(Scanner(ball_at({0, -1.2, 0}), 1500, {{"mount_grad", "30"}}).brightest_angle(), 70, 1);
  EXPECT_NEAR(Scanner(ball_at({-1, 1, 0})).brightest_angle(), 250, 1) << "a ball astern to port";
}

TEST(Ping360Acoustics, ABallIsBrightestAtItsRange) {
  for (const double range_m : {0.5, 1.0, 1.7}) {
    const auto samples = Scanner(ball_at({range_m, 0, 0})).at(0);
    const auto top = std::max_element(samples.begin(), samples.end()) - samples.begin();
    EXPECT_NEAR((static_cast<double>(top) + 1) * 88 * 25e-9 * 750, range_m - 0.03, 0.015) << range_m;
  }
}

TEST(Ping360Acoustics, AStepOfGainIsSixDecibels) {
  Scanner low(wall_at(1.5)), high(wall_at(1.5));
  Transducer louder = low.transducer;
  louder.gain = 1;
  high.sounding->request.settings.gain_db = ping360::ping_settings(ping360::settings_of(louder), high.state).gain_db;
  const auto a = low.at(0), b = high.at(0);
  EXPECT_NEAR(*std::max_element(b.begin(), b.end()) - *std::max_element(a.begin(), a.end()), 25.5, 1.5);
}

// ---- Omniscan

/// A side-scan that looks to starboard, 30 degrees down, 3 m above a bed.
struct SideScan {
  explicit SideScan(std::shared_ptr<const Scene> scene) {
    omniscan::Settings settings;
    settings.parameters = {.length_mm = 10000, .results = 1000, .enable = 1};
    sounding = std::make_unique<Sounding>(scene, state.model->modes[0], omniscan::ping_settings(settings));
    sounding->request.vendor_settings = std::make_shared<omniscan::HeldSettings>(settings);
  }
  /// Returns the powers [dB] of a ping with rows of 10 mm.
  std::vector<double> ping(double x_m = 0, double yaw_rad = -pi / 2) {
    sounding->request.sonar_in_world = {{x_m, 0, 0}, quat_from_rpy({0, pi / 6, yaw_rad})};
    sounding->request.number = PingNumber(1);
    const Frame frame = frames_in({omniscan::profile_of(sounding->ping(), state)}).at(0);
    const auto profile = message_in<OsMonoProfile>(frame);
    wire::Reader reader(BytesView(frame.payload).subspan(wire::wire_size<OsMonoProfile>()));
    std::vector<double> db;
    for (std::uint16_t i = 0, v = 0; i < profile.results; ++i) {
      reader("power", v);
      db.push_back(static_cast<double>(profile.lowest_db) +
                   v / 65535.0 * static_cast<double>(profile.highest_db - profile.lowest_db));
    }
    EXPECT_TRUE(reader.ok() && reader.remaining() == 0);
    return db;
  }
  protocol::DeviceState state = device("omniscan-450");
  std::unique_ptr<Sounding> sounding;
};

double loudest(const std::vector<double>& db) { return *std::max_element(db.begin(), db.end()); }

TEST(OmniscanAcoustics, PortAndStarboardAreNotSwapped) {
  SideScan side(ball_at({0, -4, -2}));
  const double starboard = loudest(side.ping(0, -pi / 2)), port = loudest(side.ping(0, pi / 2));
  EXPECT_GT(starboard, port + 40);
  EXPECT_LT(starboard, 80) << "saturated";
}

TEST(OmniscanAcoustics, ABallIsAtItsRangeAndWithinTheNarrowBeam) {
  for (const double y_m : {2.0, 4.0, 8.0}) {
    SideScan side(ball_at({0, -y_m, -1}));
    const auto db = side.ping();
    const auto top = std::max_element(db.begin(), db.end()) - db.begin();
    EXPECT_NEAR((static_cast<double>(top) + 0.5) * 0.01, std::hypot(y_m, 1.0) - 0.03, 0.03) << y_m;
    EXPECT_LT(loudest(side.ping(y_m * std::tan(rad_from_deg(1.5)))), loudest(db) - 10)
        << "the ball is 1.5 degrees along the track";
  }
}

TEST(OmniscanAcoustics, TheBeamIsWideAcrossTheTrack) {
  const auto at = [](double down_deg) {
    const double a = rad_from_deg(down_deg);
    return loudest(SideScan(SceneMaker().add_point({0, -4 * std::cos(a), -4 * std::sin(a)}, -30).make()).ping());
  };
  EXPECT_NEAR(at(30 - 15), at(30 + 15), 1);
  EXPECT_GT(at(10), at(30) - 8);
  EXPECT_LT(at(85), at(30) - 8);
}

TEST(OmniscanAcoustics, TheBedBeginsUnderTheSonar) {
  SideScan side(SceneMaker().add(height_field(-0.5, 0.5, -12, 1, 0.1, [](double, double) { return -3; }), -25).make());
  const auto db = side.ping();
  const auto loudest_from = [&](double from_m, double to_m) {
    return *std::max_element(db.begin() + static_cast<int>(100 * from_m), db.begin() + static_cast<int>(100 * to_m));
  };
  EXPECT_GT(loudest_from(3.2, 6), loudest_from(0.5, 2.8) + 30);
}

// ---- Surveyor

struct Sounder {
  explicit Sounder(std::shared_ptr<const Scene> scene, int end_mm = 10000) {
    surveyor::Settings settings;
    settings.parameters = {.end_mm = end_mm, .enable = 1};
    sounding = std::make_unique<Sounding>(scene, state.model->modes[0], surveyor::ping_settings(settings));
    sounding->request.switches.noise = true;
    sounding->request.vendor_settings = std::make_shared<surveyor::HeldSettings>(settings);
  }
  std::vector<Frame> ping(std::uint32_t number, double roll_rad = 0, double x_m = 0) {
    const Pose vehicle{{x_m, 0, 0}, quat_from_rpy({roll_rad, 0, 0})}, mount{{}, quat_from_rpy({0, pi / 2, 0})};
    sounding->request.sonar_in_world = compose(vehicle, mount);
    sounding->request.number = PingNumber(number);
    return frames_in(surveyor::frames_of(sounding->ping(), state));
  }
  protocol::DeviceState state = device("surveyor-240");
  std::unique_ptr<Sounding> sounding;
};

struct Points {
  std::vector<double> y, z;
};
Points points_in(const Frame& frame) {
  const auto data = message_in<YzPointData>(frame);
  Points points;
  wire::Reader reader(BytesView(frame.payload).subspan(wire::wire_size<YzPointData>()));
  for (int i = 0; i < data.points; ++i) {
    float y = 0, z = 0;
    reader("y", y);
    reader("z", z);
    points.y.push_back(static_cast<double>(y));
    points.z.push_back(static_cast<double>(z));
  }
  EXPECT_TRUE(reader.ok() && reader.remaining() == 0);
  return points;
}
double slope_of(const Points& p) {
  double n = 0, y = 0, z = 0, yy = 0, yz = 0;
  for (std::size_t i = 0; i < p.y.size(); ++i) ++n, y += p.y[i], z += p.z[i], yy += p.y[i] * p.y[i], yz += p.y[i] * p.z[i];
  return (n * yz - y * z) / (n * yy - y * y);
}
std::shared_ptr<const Scene> bed(double slope, double altitude_m = 5, double strength_db = -25) {
  const double half_m = 3.2 * altitude_m;
  const auto height_m = [=](double, double y) { return -altitude_m + slope * y; };
  return SceneMaker()
      .add(height_field(-half_m / 2, half_m / 2, -half_m, half_m, altitude_m / 10, height_m), static_cast<float>(strength_db))
      .make();
}

TEST(SurveyorAcoustics, AFlatBottomIsMeasuredFlat) {
  Sounder sounder(bed(0));
  for (std::uint32_t number = 1; number <= 20; ++number) {
    const Points points = points_in(sounder.ping(number)[2]);
    EXPECT_EQ(points.y.size(), 16u);
    EXPECT_GT(points.y.front(), 2.5) << "the first point is to port";
    EXPECT_LT(points.y.back(), -2.5);
    for (std::size_t i = 0; i < points.z.size(); ++i) EXPECT_NEAR(points.z[i], -5, 0.05) << number << " y " << points.y[i];
  }
}

// The tolerance of 0.02 times the altitude is 4 steps (400 steps reach twice the altitude), a few pulses long.
TEST(SurveyorAcoustics, BedsHaveAPointInEachDirection) {
  for (const double altitude_m : {2.0, 12.0})
    for (const double slope_deg : {0.0, 10.0, -20.0})
      for (const double strength_db : {-15.0, -35.0}) {
        const double slope = std::tan(rad_from_deg(slope_deg));
        Sounder sounder(bed(slope, altitude_m, strength_db), static_cast<int>(2000 * altitude_m));
        for (std::uint32_t number = 1; number <= 4; ++number) {
          const Points points = points_in(sounder.ping(number, 0, 0.3 * number)[2]);
          EXPECT_EQ(points.y.size(), 16u) << altitude_m << " m, " << slope_deg << ", " << strength_db << " dB";
          for (std::size_t i = 0; i < points.z.size(); ++i)
            EXPECT_NEAR(points.z[i], -altitude_m + slope * points.y[i], 0.02 * altitude_m) << points.y[i];
        }
      }
}

TEST(SurveyorAcoustics, ASmallTargetIsOnePoint) {
  for (double azimuth = -39; azimuth < 39.5; azimuth += 2.6) {
    const double a = rad_from_deg(azimuth);
    Sounder sounder(SceneMaker().add_point({0, 5 * std::sin(a), -5 * std::cos(a)}, -30).make());
    const Points points = points_in(sounder.ping(1)[2]);
    ASSERT_EQ(points.y.size(), 1u) << azimuth;
    EXPECT_NEAR(points.y[0], 5 * std::sin(a), 0.03) << azimuth;
    EXPECT_NEAR(points.z[0], -5 * std::cos(a), 0.03) << azimuth;
  }
}

TEST(SurveyorAcoustics, ASlopeIsMeasured) {
  Sounder sounder(bed(std::tan(rad_from_deg(10))));
  for (std::uint32_t number = 1; number <= 5; ++number)
    EXPECT_NEAR(deg_from_rad(std::atan(slope_of(points_in(sounder.ping(number)[2])))), 10, 0.5);
}

TEST(SurveyorAcoustics, RollIsInTheUpVectorAndInThePoints) {
  Sounder sounder(bed(0));
  const double roll_rad = rad_from_deg(5);
  const auto frames = sounder.ping(1, roll_rad);
  const auto up = message_in<AttitudeReport>(frames[0]).up;
  EXPECT_NEAR(up[0], 0, 0.002);
  EXPECT_NEAR(up[1], std::sin(roll_rad), 0.002);
  EXPECT_NEAR(up[2], std::cos(roll_rad), 0.002);
  const Points points = points_in(frames[2]);
  for (std::size_t i = 0; i < points.z.size(); ++i)  // along the up vector, all points are 5 m down
    EXPECT_NEAR(points.y[i] * static_cast<double>(up[1]) + points.z[i] * static_cast<double>(up[2]), -5, 0.05);
}

TEST(SurveyorAcoustics, WithoutABottomThereAreNoPoints) {
  Sounder sounder(SceneMaker().add_point({0, 0, 50}, -40).make());
  EXPECT_EQ(message_in<AtofPointData>(sounder.ping(1)[1]).points, 0);
}

// ---- Ping1D

/// An altimeter that looks down, in automatic mode.
struct Altimeter {
  explicit Altimeter(std::shared_ptr<const Scene> scene, double speed_mps = 1500) {
    settings.parameters.speed_mm_per_s = static_cast<std::uint32_t>(1000 * speed_mps);
    sounding = std::make_unique<Sounding>(scene, state.model->modes[0], ping1d::ping_settings(settings));
    sounding->request.switches.noise = true;
  }
  /// Returns the echo of a ping from this position, pitched by this angle from straight down, after range and gain have settled.
  ping1d::Echo echo(double x_m = 0, double pitch_rad = 0) {
    ping1d::Echo found;
    for (int i = 0; i < 12; ++i) {
      sounding->request.settings = ping1d::ping_settings(settings);
      sounding->request.vendor_settings = std::make_shared<ping1d::HeldSettings>(settings);
      sounding->request.sonar_in_world = {{x_m, 0, 0}, quat_from_rpy({0, pi / 2 + pitch_rad, 0})};
      sounding->request.number = PingNumber(static_cast<std::uint32_t>(i + 1));
      found = ping1d::find_echo(sounding->ping());
      const ping1d::Parameters next = ping1d::adjusted(settings.parameters, found);
      if (next == settings.parameters) return found;
      settings.parameters = next;
    }
    ADD_FAILURE() << "range and gain do not settle";
    return found;
  }
  protocol::DeviceState state = device("ping1d");
  ping1d::Settings settings;
  std::unique_ptr<Sounding> sounding;
};

TEST(Ping1DAcoustics, TheBedIsAtItsDistance) {
  for (const double altitude_m : {0.6, 1.5, 5.0, 20.0})
    for (const double strength_db : {-15.0, -35.0}) {
      Altimeter altimeter(bed(0, altitude_m, strength_db));
      for (const double x_m : {0.0, 0.1, 0.2, 0.3}) {
        const ping1d::Echo echo = altimeter.echo(x_m * altitude_m);
        const auto pulse_m =
            static_cast<double>(altimeter.sounding->request.settings.pulse_width_m);  // pulses are at least one point long
        EXPECT_NEAR(echo.range_m, altitude_m, 1.5 * pulse_m) << altitude_m << " m, " << strength_db << " dB";
        EXPECT_GE(echo.confidence, 50);
      }
    }
}

TEST(Ping1DAcoustics, ATiltedBeamMeasuresToTheNearestGround) {
  for (const double pitch_deg : {0.0, 5.0, 10.0, 15.0, 20.0, 30.0}) {
    Altimeter altimeter(bed(0));
    const ping1d::Echo echo = altimeter.echo(0, rad_from_deg(pitch_deg));
    EXPECT_NEAR(echo.range_m, 5, 0.1) << pitch_deg;  // the beam is wide enough for an echo of the ground straight below
  }
}

TEST(Ping1DAcoustics, AnotherSoundSpeedScalesTheDistance) {
  Altimeter altimeter(bed(0), 1350);  // the speed of sound in the water is 1500 m/s
  EXPECT_NEAR(altimeter.echo().range_m, 4.5, 0.1);
}

TEST(Ping1DAcoustics, AWallAheadIsMeasuredByABeamThatLooksAhead) {
  Altimeter altimeter(SceneMaker().add(wall(4, 4), -25, {3, 0, 0}).make());
  EXPECT_NEAR(altimeter.echo(0, -pi / 2).range_m, 3, 0.06);
}

TEST(Ping1DAcoustics, OpenWaterGivesLowConfidence) {
  Altimeter altimeter(SceneMaker().add_point({0, 0, 50}, -40).make());
  altimeter.settings.parameters = {.range = {0, 20000}, .gain = 6, .mode_auto = 0};
  altimeter.sounding->request.settings = ping1d::ping_settings(altimeter.settings);
  altimeter.sounding->request.sonar_in_world = {{}, quat_from_rpy({0, pi / 2, 0})};
  for (std::uint32_t number = 1; number <= 20; ++number) {
    altimeter.sounding->request.number = PingNumber(number);
    EXPECT_LT(ping1d::find_echo(altimeter.sounding->ping()).confidence, 20);
  }
}

// ---- S500

/// The device uses automatic range and gain.
TEST(S500Acoustics, TheBedIsAtItsDistance) {
  for (const double altitude_m : {0.6, 1.5, 5.0, 20.0, 60.0})
    for (const double strength_db : {-15.0, -35.0}) {
      s500::Settings settings;
      settings.parameters = s500::requested({}, {.length_mm = 0, .report = Id::s500_profile6});
      Sounding sounding(bed(0, altitude_m, strength_db), s500::models().front()->modes[0], s500::ping_settings(settings));
      sounding.request.switches.noise = true;
      sounding.request.sonar_in_world = {{0, 0, 0}, quat_from_rpy({0, pi / 2, 0})};
      Echo echo;
      for (std::uint32_t number = 1; number <= 12; ++number) {
        sounding.request.settings = s500::ping_settings(settings);
        sounding.request.vendor_settings = std::make_shared<s500::HeldSettings>(settings);
        sounding.request.number = PingNumber(number);
        const Ping ping = sounding.ping();
        echo = find_echo(ping);
        settings = s500::after(ping, settings);
      }
      const auto pulse_m = static_cast<double>(sounding.request.settings.pulse_width_m);
      EXPECT_NEAR(echo.range_m, altitude_m, 1.5 * pulse_m + 0.002 * altitude_m) << altitude_m << " m, " << strength_db << " dB";
      EXPECT_GE(echo.confidence, 50) << altitude_m << " m, " << strength_db << " dB, gain " << settings.parameters.reach.gain;
      EXPECT_NEAR(settings.parameters.reach.length_mm, 1000 * altitude_m / 0.6, 400 * altitude_m / 0.6 + 500);
    }
}

}  // namespace
}  // namespace sonar::ping
