// Messages to viewers of a trajectory: its playback time, and steps of it such as seeks.
#include "daemon/emulator/view/recording_player.hpp"

#include <gtest/gtest.h>

namespace sonar {
namespace {

using motion::Playback;
using motion::Speed;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Status = foxglove::PlaybackStatus;

constexpr Time start = Time{} + std::chrono::hours(24 * 365 * 50);

TEST(PlaybackWatch, ReportsStepsOfPlayback) {
  Playback playback(seconds(100), {}, start);
  Time now = start + seconds(5);
  PlaybackWatch watch(playback, now);
  EXPECT_EQ(watch.state(now).status, Status::playing);
  EXPECT_EQ(watch.stamp(now), Time(seconds(5)));
  EXPECT_EQ(watch.end(), Time(seconds(100)));
  now += seconds(1);
  EXPECT_FALSE(watch.look(&playback, now));

  playback.use_speed(now + milliseconds(50), *Speed::from(2));
  now += milliseconds(100);
  auto news = watch.look(&playback, now);
  ASSERT_TRUE(news);
  EXPECT_EQ(news->speed, 2);
  EXPECT_FALSE(news->did_seek);
  EXPECT_EQ(news->at, Time(milliseconds(6150)));

  playback.pause(now);
  news = watch.look(&playback, now += seconds(1));
  ASSERT_TRUE(news);
  EXPECT_EQ(news->status, Status::paused);
  EXPECT_FALSE(news->did_seek);
  EXPECT_FALSE(watch.look(&playback, now += seconds(1)));

  playback.seek(now, seconds(3));
  news = watch.look(&playback, now);
  ASSERT_TRUE(news);
  EXPECT_TRUE(news->did_seek);
  EXPECT_EQ(news->at, Time(seconds(3)));
  playback.resume(now);
  playback.seek(now, seconds(50));
  news = watch.look(&playback, now += milliseconds(100));
  ASSERT_TRUE(news);
  EXPECT_TRUE(news->did_seek) << "a step ahead is a seek, too";

  news = watch.look(&playback, now += seconds(60));
  ASSERT_TRUE(news);
  EXPECT_EQ(news->status, Status::ended);
  EXPECT_EQ(news->at, Time(seconds(100)));
  EXPECT_FALSE(watch.look(&playback, now += seconds(1)));
}

TEST(PlaybackWatch, ALoopThatBeginsAgainIsASeek) {
  const Playback playback(seconds(10), {.speed = {}, .loop = true, .start = {}}, start);
  PlaybackWatch watch(playback, start + seconds(9));
  EXPECT_FALSE(watch.look(&playback, start + milliseconds(9900)));
  const auto news = watch.look(&playback, start + milliseconds(10100));
  ASSERT_TRUE(news);
  EXPECT_TRUE(news->did_seek);
  EXPECT_EQ(news->status, Status::playing);
  EXPECT_EQ(news->at, Time(milliseconds(100)));
}

TEST(PlaybackWatch, AVehicleThatFollowsPosesStandsStill) {
  const Playback playback(seconds(10), {}, start);
  PlaybackWatch watch(playback, start + seconds(1));
  const auto news = watch.look(nullptr, start + seconds(2));
  ASSERT_TRUE(news);
  EXPECT_EQ(news->status, Status::paused);
  EXPECT_EQ(news->at, Time(seconds(2)));
  EXPECT_FALSE(watch.look(nullptr, start + seconds(3)));
  EXPECT_EQ(watch.stamp(start + seconds(4)), Time(seconds(2)));
}

}  // namespace
}  // namespace sonar
