// Position of a playback at a given time: exact in nanoseconds, also with loops, pauses and seeks.
#include "core/motion/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

namespace sonar::motion {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

Time at(double s) { return Time{} + nanoseconds_from(s); }
Ns shown(const Playback& p, double clock_s) { return p.place(at(clock_s)).at; }

PlaybackRules looped(double speed = 1) { return {*Speed::from(speed), true, Ns{0}}; }

TEST(Playback, RunsOnceAndStaysAtTheEnd) {
  const Playback p(seconds(10), {}, at(100));
  EXPECT_EQ(shown(p, 100), seconds(0));
  EXPECT_EQ(shown(p, 104.5), milliseconds(4500));
  EXPECT_EQ(p.place(at(110)).rate, 1);  // the body moved until it reached the last pose
  EXPECT_EQ(shown(p, 111), seconds(10));
  EXPECT_EQ(p.place(at(111)).rate, 0);
  EXPECT_EQ(shown(p, 99), seconds(0));
  EXPECT_FALSE(p.ended(at(109.9)));
  EXPECT_TRUE(p.ended(at(110)));
}

TEST(Playback, SpeedIsExactForYears) {
  const Playback p(seconds(10), looped(0.1),
                   Time{});  // 0.1 is not exact in binary; after a thousand days the error would be visible
  const Ns late = std::chrono::hours(24 * 1000) + Ns(10);
  EXPECT_EQ(p.place(Time{} + late).at, (std::chrono::hours(2400) + Ns(1)) % Ns(seconds(10)));
  EXPECT_FALSE(Speed::from(0));
  EXPECT_FALSE(Speed::from(-1));
  EXPECT_FALSE(Speed::from(1001));
  EXPECT_FALSE(Speed::from(std::nan("")));
  EXPECT_EQ(Speed::from(2.5)->millionths, 2'500'000);
}

TEST(Playback, LoopShowsEachMomentOncePerPass) {
  const Playback p(seconds(10), looped(), Time{});
  std::multiset<Ns> moments;
  for (int ping = 0; ping < 300; ++ping) moments.insert(shown(p, 0.1 * ping));  // three rounds at 10 Hz
  EXPECT_EQ(moments.size(), 300u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(moments.count(milliseconds(100 * i)), 3u) << i;
  EXPECT_FALSE(p.ended(at(1e6)));
}

TEST(Playback, StartsInTheMiddleOrLater) {
  const Playback middle(seconds(10), {{}, true, seconds(9)}, at(0));
  EXPECT_EQ(shown(middle, 0), seconds(9));
  EXPECT_EQ(shown(middle, 2), seconds(1));
  const Playback later(seconds(10), {*Speed::from(2), true, -seconds(4)}, at(0));
  EXPECT_EQ(shown(later, 1.5), seconds(0));
  EXPECT_EQ(later.place(at(1.5)).rate, 0);
  EXPECT_EQ(shown(later, 3), seconds(2));
  const Playback beyond(seconds(10), {{}, false, seconds(11)}, at(0));
  EXPECT_EQ(shown(beyond, 0), seconds(10));
}

TEST(Playback, PausesAndContinuesAtTheSamePlace) {
  Playback p(seconds(10), looped(), at(0));
  p.pause(at(13));
  EXPECT_TRUE(p.paused());
  EXPECT_EQ(shown(p, 60), seconds(3));
  EXPECT_EQ(p.place(at(60)).rate, 0);
  p.resume(at(100));
  EXPECT_EQ(shown(p, 101), seconds(4));
  p.resume(at(102));  // a second resume has no effect
  EXPECT_EQ(shown(p, 102), seconds(5));
}

TEST(Playback, SeeksAndChangesSpeedWithoutAStep) {
  Playback p(seconds(10), {}, at(0));
  p.use_speed(at(2), *Speed::from(3));
  EXPECT_EQ(shown(p, 2), seconds(2));
  EXPECT_EQ(shown(p, 4), seconds(8));
  p.seek(at(50), seconds(1));  // the playback had ended
  EXPECT_EQ(shown(p, 51), seconds(4));
  EXPECT_EQ(p.place(at(51)).rate, 3);
  p.pause(at(51));
  p.seek(at(52), seconds(7));
  EXPECT_EQ(shown(p, 60), seconds(7));
  p.seek(at(52), seconds(70));
  EXPECT_EQ(shown(p, 60), seconds(10));
}

TEST(Playback, StaysAtItsEndAtAnotherSpeed) {
  Playback p(seconds(10), {}, at(0));
  p.use_speed(at(30), *Speed::from(0.5));
  EXPECT_EQ(shown(p, 31), seconds(10));
  Playback waits(seconds(10), {{}, false, -seconds(4)}, at(0));
  waits.pause(at(1));
  waits.resume(at(5));
  EXPECT_EQ(shown(waits, 8), seconds(0));
  EXPECT_EQ(shown(waits, 9), seconds(1));
}

TEST(Playback, RestsWithOnePose) {
  const Playback p(seconds(0), looped(), at(0));
  EXPECT_EQ(shown(p, 5), seconds(0));
  EXPECT_EQ(p.place(at(5)).rate, 0);
}

TEST(Playback, SurvivesTheEndsOfTime) {
  const Playback p(seconds(10), looped(1000), Time{});
  const auto far = Time{Ns(std::numeric_limits<std::int64_t>::max())};
  EXPECT_GE(p.place(far).at, Ns{0});
  EXPECT_LT(p.place(far).at, Ns(seconds(10)));
}

}  // namespace
}  // namespace sonar::motion
