#include "daemon/commands/dataset/vary.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sonar::dataset {
namespace {

using testing::HasSubstr;

std::vector<Variation> variations(const std::string& yaml, std::string* error = nullptr) {
  const auto document = text::parse_yaml(yaml, "job.yaml");
  EXPECT_TRUE(document);
  auto all = read_variations(document->root().optional("vary"));
  if (const auto wrong = document->finish(); error && wrong) *error = wrong->text;
  return all;
}

std::string complaint(const std::string& one) {
  std::string error;
  variations("vary: {" + one + "}", &error);
  return error;
}

TEST(Vary, APingIsAFunctionOfSeedNumberAttemptAndName) {
  const auto all = variations("vary: {a: {uniform: [0, 1]}, b: {uniform: [0, 1]}}");
  const auto alone = variations("vary: {b: {uniform: [0, 1]}}");
  const Draws ping = draw(all, Seed{1}, 7000, 0);
  EXPECT_EQ(ping.words.at("b"), draw(alone, Seed{1}, 7000, 0).words.at("b"));  // no matter what else is drawn
  EXPECT_NE(ping.words.at("a"), ping.words.at("b"));
  EXPECT_NE(ping.words.at("a"), draw(all, Seed{1}, 7001, 0).words.at("a"));
  EXPECT_NE(ping.words.at("a"), draw(all, Seed{2}, 7000, 0).words.at("a"));
  EXPECT_NE(ping.words.at("a"), draw(all, Seed{1}, 7000, 1).words.at("a"));
}

TEST(Vary, DistributionsHaveTheirParameters) {
  const auto all = variations(
      "vary: {u: {uniform: [2, 4]}, n: {normal: [10, 3]}, i: {integer: [-1, 1]}, c: {choice: [mud, sand]}, l: {list: [5, 6, "
      "7]}}");
  double u = 0, n = 0, n2 = 0, i = 0;
  int sand = 0;
  constexpr int pings = 20000;
  for (int ping = 1; ping <= pings; ++ping) {
    const Draws d = draw(all, Seed{3}, static_cast<std::uint64_t>(ping), 0);
    const double value = d.numbers.at("u"), whole = d.numbers.at("i");
    ASSERT_TRUE(value >= 2 && value <= 4);
    ASSERT_TRUE(whole == -1 || whole == 0 || whole == 1);
    ASSERT_EQ(d.words.at("l"), std::to_string(5 + (ping - 1) % 3));
    ASSERT_FALSE(d.numbers.contains("c"));
    u += value, i += whole, n += d.numbers.at("n"), n2 += std::pow(d.numbers.at("n") - 10, 2);
    sand += d.words.at("c") == "sand" ? 1 : 0;
  }
  EXPECT_NEAR(u / pings, 3, 0.02);
  EXPECT_NEAR(i / pings, 0, 0.03);
  EXPECT_NEAR(n / pings, 10, 0.1);
  EXPECT_NEAR(std::sqrt(n2 / pings), 3, 0.06);
  EXPECT_NEAR(sand, pings / 2, 300);
}

TEST(Vary, PutsWordsWhereTheirNamesAre) {
  EXPECT_EQ(put_words("a: $x, b: $(x + 1), c: $xy, d: $", {{"x", "3"}}), "a: 3, b: $(x + 1), c: $xy, d: $");
}

TEST(Vary, RefusesUnknownDistributions) {
  EXPECT_THAT(complaint("x: {uniform: [2, 1]}"), HasSubstr("must go from low to high"));
  EXPECT_THAT(complaint("x: {unifrom: [1, 2]}"), HasSubstr("needs one of uniform"));
  EXPECT_THAT(complaint("x: {}"), HasSubstr("needs one of uniform"));
  EXPECT_THAT(complaint("x: {uniform: [1, 2], normal: [1, 2]}"), HasSubstr("needs one of uniform"));
  EXPECT_THAT(complaint("x: {normal: [1, -2]}"), HasSubstr("deviation"));
  EXPECT_THAT(complaint("x: {integer: [1.5, 2]}"), HasSubstr("whole numbers"));
  EXPECT_EQ(complaint("x: {list: [1]}"), "");
}

}  // namespace
}  // namespace sonar::dataset
