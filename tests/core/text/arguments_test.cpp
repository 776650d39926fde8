// Errors of a command line: one sentence with option, value and the allowed values.
#include "core/text/arguments.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <CLI/CLI.hpp>

namespace sonar::text {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

/// Runs a program with one command; returns its error for `words`, or an empty text.
std::string complaint(const std::vector<std::string>& words) {
  CLI::App app("", "tool");
  app.require_subcommand(1);
  CLI::App& command = *app.add_subcommand("look", "");
  int threads = 0, depth = 0;
  double rate = 0;
  bool quiet = false;
  std::string file, mode, shape, colour;
  std::vector<double> place;
  command.add_option("FILE", file, "what to look at")->required();
  command.add_option("--threads", threads, "how many")->check(whole_number(0, 256))->envname("TOOL_THREADS");
  command.add_option("--depth", depth, "not in help")->check(whole_number())->envname("TOOL_DEPTH")->group("");
  CLI::Option* given_rate = command.add_option("--rate", rate, "looks a second")->check(number(0.5, 10));
  command.add_option("--mode", mode, "how")->check(one_of({"fast", "careful"}))->excludes(given_rate);
  command.add_option("--shape", shape, "")->check(one_of({"ring"}));
  command.add_option("--colour", colour, "")->check(one_of({"a1", "b2", "c3", "d4", "e5", "f6", "g7", "violet", "h8"}));
  command.add_option("--place", place, "X,Y,Z")->expected(3)->delimiter(',')->check(number())->needs(given_rate);
  command.add_flag("--quiet", quiet, "");
  try {
    std::vector<const char*> line{"tool"};
    for (const std::string& word : words) line.push_back(word.c_str());
    parse(app, static_cast<int>(line.size()), line.data());
  } catch (const CLI::ParseError& error) {
    return complaint_about(app, error, words);
  }
  return {};
}

TEST(Arguments, NumbersAreWholeDecimalAndInTheirRange) {
  EXPECT_THAT(complaint({"look", "x", "--threads", "256", "--rate", "+.5"}), IsEmpty());
  EXPECT_EQ(complaint({"look", "x", "--threads", "abc"}),
            "--threads: \"abc\" is not a whole number from 0 to 256 (tool look --help)");
  for (const char* wrong : {"257", "-1", "0x10", "010", "1.5", "1e2", "", " 3", "99999999999999999999"})
    EXPECT_THAT(complaint({"look", "x", "--threads", wrong}), HasSubstr("is not a whole number from 0 to 256")) << wrong;
  EXPECT_EQ(complaint({"look", "x", "--rate", "fast"}), "--rate: \"fast\" is not a number from 0.5 to 10 (tool look --help)");
  for (const char* wrong : {"0.4", "11", "nan", "inf", "0x1p3", "1 ", "+-1", "1e999"})
    EXPECT_THAT(complaint({"look", "x", "--rate", wrong}), HasSubstr("is not a number from 0.5 to 10")) << wrong;
}

TEST(Arguments, EmptyOnesAreRefused) {
  EXPECT_EQ(complaint({"look", ""}), "argument 2: it is empty: write a value, or leave it out (tool look --help)");
  EXPECT_THAT(complaint({"look", "x", "--quiet", ""}), HasSubstr("--help"));
}

TEST(Arguments, ChoicesAreNamed) {
  EXPECT_EQ(complaint({"look", "x", "--mode", "fats"}), "--mode: \"fats\" is not one of: fast, careful (tool look --help)");
  EXPECT_THAT(complaint({"look", "x", "--shape", "disc"}), HasSubstr("--shape: \"disc\" is not one of: ring"));
  EXPECT_THAT(complaint({"look", "x", "--colour", "voilet"}), HasSubstr("unknown value \"voilet\"; did you mean \"violet\"?"));
}

TEST(Arguments, MissingAndUnexpectedArgumentsAreNamed) {
  EXPECT_EQ(complaint({}), "a command is required: look (tool --help)");
  EXPECT_EQ(complaint({"look"}), "FILE is required: what to look at (tool look --help)");
  EXPECT_EQ(complaint({"look", "x", "y"}), "unexpected argument \"y\" (tool look --help)");
  EXPECT_THAT(complaint({"look", "x", "-z"}), StartsWith("unknown option \"-z\"; options of tool look: "));
  EXPECT_THAT(complaint({"look", "x", "--threads"}), StartsWith("--threads: 1 required"));
  EXPECT_THAT(complaint({"look", "x", "--threads", "1", "--threads", "2"}), HasSubstr("--threads: "));
  EXPECT_THAT(complaint({"look", "x", "--rate", "1", "--place", "1,2"}), HasSubstr("--place: At least 3 required"));
  EXPECT_THAT(complaint({"look", "x", "--rate", "1", "--place", "1,b,3"}), HasSubstr("--place: \"b\" is not a number"));
  EXPECT_THAT(complaint({"look", "x", "--quiet=often"}), HasSubstr("--quiet"));
}

TEST(Arguments, OptionsThatBelongTogetherOrNotAreNamed) {
  EXPECT_THAT(complaint({"look", "x", "--rate", "1", "--mode", "fast"}), HasSubstr("--rate excludes --mode"));
  EXPECT_THAT(complaint({"look", "x", "--place", "1,2,3"}), HasSubstr("--place requires --rate"));
}

TEST(Arguments, UnknownWordsComeFirstAndSuggestTheNearest) {
  EXPECT_EQ(complaint({"lok"}), "unknown command \"lok\"; did you mean \"look\"? (tool --help)");
  EXPECT_EQ(complaint({"look", "--tread=3"}), "unknown option \"--tread\"; did you mean \"--threads\"? (tool look --help)");
  EXPECT_THAT(complaint({"lok", "--help"}), StartsWith("unknown command \"lok\""));
  EXPECT_THAT(complaint({"look", "--help"}), IsEmpty());
  EXPECT_THAT(complaint({"look", "--", "--tread"}), IsEmpty());
}

TEST(Arguments, ErrorsAreOneLineForAnyInput) {
  EXPECT_THAT(complaint({"look", "x", "--mode", "a\nb\x1b[2J"}), HasSubstr("\"a?b?[2J\" is not one of"));
}

TEST(Arguments, TheErrorNamesTheEnvironmentVariableOfAWrongValue) {
  ::setenv("TOOL_THREADS", "many", 1);
  EXPECT_THAT(complaint({"look", "x"}), HasSubstr("TOOL_THREADS (environment): \"many\" is not a whole number"));
  EXPECT_THAT(complaint({"look", "x", "--threads", "few"}), HasSubstr("--threads: \"few\" is not a whole number"));
  ::unsetenv("TOOL_THREADS");
  ::setenv("TOOL_DEPTH", "-1", 1);
  EXPECT_THAT(complaint({"look", "x"}), HasSubstr("TOOL_DEPTH (environment): \"-1\" is not a whole number"));
  ::unsetenv("TOOL_DEPTH");
}

}  // namespace
}  // namespace sonar::text
