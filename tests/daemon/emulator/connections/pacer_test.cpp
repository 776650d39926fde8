// Ticks are multiples of the period after a start. Late ticks are skipped and counted. The travel time limits the rate.
#include "daemon/emulator/connections/pacer.hpp"

#include <gtest/gtest.h>

namespace sonar::pacer_test {
namespace {

using std::chrono::milliseconds;

PingSettings settings(float rate_hz, double range_m = 5, bool triggered = false) {
  PingSettings s;
  s.rate_hz = rate_hz;
  s.range_m = range_m;
  s.triggered = triggered;
  return s;
}
const Time t0 = Time(std::chrono::hours(1000));

TEST(Pacer, PeriodIsTheRateOrTheTravelTimePlusTwoMilliseconds) {
  EXPECT_EQ(ping_period(settings(10)), milliseconds(100));
  EXPECT_EQ(ping_period(settings(40, 120)), milliseconds(162));  // 2 * 120 / 1500 + 2 ms: docs/protocols/oculus.md, section 5.6
  EXPECT_EQ(ping_period(settings(0)).count(), 0);
  EXPECT_EQ(ping_period(settings(-1)).count(), 0);
}

TEST(Pacer, TicksLieOnAGridWithoutDrift) {
  Pacer pacer;
  EXPECT_FALSE(pacer.next_tick());
  pacer.configure(settings(15), t0);  // 66.666667 ms: not a whole number of any unit
  const auto period = pacer.period();
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(*pacer.next_tick(), t0 + i * period);
    ASSERT_TRUE(pacer.fire(*pacer.next_tick() + milliseconds(i % 60), false)) << "a delay of less than a period changes nothing";
    ASSERT_EQ(pacer.last_tick(), t0 + i * period);
  }
  EXPECT_EQ(pacer.skipped_ticks(), 0u);
}

TEST(Pacer, LateTicksAreSkippedAndCountedNeverQueued) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  EXPECT_TRUE(pacer.fire(t0, false));
  EXPECT_TRUE(pacer.fire(t0 + milliseconds(450), false));  // ticks 100, 200, 300 are lost, 400 fires
  EXPECT_EQ(pacer.skipped_ticks(), 3u);
  EXPECT_EQ(pacer.last_tick(), t0 + milliseconds(400));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(500));
}

TEST(Pacer, HurryRestartsTheGridAtOnce) {
  Pacer pacer;
  pacer.hurry(t0);
  EXPECT_FALSE(pacer.next_tick()) << "standby";
  pacer.configure(settings(10), t0);
  EXPECT_TRUE(pacer.fire(t0, false));
  pacer.hurry(t0 + milliseconds(7));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(7));
  EXPECT_TRUE(pacer.fire(t0 + milliseconds(7), false));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(107));
  EXPECT_EQ(pacer.skipped_ticks(), 0u);
  pacer.configure(settings(10, 5, true), t0 + milliseconds(300));
  pacer.hurry(t0 + milliseconds(300));
  EXPECT_FALSE(pacer.next_tick()) << "a triggered sonar waits for its trigger";
}

TEST(Pacer, ATickWaitsForABusySimulationUntilTheNextOneReplacesIt) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  EXPECT_TRUE(pacer.fire(t0, false));
  EXPECT_FALSE(pacer.fire_waiting()) << "no tick waits";
  EXPECT_FALSE(pacer.fire(t0 + milliseconds(100), true));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(200));
  EXPECT_EQ(pacer.skipped_ticks(), 0u);
  EXPECT_FALSE(pacer.fire(t0 + milliseconds(200), true));
  EXPECT_EQ(pacer.skipped().busy, 1u);
  ASSERT_TRUE(pacer.fire_waiting());
  EXPECT_EQ(pacer.last_tick(), t0 + milliseconds(200)) << "the time of a tick is on the grid";
  EXPECT_FALSE(pacer.fire_waiting()) << "a tick that waits is fired only once";
  EXPECT_TRUE(pacer.fire(t0 + milliseconds(300), false));
  EXPECT_EQ(pacer.ticks(), 4u);
  EXPECT_EQ(pacer.skipped_ticks(), 1u);
}

