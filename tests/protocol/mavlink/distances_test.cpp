// Tests DISTANCE_SENSOR: each field, the encoded bytes, and which distances a link sends.
#include "protocol/mavlink/distances.hpp"

#include <limits>

#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink::distances_test {
namespace {

/// Returns the orientation of a sensor with this roll, pitch and yaw in FLU axes.
Quatd mounted(double roll_deg, double pitch_deg, double yaw_deg) {
  return quat_from_rpy({rad_from_deg(roll_deg), rad_from_deg(pitch_deg), rad_from_deg(yaw_deg)});
}
Measured two_metres() {
  Measured m;
  m.boot_ms = 0x01020304;
  m.range_m = 2.004;
  m.confidence_percent = 90;
  m.nearest_m = 0.3, m.farthest_m = 100;
  m.horizontal_rad = 0.5, m.vertical_rad = 0.25;
  m.sensor_in_body = mounted(0, 90, 0);
  m.sensor = 1;
  return m;
}
DistanceSensor at_ms(std::uint32_t ms, std::uint8_t sensor = 0) {
  DistanceSensor m;
  m.boot_ms = ms, m.sensor = sensor;
  return m;
}

TEST(DistanceSensorMessage, EachFieldIsInItsPlace) {
  Identity sender{7, 193, 5};
  const Bytes frame = framed(distance_sensor_of(two_metres()), sender);
  const Bytes expected = bytes({0xFD, 39, 0,    0,    5,   7, 193,  132,  0, 0,  // header
                                4,    3,  2,    1,                               // time_boot_ms
                                30,   0,  0x10, 0x27, 200, 0,                    // min, max and current distance, cm
                                1,    1,  25,   255,                             // ultrasound, id, down, covariance unknown
                                0,    0,  0,    0x3F, 0,   0, 0x80, 0x3E,        // fields of view: 0.5, 0.25
                                0,    0,  0,    0,    0,   0, 0,    0,    0, 0, 0, 0, 0, 0, 0, 0,  // quaternion: not used
                                90});
  ASSERT_EQ(frame.size(), expected.size() + 2);
  EXPECT_EQ(Bytes(frame.begin(), frame.end() - 2), expected);
  const std::uint16_t crc = checksum(bytes({85}), checksum(BytesView(expected).subspan(1)));
  EXPECT_EQ(frame[frame.size() - 2], static_cast<std::byte>(crc & 0xFF));
  EXPECT_EQ(frame.back(), static_cast<std::byte>(crc >> 8));
}

TEST(DistanceSensorMessage, ZerosAtTheEndAreLeftOut) {
  Identity sender;
  EXPECT_EQ(std::to_integer<int>(framed(at_ms(1), sender).at(1)), 14) << "the last field that is not 0 is the covariance";
}

TEST(DistanceSensorMessage, WithoutAnEchoTheDistanceIsBeyondTheFarthest) {
  Measured none = two_metres();
  none.confidence_percent = 0;
  const DistanceSensor m = distance_sensor_of(none);
  EXPECT_EQ(m.current_cm, m.max_cm + 1);
  EXPECT_EQ(m.signal_percent, 1) << "1 means no valid signal";
  none.farthest_m = 1e6;
  EXPECT_EQ(distance_sensor_of(none).current_cm, 65535);
  EXPECT_EQ(distance_sensor_of(none).max_cm, 65534);
}

TEST(DistanceSensorMessage, AWeakEchoIsNotMistakenForNone) {
  Measured weak = two_metres();
  weak.confidence_percent = 1;
  EXPECT_EQ(distance_sensor_of(weak).signal_percent, 2);
  EXPECT_EQ(distance_sensor_of(weak).current_cm, 200);
}

TEST(DistanceSensorMessage, TheOrientationIsThatOfTheMount) {
  Measured m = two_metres();
  const auto looking = [&](double roll_deg, double pitch_deg, double yaw_deg) {
    m.sensor_in_body = mounted(roll_deg, pitch_deg, yaw_deg);
    return static_cast<int>(distance_sensor_of(m).orientation);
  };
  EXPECT_EQ(looking(0, 0, 0), 0);
  EXPECT_EQ(looking(30, 0, 0), 0) << "roll is ignored, because the beam is round";
  EXPECT_EQ(looking(0, 0, -90), 2) << "starboard";
  EXPECT_EQ(looking(0, 0, 180), 4);
  EXPECT_EQ(looking(0, 0, 90), 6) << "port";
  EXPECT_EQ(looking(0, -90, 0), 24) << "up";
  EXPECT_EQ(looking(0, 80, 0), 25);
  EXPECT_EQ(distance_sensor_of(m).wxyz, (std::array<float, 4>{}));
  EXPECT_EQ(looking(0, 45, 0), 100);
  // Obliquely down is a pitch of -45 degrees in FRD.
  const auto wxyz = distance_sensor_of(m).wxyz;
  EXPECT_NEAR(wxyz[0], 0.92388, 1e-5);
  EXPECT_NEAR(wxyz[2], -0.38268, 1e-5);
}

TEST(MavlinkDistances, AllAreSentIfConfigured) {
  DistanceRequests none(false), all(true);
  EXPECT_FALSE(none.wanted());
  EXPECT_FALSE(none.is_due(at_ms(0)));
  EXPECT_TRUE(all.wanted());
  for (const std::uint32_t ms : {0u, 20u, 40u}) EXPECT_TRUE(all.is_due(at_ms(ms)));
}

TEST(MavlinkDistances, AnIntervalHoldsForEachSensor) {
  DistanceRequests requests(false);
  ASSERT_TRUE(requests.set_interval_us(200'000));
  std::vector<std::uint32_t> sent;
  for (std::uint32_t ms = 0; ms <= 500; ms += 100) {
    if (requests.is_due(at_ms(ms))) sent.push_back(ms);
    EXPECT_EQ(requests.is_due(at_ms(ms, 1)), sent.back() == ms);
  }
  EXPECT_THAT(sent, ::testing::ElementsAre(0, 200, 400));
  for (const float wrong : {-2.f, std::numeric_limits<float>::quiet_NaN()}) EXPECT_FALSE(requests.set_interval_us(wrong));
  EXPECT_TRUE(requests.wanted());
  ASSERT_TRUE(requests.set_interval_us(-1));
  EXPECT_FALSE(requests.wanted());
}

TEST(MavlinkDistances, AtTheRateOfThePingsNoneIsLeftOut) {
  for (const double hz : {7., 15., 30., 60.}) {
    DistanceRequests requests(false);
    ASSERT_TRUE(requests.set_interval_us(static_cast<float>(1e6 / hz)));
    for (int ping = 0; ping < 100; ++ping)
      EXPECT_TRUE(requests.is_due(at_ms(static_cast<std::uint32_t>(1e3 * ping / hz)))) << ping << " at " << hz << " Hz";
  }
}

struct MavlinkDistanceCommands : ::testing::Test {
  bool has_range_finder = true;
  MavlinkPoses poses{{}, {}, [this] { return has_range_finder; }};
  Sender vehicle{{1, 1, 0}};
  /// Returns the MAV_RESULT of the answer; -1 without an answer.
  int result_of(std::uint16_t code, float message, float interval_us = 0) {
    CommandLong command;
    command.param1 = message, command.param2 = interval_us;
    command.command = code, command.target_system = 1, command.target_component = 193;
    const auto replies = poses.on_datagram(vehicle(command), at_s(1)).replies;
    return replies.size() == 1 ? std::to_integer<int>(replies.front().at(12)) : -1;
  }
};

TEST_F(MavlinkDistanceCommands, OneMessageIsSentOnRequest) {
  EXPECT_FALSE(poses.distance_message(at_ms(0)));
  EXPECT_EQ(result_of(512, 132), 0);
  EXPECT_TRUE(poses.wants_distances());
  const auto message = poses.distance_message(at_ms(100));
  ASSERT_TRUE(message);
  EXPECT_EQ(message->at(7), std::byte{132});
  EXPECT_FALSE(poses.wants_distances());
  EXPECT_FALSE(poses.distance_message(at_ms(200)));
}

TEST_F(MavlinkDistanceCommands, TheIntervalIsSetAndEnded) {
  EXPECT_EQ(result_of(511, 132, 0), 0);
  EXPECT_TRUE(poses.distance_message(at_ms(0)));
  EXPECT_TRUE(poses.distance_message(at_ms(10)));
  EXPECT_EQ(result_of(511, 132, -7), 2) << "denied";
  EXPECT_EQ(result_of(511, 132, -1), 0);
  EXPECT_FALSE(poses.distance_message(at_ms(20)));
}

TEST_F(MavlinkDistanceCommands, CommandsWithoutARangeFinderAreUnsupported) {
  has_range_finder = false;
  EXPECT_EQ(result_of(511, 132, 0), 3);
  EXPECT_EQ(result_of(512, 132), 3);
  EXPECT_FALSE(poses.wants_distances());
}

TEST_F(MavlinkDistanceCommands, OtherMessagesAreNotAnswered) {
  EXPECT_EQ(result_of(511, 33, 1000), -1);
  EXPECT_EQ(result_of(512, 33), -1);
}

}  // namespace
}  // namespace sonar::mavlink::distances_test
