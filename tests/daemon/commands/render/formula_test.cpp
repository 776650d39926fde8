// Formulas of render files: their values, and the errors for those that cannot be read.
#include "daemon/commands/render/formula.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sonar::render::formula_test {
namespace {

using testing::HasSubstr;

double value_of(std::string_view formula, const Values& values = {}) {
  const auto value = evaluate(formula, values);
  EXPECT_TRUE(value) << (value ? "" : value.error().text);
  return value.value_or(std::nan(""));
}
std::string refusal(std::string_view formula, const Values& values = {}) {
  const auto value = evaluate(formula, values);
  return value ? "accepted" : value.error().text;
}

TEST(Formula, OperatorsHaveTheUsualPrecedence) {
  EXPECT_DOUBLE_EQ(value_of("1 + 2*3"), 7);
  EXPECT_DOUBLE_EQ(value_of("10 - 4 - 3"), 3);
  EXPECT_DOUBLE_EQ(value_of("-2^2"), -4);
  EXPECT_DOUBLE_EQ(value_of("2^-1"), 0.5);
  EXPECT_DOUBLE_EQ(value_of("2^3^2"), 512);
  EXPECT_DOUBLE_EQ(value_of("(1 + 2)*-3/4"), -2.25);
  EXPECT_DOUBLE_EQ(value_of("1.5e3 + .5"), 1500.5);
}

TEST(Formula, NamesAndFunctionsAreEvaluated) {
  EXPECT_DOUBLE_EQ(value_of("SL - 40*log10(r)", {{"SL", 210}, {"r", 10}}), 170);
  EXPECT_DOUBLE_EQ(value_of("deg(asin(sin(rad(30))))"), 30);
  EXPECT_DOUBLE_EQ(value_of("sqrt(abs(0 - 9))"), 3);
  EXPECT_DOUBLE_EQ(value_of("cos(pi)"), -1);
}

TEST(Formula, ErrorsHaveAReason) {
  EXPECT_THAT(refusal("2*"), HasSubstr("ends where a value is expected"));
  EXPECT_THAT(refusal(""), HasSubstr("ends where a value is expected"));
  EXPECT_THAT(refusal("(1 + 2"), HasSubstr("a ) is missing"));
  EXPECT_THAT(refusal("1 2"), HasSubstr("unexpected \"2\""));
  EXPECT_THAT(refusal("q + 1", {{"r", 1}}), HasSubstr("unknown name q; known names: r"));
  EXPECT_THAT(refusal("sin 3"), HasSubstr("parentheses"));
  EXPECT_THAT(refusal("1/0"), HasSubstr("not a finite number"));
  EXPECT_THAT(refusal("log10(0 - 1)"), HasSubstr("not a finite number"));
  EXPECT_THAT(refusal("1.2.3"), HasSubstr("is not a number"));
  EXPECT_THAT(refusal(std::string(100000, '(')), HasSubstr("nested too deeply"));
  EXPECT_THAT(refusal(std::string(100000, '-') + "1"), HasSubstr("nested too deeply"));
}

TEST(Substitute, ReplacesNamesAndFormulasOnly) {
  const auto text = substitute("[$r, $(2*r + (1)), 3$, $5, $$r]\n", {{"r", 1.25}}, "f.yaml");
  ASSERT_TRUE(text) << text.error().text;
  EXPECT_EQ(*text, "[1.25, 3.5, 3$, $5, $1.25]\n");
}

TEST(Substitute, ErrorsHaveFileAndLine) {
  const auto text = substitute("a\nb: $(r\n", {{"r", 1}}, "f.yaml");
  ASSERT_FALSE(text);
  EXPECT_THAT(text.error().text, HasSubstr("f.yaml:2: "));
}

}  // namespace
}  // namespace sonar::render::formula_test