TEST(Pacer, AWaitingTickIsDroppedWhenTheRhythmChanges) {
  const auto waiting = [] {
    Pacer pacer;
    pacer.configure(settings(10), t0);
    EXPECT_TRUE(pacer.fire(t0, false));
    EXPECT_FALSE(pacer.fire(t0 + milliseconds(100), true));
    return pacer;
  };
  Pacer same = waiting(), other = waiting(), hurried = waiting(), stopped = waiting(), restarted = waiting();
  same.configure(settings(10), t0 + milliseconds(120));
  EXPECT_TRUE(same.fire_waiting());
  other.configure(settings(20), t0 + milliseconds(120));
  hurried.hurry(t0 + milliseconds(120));
  stopped.stop();
  restarted.forget_tick();
  for (Pacer* p : {&other, &hurried, &stopped, &restarted}) {
    EXPECT_FALSE(p->fire_waiting());
    EXPECT_EQ(p->skipped().busy, 1u);
    EXPECT_EQ(p->ticks(), 2u);
  }
}

TEST(Pacer, PingsThatTakeMoreThanAPeriodFollowEachOther) {
  Pacer pacer;
  pacer.configure(settings(40, 1), t0);
  Time free_at = t0;
  int pings = 0;
  for (int ms = 0; ms < 3000; ++ms) {
    const Time now = t0 + milliseconds(ms);
    const bool due = now >= *pacer.next_tick() && pacer.fire(now, now < free_at);
    if (due || (now >= free_at && pacer.fire_waiting())) {
      ++pings;
      free_at = now + milliseconds(30);
      EXPECT_LT(now - pacer.last_tick(), milliseconds(25)) << "older than the newest tick";
    }
  }
  EXPECT_EQ(pings, 100) << "a ping takes 30 ms; a ping at every second tick would be 60 pings";
}

TEST(Pacer, TimeThatIsSkippedHasNoTicks) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  EXPECT_TRUE(pacer.fire(t0, false));
  pacer.skip(std::chrono::hours(1));
  EXPECT_EQ(*pacer.next_tick(), t0 + std::chrono::hours(1) + milliseconds(100)) << "the time to the next tick does not change";
  EXPECT_TRUE(pacer.fire(*pacer.next_tick(), false));
  EXPECT_EQ(pacer.skipped_ticks(), 0u);
}

TEST(Pacer, NothingHappensBeforeTheTick) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  EXPECT_TRUE(pacer.fire(t0, false));
  EXPECT_FALSE(pacer.fire(t0 + milliseconds(99), false));
  EXPECT_EQ(pacer.skipped_ticks(), 0u);
}

TEST(Pacer, SameRhythmDoesNotRestartTheGrid) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  ASSERT_TRUE(pacer.fire(t0, false));
  for (int i = 1; i < 100; ++i) pacer.configure(settings(10), t0 + milliseconds(i));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(100));
}

TEST(Pacer, ANewRhythmStartsAtOnceAfterTheLastPingEnds) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  ASSERT_TRUE(pacer.fire(t0, false));
  pacer.configure(settings(5), t0 + milliseconds(30));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(100));
  ASSERT_TRUE(pacer.fire(t0 + milliseconds(100), false));
  pacer.configure(settings(40), t0 + milliseconds(5000));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(5000));
}

TEST(Pacer, AFasterRhythmStartsWithItsOwnPeriod) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  ASSERT_TRUE(pacer.fire(t0, false));
  pacer.configure(settings(40), t0 + milliseconds(3));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(25));
  ASSERT_TRUE(pacer.fire(t0 + milliseconds(25), false));
  // Sound travels 60 m and back in 82 ms, with 2 ms to spare.
  pacer.configure(settings(10, 60), t0 + milliseconds(50));
  ASSERT_TRUE(pacer.fire(t0 + milliseconds(50), false));
  pacer.configure(settings(40, 1), t0 + milliseconds(60));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(50 + 82));
}

