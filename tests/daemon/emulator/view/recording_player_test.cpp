// The ping of a recording that is shown at a time, forwards and backwards.
#include "daemon/emulator/view/recording_player.hpp"

#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar::recording_player_test {
namespace {

using namespace std::chrono_literals;
using recording::tests::Format;

RecordingPlayer player_of(Format format) {
  auto opened = recording::tests::open_bytes(recording::tests::recorded(format, recording::tests::conversation()));
  return {*recording::RecordedPings::open(std::move(opened->reader)), 100ms};
}

void measure(RecordingPlayer& player) {
  while (player.measure()) {
  }
}

/// Returns the number of the ping that is shown at this moment.
std::uint32_t at(RecordingPlayer& player, RecordingPlayer::Ns moment) {
  while (player.approach(moment)) {
  }
  return player.shown() != nullptr ? player.shown()->ping.facts.number : 0;
}

TEST(RecordingPlayer, ShowsTheLastPingAtOrBeforeAMoment) {
  RecordingPlayer player = player_of(Format::mcap);
  measure(player);
  EXPECT_EQ(player.count(), 3u);
  EXPECT_EQ(player.begin(), recording::tests::after_ms(100));
  EXPECT_EQ(player.length(), 4200ms);
  EXPECT_EQ(player.shown(), nullptr);
  for (const auto& [moment, number] : {std::pair{0ms, 1u},
                                       {99ms, 1u},
                                       {100ms, 2u},
                                       {4199ms, 2u},
                                       {4200ms, 3u},
                                       {9000ms, 3u},
                                       {150ms, 2u},
                                       {0ms, 1u},
                                       {4200ms, 3u}}) {
    SCOPED_TRACE(moment.count());
    EXPECT_EQ(at(player, moment), number);
  }
}

TEST(RecordingPlayer, GivesFilesWithoutTimesTheirInterval) {
  RecordingPlayer player = player_of(Format::raw_dump);
  measure(player);
  EXPECT_EQ(player.length(), 200ms);
  EXPECT_EQ(at(player, 199ms), 2u);
  EXPECT_EQ(at(player, 0ms), 1u);
}

TEST(RecordingPlayer, NeedsAKnownSonar) {
  auto opened = recording::tests::open_bytes(recording::tests::recorded(Format::mcap, {}));
  ASSERT_TRUE(opened);
  const auto pings = recording::RecordedPings::open(std::move(opened->reader));
  ASSERT_FALSE(pings);
  EXPECT_EQ(pings.error().text, "holds no ping of a known sonar");
}

}  // namespace
}  // namespace sonar::recording_player_test
