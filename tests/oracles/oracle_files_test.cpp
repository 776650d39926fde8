// Runs every oracle that is written as a render file (*.yaml beside this): renders it in process, holds it to what it expects
// and records the figures for the table. A file that expects the wrong thing must fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "daemon/commands/render/expectation.hpp"
#include "daemon/commands/render/render_job.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::render {
namespace {

std::vector<std::string> oracle_files() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(SONARD_SOURCE_DIR "/tests/oracles"))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

void record(const Verdict& v) {
  const Expectation& e = v.expectation;
  SCOPED_TRACE(v.sentence());
  switch (e.bound) {
    case Expectation::Bound::near:
      return test::record_oracle(e.oracle, e.what, v.expected, v.measured, e.within, unit_of(e));
    case Expectation::Bound::at_least:
      return test::record_at_least(e.oracle, e.what, v.expected, v.measured, unit_of(e));
    case Expectation::Bound::at_most:
      return test::record_below(e.oracle, e.what, v.expected, v.measured, unit_of(e));
  }
}

class OracleFile : public testing::TestWithParam<std::string> {};

TEST_P(OracleFile, IsAsExpected) {
  const auto input = load_render_input(SONARD_SOURCE_DIR "/tests/oracles/" + GetParam() + ".yaml");
  ASSERT_TRUE(input) << input.error().text;
  const auto verdicts = check_expectations(input->source, input->jobs, 2);
  ASSERT_TRUE(verdicts) << verdicts.error().text;
  ASSERT_FALSE(verdicts->empty());
  for (const Verdict& v : *verdicts) {
    record(v);
    EXPECT_TRUE(v.met) << v.sentence();
  }
}
INSTANTIATE_TEST_SUITE_P(Yaml, OracleFile, testing::ValuesIn(oracle_files()), [](const auto& file) {
  std::string name = file.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

}  // namespace
}  // namespace sonar::render
