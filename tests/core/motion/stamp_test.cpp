// Time stamps keep every nanosecond in all notations.
#include "core/motion/stamp.hpp"

#include <gtest/gtest.h>

namespace sonar::motion {
namespace {

TEST(Stamp, KeepsEveryNanosecondOfUnixTime) {
  EXPECT_EQ(nanoseconds_of_seconds("1403636579.763555584"), 1403636579763555584);
  EXPECT_EQ(nanoseconds_of_seconds("1.403636579763555584e+09"), 1403636579763555584);
  EXPECT_EQ(nanoseconds_of_seconds("1403636579763555584E-9"), 1403636579763555584);
  EXPECT_EQ(nanoseconds_of_nanoseconds("1403636579763555584"), 1403636579763555584);
  EXPECT_EQ(nanoseconds_of_nanoseconds("1.403636579763555584e+18"), 1403636579763555584);
}

TEST(Stamp, ReadsDecimalsAndExponents) {
  EXPECT_EQ(nanoseconds_of_seconds("0"), 0);
  EXPECT_EQ(nanoseconds_of_seconds("-2.5"), -2'500'000'000);
  EXPECT_EQ(nanoseconds_of_seconds("+.5"), 500'000'000);
  EXPECT_EQ(nanoseconds_of_seconds("007."), 7'000'000'000);
  EXPECT_EQ(nanoseconds_of_seconds("0.000000000000000000000000000000001"), 0);
  EXPECT_EQ(nanoseconds_of_seconds("0.1000000000000000055511151231257827"), 100'000'000);
  EXPECT_EQ(nanoseconds_of_seconds("1e-9"), 1);
  EXPECT_EQ(nanoseconds_of_seconds("0.0000000005"), 1);  // a half is rounded up
  EXPECT_EQ(nanoseconds_of_seconds("0.00000000049999"), 0);
  EXPECT_EQ(nanoseconds_of_seconds("0e1000"), 0);
}

TEST(Stamp, RefusesOtherTexts) {
  for (const char* text : {"", "-", ".", "e5", "1e", "1e+-5", "1e5x", "nan", "inf", "0x10", "1,5", "1 ", "--1", "+-1", "1e99999",
                           "4600000001", "1e30", "99999999999999999999999999"})
    EXPECT_FALSE(nanoseconds_of_seconds(text)) << text;
  EXPECT_TRUE(nanoseconds_of_seconds("4600000000"));
}

}  // namespace
}  // namespace sonar::motion
