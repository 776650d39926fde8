// Tests MAV_CMD_INJECT_FAILURE: the addresses that are accepted, the handler's input, and the answer's bytes.
#include <limits>
#include <tuple>

#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink::commands_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

CommandLong failure(float unit, float type, float instance) {
  CommandLong m;
  m.param1 = unit, m.param2 = type, m.param3 = instance;
  m.command = 420, m.target_system = 1, m.target_component = 193;
  return m;
}

struct MavlinkCommands : ::testing::Test {
  MavResult answer = MavResult::accepted;
  std::vector<std::tuple<std::uint32_t, FailureType, std::uint32_t>> requested;
  MavlinkPoses poses{{}, [this](std::uint32_t unit, FailureType type, std::uint32_t instance) {
                       requested.emplace_back(unit, type, instance);
                       return answer;
                     }};
  Sender ground{{255, 190, 0}};

  std::vector<Bytes> replies_to(const CommandLong& command) { return poses.on_datagram(ground(command), at_s(1)).replies; }
  /// Returns the MAV_RESULT of the answer; -1 without an answer.
  int result_of(const CommandLong& command) {
    const auto replies = replies_to(command);
    return replies.size() == 1 ? std::to_integer<int>(replies.front().at(12)) : -1;
  }
};

/// The payload is typed by hand. The checksum is CRC-16/MCRF4XX of the frame without its first byte, and of 143 (CRC_EXTRA).
TEST_F(MavlinkCommands, TheAnswerIsAnAckToTheSender) {
  answer = MavResult::denied;
  const auto replies = replies_to(failure(7, 2, 3));
  ASSERT_EQ(replies.size(), 1u);
  const Bytes expected = bytes({0xFD, 10, 0, 0, 0, 1, 193, 77, 0, 0, 0xA4, 0x01, 2, 0, 0, 0, 0, 0, 255, 190});
  ASSERT_EQ(replies.front().size(), expected.size() + 2);
  EXPECT_EQ(Bytes(replies.front().begin(), replies.front().end() - 2), expected);
  const std::uint16_t crc = checksum(bytes({143}), checksum(BytesView(expected).subspan(1)));
  EXPECT_EQ(replies.front()[20], static_cast<std::byte>(crc & 0xFF));
  EXPECT_EQ(replies.front()[21], static_cast<std::byte>(crc >> 8));
  EXPECT_THAT(requested, ElementsAre(std::tuple(7u, FailureType::stuck, 3u)));
}

TEST_F(MavlinkCommands, EveryTypeIsPassedOn) {
  for (int type = 0; type <= 7; ++type) {
    EXPECT_EQ(result_of(failure(7, static_cast<float>(type), 0)), 0);
    EXPECT_EQ(requested.back(), std::tuple(7u, static_cast<FailureType>(type), 0u));
  }
  EXPECT_EQ(static_cast<int>(FailureType::intermittent), 7);
}

TEST_F(MavlinkCommands, InvalidParametersAreDenied) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const CommandLong& bad : {failure(nan, 1, 0), failure(-1, 1, 0), failure(0.5f, 1, 0), failure(7, 8, 0), failure(7, nan, 0),
                                 failure(7, 1, -2), failure(7, 1, 1e9f)})
    EXPECT_EQ(result_of(bad), 2);
  EXPECT_THAT(requested, IsEmpty());
}

TEST_F(MavlinkCommands, CommandsForOthersAreIgnoredLikeUnknownMessages) {
  CommandLong to_autopilot = failure(7, 1, 0), to_all = to_autopilot, to_another = to_autopilot, other = to_autopilot;
  to_autopilot.target_component = 1;
  to_all.target_component = 0;
  to_another.target_system = 2;
  other.command = 511;
  for (const CommandLong& command : {to_autopilot, to_all, to_another, other}) {
    const Reaction reaction = poses.on_datagram(ground(command), at_s(1));
    EXPECT_THAT(reaction.replies, IsEmpty());
    EXPECT_THAT(reaction.refusals, IsEmpty());
    EXPECT_FALSE(reaction.from_vehicle);
  }
  EXPECT_THAT(requested, IsEmpty());
  EXPECT_FALSE(poses.system()) << "a ground station is no vehicle";
}

TEST_F(MavlinkCommands, OurSystemNumberIsThatOfTheVehicle) {
  Sender vehicle{{42, 1, 0}};
  poses.on_datagram(vehicle(autopilot_heartbeat()), at_s(1));
  CommandLong command = failure(7, 1, 0);
  EXPECT_EQ(result_of(command), -1);
  command.target_system = 42;
  EXPECT_EQ(result_of(command), 0);
}

TEST_F(MavlinkCommands, CommandsWithoutAHandlerAreUnsupported) {
  MavlinkPoses plain({});
  const auto replies = plain.on_datagram(ground(failure(7, 1, 0)), at_s(1)).replies;
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies.front().at(12), std::byte{3});
}

}  // namespace
}  // namespace sonar::mavlink::commands_test
