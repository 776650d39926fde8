// Tests the lines in which sonarctl reports what it waits for, without a network and without real waits.
#include "clients/sonarctl/waiting.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sonar::clients {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

HostPing ping_of(std::size_t lines, std::size_t whole) {
  HostPing ping;
  ping.lines = lines;
  ping.whole_lines = whole;
  return ping;
}

TEST(PictureProgress, ReportsLinesAtOnceAndEveryTwoSecondsWithTheRemainingTime) {
  PictureProgress progress(30);
  const PictureProgress::Clock::time_point begin{seconds(1000)};
  EXPECT_THAT(
      progress.line_at(ping_of(1, 201), begin).value_or(""),
      HasSubstr("the picture has 1 of 201 scan lines; it is used when it is complete, or incomplete after 30 s or Ctrl-C"));
  EXPECT_FALSE(progress.line_at(ping_of(20, 201), begin + milliseconds(1900)));
  EXPECT_THAT(progress.line_at(ping_of(21, 201), begin + seconds(2)).value_or(""), HasSubstr("21 of 201 scan lines; 18 s more"));
  EXPECT_FALSE(progress.line_at(ping_of(22, 201), begin + seconds(3)));
  EXPECT_THAT(progress.line_at(ping_of(22, 201), begin + seconds(29)).value_or(""), HasSubstr("; 1 s more"));
  EXPECT_FALSE(progress.is_over(begin + milliseconds(29999)));
  EXPECT_TRUE(progress.is_over(begin + seconds(30)));
}

TEST(PictureProgress, WithoutALimitThePictureIsUsedAtOnce) {
  EXPECT_TRUE(PictureProgress(0).is_over(PictureProgress::Clock::time_point{seconds(5)}));
}

}  // namespace
}  // namespace sonar::clients