TEST(Pacer, ChangesOfTheRhythmMakeNoMorePingsThanTheFastestOfThem) {
  Pacer pacer;
  int pings = 0;
  for (int ms = 0; ms < 1000; ++ms) {
    pacer.configure(settings(ms % 2 == 0 ? 10 : 40, 1), t0 + milliseconds(ms));
    pings += pacer.fire(t0 + milliseconds(ms), false);
  }
  EXPECT_LE(pings, 41);
}

TEST(Pacer, StandbyStopsAndAnyOtherRateResumesAtOnce) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  ASSERT_TRUE(pacer.fire(t0, false));
  pacer.configure(settings(0), t0 + milliseconds(50));
  EXPECT_FALSE(pacer.next_tick());
  pacer.configure(settings(10), t0 + milliseconds(777));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(777));
}

TEST(Pacer, EachTriggerMakesOnePing) {
  Pacer pacer;
  pacer.configure(settings(10, 5, true), t0);
  EXPECT_FALSE(pacer.next_tick());
  pacer.trigger(t0 + milliseconds(5));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(5));
  EXPECT_TRUE(pacer.fire(t0 + milliseconds(5), false));
  EXPECT_FALSE(pacer.next_tick());
  pacer.trigger(t0 + milliseconds(6));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(105)) << "not faster than the rate allows";
  pacer.trigger(t0 + milliseconds(7));
  EXPECT_EQ(pacer.skipped_ticks(), 1u) << "one trigger waits; further ones are counted as skipped";
  EXPECT_FALSE(pacer.fire(t0 + milliseconds(105), true));
  ASSERT_TRUE(pacer.next_tick());
  EXPECT_TRUE(pacer.fire(*pacer.next_tick(), false)) << "a trigger waits for a busy simulation";
}

TEST(Pacer, TriggersAreIgnoredWhenFreeRunningOrInStandby) {
  Pacer pacer;
  pacer.trigger(t0);
  EXPECT_FALSE(pacer.next_tick());
  pacer.configure(settings(0, 5, true), t0);
  pacer.trigger(t0);
  EXPECT_FALSE(pacer.next_tick());
}

TEST(Pacer, StopForgetsTheRhythm) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  ASSERT_TRUE(pacer.fire(t0, false));
  pacer.stop();
  EXPECT_FALSE(pacer.next_tick());
  pacer.configure(settings(10), t0 + milliseconds(130));
  EXPECT_EQ(*pacer.next_tick(), t0 + milliseconds(130));
}

TEST(Pacer, EveryTickIsFiredOrSkippedForAReason) {
  Pacer pacer;
  pacer.configure(settings(10), t0);
  EXPECT_TRUE(pacer.fire(t0, false));
  EXPECT_TRUE(pacer.fire(t0 + milliseconds(450), false));  // 100, 200, 300 are late
  EXPECT_FALSE(pacer.fire(t0 + milliseconds(620), true));  // 500 late, 600 waits
  EXPECT_TRUE(pacer.fire(t0 + milliseconds(700), false));  // it replaces 600
  EXPECT_EQ(pacer.ticks(), 8u);
  EXPECT_EQ(pacer.skipped().late, 4u);
  EXPECT_EQ(pacer.skipped().busy, 1u);
  pacer.configure(settings(10, 5, true), t0 + milliseconds(700));
  pacer.trigger(t0 + milliseconds(750));
  pacer.trigger(t0 + milliseconds(751), true);  // joins the waiting trigger, so it makes no ping of its own
  pacer.trigger(t0 + milliseconds(752));
  pacer.stop();  // the trigger that waits has no client any more
  EXPECT_EQ(pacer.ticks(), 10u);
  EXPECT_EQ(pacer.skipped().trigger, 2u);
  EXPECT_EQ(pacer.ticks(), 3u + pacer.skipped_ticks());
}

}  // namespace
}  // namespace sonar::pacer_test
