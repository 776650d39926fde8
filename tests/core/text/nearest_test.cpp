#include "core/text/nearest.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace sonar::text {
namespace {

constexpr std::array<std::string_view, 5> keys{"range_m", "rate_hz", "mount", "temperature_c", "bind_ip"};

TEST(Nearest, FindsSlipsOfTheFinger) {
  EXPECT_EQ(nearest("mout", keys), "mount");
  EXPECT_EQ(nearest("muont", keys), "mount");  // a swap counts as one error
  EXPECT_EQ(nearest("bind-ip", keys), "bind_ip");
  EXPECT_EQ(nearest("Mount", keys), "mount");
  EXPECT_EQ(nearest("rang_m", keys), "range_m");
}

TEST(Nearest, AcceptsANameWithoutItsUnit) {
  EXPECT_EQ(nearest("temperature", keys), "temperature_c");
  EXPECT_EQ(nearest("mount_m", keys), "mount");
}

TEST(Nearest, SuggestsNothingWhenNothingIsNear) {
  EXPECT_EQ(nearest("colour", keys), "");
  EXPECT_EQ(nearest("x", keys), "");
  EXPECT_EQ(nearest("mount", {}), "");
}

TEST(Nearest, SuggestionNamesTheNearestOrLists) {
  EXPECT_EQ(suggestion("mout", keys, "valid keys"), "; did you mean \"mount\"?");
  EXPECT_EQ(suggestion("colour", keys, "valid keys"), "; valid keys: range_m, rate_hz, mount, temperature_c, bind_ip");
  EXPECT_EQ(suggestion("colour", {}, "valid keys"), "");
}

TEST(Nearest, AVeryLongNameCostsLittleAndMatchesNothing) { EXPECT_EQ(nearest(std::string(1000000, 'q'), keys), ""); }

TEST(Nearest, LongListsAreCut) {
  std::vector<std::string_view> many(21, "zzzzzzzzz");
  EXPECT_TRUE(suggestion("a", many, "valid names").ends_with(", ..."));
}

}  // namespace
}  // namespace sonar::text
