// Runs every oracle that is a render file (*.yaml in this folder): renders it in this process, checks its expectations and
// records the figures for the table. A file with a wrong expectation must fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/oracles/expectation.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::render {
namespace {

using testing::AllOf;
using testing::HasSubstr;

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

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<Verdict> verdicts_on(const std::string& text, const std::string& name, const std::filesystem::path& folder) {
  const auto input = parse_render_file(text, name, folder);
  if (!input) throw std::runtime_error(input.error().text);
  auto verdicts = check_expectations(*input, 2);
  if (!verdicts) throw std::runtime_error(verdicts.error().text);
  return *std::move(verdicts);
}

class OracleFile : public testing::TestWithParam<std::string> {};

TEST_P(OracleFile, IsAsExpected) {
  const std::filesystem::path file = SONARD_SOURCE_DIR "/tests/oracles/" + GetParam() + ".yaml";
  for (const Verdict& v : verdicts_on(text_of(file), file.string(), file.parent_path())) {
    record(v);
    EXPECT_TRUE(v.met) << v.sentence();
  }
}
INSTANTIATE_TEST_SUITE_P(Yaml, OracleFile, testing::ValuesIn(oracle_files()), [](const auto& file) {
  std::string name = file.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

const std::string point =
    "scene: {objects: [{type: point, target_strength_db: -10, pose: {xyz_m: [4, 0, -10]}}]}\n"
    "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10]}}\nengine: {noise: off}\n"
    "water: {temperature_c: 10, salinity_psu: 0, sound_speed_mps: 1500}\n";

std::vector<Verdict> judged(const std::string& expect) {
  return verdicts_on(point + "sonar: {ping: {range_m: 6, beams: 65}}\nexpect: [" + expect + "]\n", "r.yaml", ".");
}
std::string refusal(const std::string& expect) {
  try {
    judged(expect);
  } catch (const std::runtime_error& refused) {
    return refused.what();
  }
  return "accepted";
}

TEST(Expectations, AreMetWhenTrueAndNotWhenWrong) {
  const auto met = [](const std::string& expect) { return judged(expect).at(0).met; };
  EXPECT_TRUE(met("{measure: peak_range_m, value: 4, within: 0.002}"));
  EXPECT_FALSE(met("{measure: peak_range_m, value: 4.01, within: 0.002}"));
  EXPECT_TRUE(met("{measure: peak_level_db, value: SL - 40*log10(4) - 8*alpha - 10, within: 0.1}"));
  EXPECT_FALSE(met("{measure: peak_level_db, value: SL - 40*log10(4) - 8*alpha - 9.8, within: 0.1}"));
  EXPECT_TRUE(met("{measure: peak_bearing_deg, value: 0, within: 0.01}"));
  EXPECT_FALSE(met("{measure: peak_bearing_deg, value: 1, within: 0.01}"));
  EXPECT_TRUE(met("{measure: mean_level_db, at_most: 180}"));
  EXPECT_FALSE(met("{measure: mean_level_db, at_least: 180}"));
  EXPECT_TRUE(met("{measure: peak_level_db, range_m: [3.9, 4.1], less: {range_m: [4.5, 5]}, at_least: 100}"));
}

TEST(Expectations, FailureNamesFileQuantityMeasuredAndExpected) {
  EXPECT_THAT(
      judged("{measure: peak_range_m, value: 5, within: 0.01, what: a point}").at(0).sentence(),
      AllOf(HasSubstr("r.yaml:6"), HasSubstr("a point"), HasSubstr("peak_range_m 4"), HasSubstr("expected 5 within 0.01")));
}

TEST(Expectations, WindowsAreInRealRangesEvenIfRowsBeginLater) {
  const std::string late = "sonar: {ping: {range_m: 6, range_start_m: 4, rows: 100}}\nexpect: [{measure: mean_level_db, ";
  EXPECT_TRUE(verdicts_on(point + late + "range_m: [4, 4.1], at_least: 0}]\n", "r.yaml", ".").at(0).met);
  EXPECT_THROW(verdicts_on(point + late + "range_m: [3.8, 3.9], at_least: 0}]\n", "r.yaml", "."), std::runtime_error);
}

TEST(Expectations, SlopesNeedASweep) {
  EXPECT_THROW(judged("{measure: peak_level_db, over: slope, against: r, value: -40, within: 1}"), std::runtime_error);
  EXPECT_THROW(judged("{measure: peak_level_db, value: nothing_known, within: 1}"), std::runtime_error);
  EXPECT_THROW(judged("{measure: peak_level_db, range_m: [50, 60], value: 0, within: 1}"), std::runtime_error);
  EXPECT_THROW(judged("{measure: coverage_percent, at_least: 99}"), std::runtime_error);  // the scene has no bed
}

TEST(Expectations, RefusalsNameWhatIsMissing) {
  EXPECT_THAT(refusal("{measure: peak_level_db, value: 1}"), HasSubstr("within"));
  EXPECT_THAT(refusal("{measure: peak_level_db}"), HasSubstr("at_least"));
  EXPECT_THAT(refusal("{measure: peek, at_most: 1}"), HasSubstr("peak"));
  EXPECT_THAT(refusal(""), HasSubstr("expect"));
}

TEST(Expectations, OfTheManualsExampleAreMet) {
  const std::string manual = text_of(SONARD_SOURCE_DIR "/docs/render.md");
  const std::string begin = "```yaml\n";
  const std::size_t from = manual.find(begin) + begin.size();
  for (const Verdict& v : verdicts_on(manual.substr(from, manual.find("```", from) - from), "render.md", "."))
    EXPECT_TRUE(v.met) << v.sentence();
}

}  // namespace
}  // namespace sonar::render
