// A device that does not answer counts as failed; a slow device does not.
#include "cuda/patience.hpp"

#include <gtest/gtest.h>

namespace sonar::cuda {
namespace {

constexpr int not_yet = 600, hung = 702;

struct Waited {
  int code = 0, asked = 0, rested = 0;
  double s = 0;
};
/// Waits with a clock that advances by a millisecond whenever it is read and at every rest.
Waited wait(double answers_after_s, int answer) {
  Waited w;
  w.code = wait_for(
      not_yet, hung, [&] { return ++w.asked, w.s >= answers_after_s ? answer : not_yet; }, [&] { return w.s += 1e-3; },
      [&] { ++w.rested, w.s += 1e-3; });
  return w;
}

TEST(Patience, ReturnsAnAnswerThatIsThereAtOnce) {
  EXPECT_EQ(wait(0, 0).code, 0);
  EXPECT_EQ(wait(0, 0).asked, 1);
  EXPECT_EQ(wait(0, 0).s, 0);
}

TEST(Patience, DoesNotRestDuringTheTimeOfAPing) {
  const Waited w = wait(busy_wait_s / 2, 0);
  EXPECT_EQ(w.code, 0);
  EXPECT_EQ(w.rested, 0);
  EXPECT_LT(w.s, busy_wait_s);
}

TEST(Patience, RestsIfTheAnswerTakesLonger) {
  const Waited w = wait(longest_wait_s / 2, 0);
  EXPECT_EQ(w.code, 0);
  EXPECT_GT(w.rested, 100);
}

TEST(Patience, ReturnsTheCodeOfAFailure) { EXPECT_EQ(wait(0.5, 719).code, 719); }

TEST(Patience, EndsAfterTheLongestWait) {
  const Waited w = wait(1e9, 0);
  EXPECT_EQ(w.code, hung);
  EXPECT_NEAR(w.s, longest_wait_s, 0.1);
}

}  // namespace
}  // namespace sonar::cuda
