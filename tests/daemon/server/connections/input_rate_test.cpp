// A client is read at the allowed rate over any interval, and at once after a pause.
#include "daemon/server/connections/input_rate.hpp"

#include <gtest/gtest.h>

namespace sonar {
namespace {

using Steady = InputRate::Steady;
using std::chrono::milliseconds;

TEST(InputRate, AClientWithinTheRateDoesNotWait) {
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
  EXPECT_LE(read, 23000u) << "the bytes of 20 s, of one second at once, and of the last read";
}

TEST(InputRate, APauseGivesCreditForASecondAtMost) {
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

/// The bytes read within 20 s from `floods` clients that flood, and the waiting time of one client that sends `modest` bytes
/// every 100 ms.
struct Shared {
  std::size_t of_floods = 0;
  Steady::duration waited{};
};
Shared twenty_seconds(int floods, std::size_t modest) {
  SharedRate rate(10000);
  std::vector<SharedRate::Part> parts;
  for (int i = 0; i <= floods; ++i) parts.push_back(rate.join(10000));
  const auto begin = Steady::time_point(std::chrono::hours(5));
  std::vector<Steady::time_point> turns(parts.size(), begin);
  Shared out;
  for (auto now = begin; now < begin + std::chrono::seconds(20); now += milliseconds(1))
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (turns[i] > now) continue;
      const bool is_modest = i == parts.size() - 1;
      const auto pause = rate.pause_after(parts[i], is_modest ? modest : 1000, now);
      turns[i] = now + pause + milliseconds(is_modest ? 100 : 1);
      is_modest ? void(out.waited += pause) : void(out.of_floods += 1000);
    }
  return out;
}

TEST(SharedRate, HoldsTheRateAndOnlyThoseAboveTheirShareWait) {
  const Shared with_modest = twenty_seconds(9, 90);  // 900 bytes per second of 1000
  EXPECT_EQ(with_modest.waited.count(), 0);
  EXPECT_GE(with_modest.of_floods, 150000u);
  EXPECT_LE(with_modest.of_floods, 240000u) << "the bytes of 20 s and of one second, 4 KiB for each client, and the last reads";
  EXPECT_GT(twenty_seconds(9, 500).waited, std::chrono::seconds(1)) << "the client sends five times its share";
}

TEST(SharedRate, ASingleClientHasTheWholeRate) {
  SharedRate rate(10000);
  auto now = Steady::time_point(std::chrono::hours(5));
  auto part = rate.join(10000);
  for (int i = 0; i < 100; ++i) {
    const auto gone = rate.join(10000);
  }
  for (int i = 0; i < 100; ++i, now += milliseconds(100)) EXPECT_EQ(rate.pause_after(part, 1000, now).count(), 0);
}

}  // namespace
}  // namespace sonar
