// Texts with numbers in them: short, long and empty texts.
#include "core/text/format.hpp"

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

namespace sonar::text {
namespace {

TEST(Format, WritesAsPrintfDoes) {
  EXPECT_EQ(format("%d of %g m, %s", 3, 2.5, "far"), "3 of 2.5 m, far");
  EXPECT_EQ(format("100 %%"), "100 %");
  EXPECT_EQ(format("%s", ""), "");
}

TEST(Format, IsOfAnyLength) {
  const std::string name(5000, 'x');
  EXPECT_EQ(format("a %s b", name.c_str()), "a " + name + " b");
}

TEST(Format, FrequenciesAreWrittenWithTheirUnit) {
  EXPECT_EQ(frequency_text(2.1e6), "2.1 MHz");
  EXPECT_EQ(frequency_text(1e6), "1 MHz");
  EXPECT_EQ(frequency_text(750e3), "750 kHz");
  EXPECT_EQ(frequency_text(0), "0 kHz");
}

TEST(Joined, PutsASeparatorBetweenElements) {
  EXPECT_EQ(joined(std::vector<std::string>{}), "");
  EXPECT_EQ(joined(std::array{std::string_view("a")}), "a");
  EXPECT_EQ(joined(std::vector<std::string>{"a", "b", "c"}), "a, b, c");
  EXPECT_EQ(joined(std::array{"a", "b"}, "|"), "a|b");
}

TEST(Joined, TakesTheTextOfAnElementFromAFunctionOrMember) {
  EXPECT_EQ(joined(std::array{1, 2}, " or ", [](int n) { return std::to_string(n); }), "1 or 2");
  using Named = std::pair<int, std::string>;
  EXPECT_EQ(joined(std::vector<Named>{{1, "front"}, {2, "rear"}}, ", ", &Named::second), "front, rear");
}

}  // namespace
}  // namespace sonar::text
