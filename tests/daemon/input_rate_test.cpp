// A client is read at the allowed rate over any stretch of time, and at once after a pause.
#include "daemon/sonars/input_rate.hpp"

#include <gtest/gtest.h>

namespace sonar {
namespace {

using Steady = InputRate::Steady;
using std::chrono::milliseconds;

TEST(InputRate, ReadsOnWithinTheRate) {
  InputRate rate(1000);
  auto now = Steady::time_point(std::chrono::hours(5));
  for (int i = 0; i < 100; ++i, now += milliseconds(100)) EXPECT_EQ(rate.pause_after(100, now).count(), 0);
}

TEST(InputRate, HoldsTheRateWhateverTheClientDoes) {
  InputRate rate(1000);
  const auto begin = Steady::time_point(std::chrono::hours(5));
  auto now = begin;
  std::size_t read = 0;
  while (now < begin + std::chrono::seconds(20)) {
    now += rate.pause_after(800, now) + milliseconds(1);
    read += 800;
  }
  EXPECT_GE(read, 19000u);
  EXPECT_LE(read, 23000u) << "20 s worth, one second at once, and the last read";
}

TEST(InputRate, APauseIsNotSavedUpForMoreThanASecond) {
  InputRate rate(1000);
  auto now = Steady::time_point(std::chrono::hours(5));
  rate.pause_after(1, now);
  now += std::chrono::hours(1);
  EXPECT_EQ(rate.pause_after(1000, now).count(), 0);
  EXPECT_EQ(std::chrono::round<milliseconds>(rate.pause_after(500, now)), milliseconds(500));
}

TEST(InputRate, NoRateIsNoLimit) {
  InputRate rate(0);
  EXPECT_EQ(rate.pause_after(std::size_t{1} << 40, Steady::time_point{}).count(), 0);
}

}  // namespace
}  // namespace sonar
