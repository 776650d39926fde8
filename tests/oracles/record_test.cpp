// Tests the records of oracles: a figure out of tolerance fails the test, records can be read back, old records are removed.
#include "tests/oracles/record.hpp"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace sonar::test {
namespace {

/// A separate folder for the records of these tests, so that they are not mixed with the real figures.
class RecordOracle : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    setenv("SONARD_ORACLES", folder_.c_str(), 1);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string read(const std::string& name) const {
    std::ifstream in(folder_ / name);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) /
                                  (std::string("record_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(RecordOracle, WritesALineForEachAndReplacesWhatAnOlderRunLeft) {
  const std::string name = "07-RecordOracle.WritesALineForEachAndReplacesWhatAnOlderRunLeft.jsonl";
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / name) << "old\n";
  record_oracle(7, "say \"slope\"", 30, 30.25, 0.3, "dB/decade");
  record_at_least(7, "share", 0.99, 0.995, "");
  record_below(7, "error", 1e-4, 2e-5, "");
  EXPECT_EQ(read(name),
            "{\"oracle\": 7, \"what\": \"say \\\"slope\\\"\", \"kind\": \"equal\", \"expected\": 30, \"measured\": 30.25, "
            "\"tolerance\": 0.3, \"unit\": \"dB/decade\", \"pass\": true, \"test\": "
            "\"RecordOracle.WritesALineForEachAndReplacesWhatAnOlderRunLeft\"}\n"
            "{\"oracle\": 7, \"what\": \"share\", \"kind\": \"at_least\", \"expected\": 0.99, \"measured\": 0.995, "
            "\"tolerance\": 0, \"unit\": \"\", \"pass\": true, \"test\": "
            "\"RecordOracle.WritesALineForEachAndReplacesWhatAnOlderRunLeft\"}\n"
            "{\"oracle\": 7, \"what\": \"error\", \"kind\": \"below\", \"expected\": 0.0001, \"measured\": 2e-05, "
            "\"tolerance\": 0, \"unit\": \"\", \"pass\": true, \"test\": "
            "\"RecordOracle.WritesALineForEachAndReplacesWhatAnOlderRunLeft\"}\n");
}

TEST_F(RecordOracle, FailsTheTestWhenOutOfToleranceAndRecordsThatToo) {
  EXPECT_NONFATAL_FAILURE(record_oracle(8, "level", 0, 0.31, 0.3, "dB"), "out of tolerance");
  EXPECT_NONFATAL_FAILURE(record_oracle(8, "level", 0, std::nan(""), 0.3, "dB"), "out of tolerance");
  EXPECT_NONFATAL_FAILURE(record_at_least(8, "share", 0.99, 0.98, ""), "out of tolerance");
  EXPECT_NONFATAL_FAILURE(record_at_least(8, "share", 0.99, std::nan(""), ""), "out of tolerance");
  EXPECT_NONFATAL_FAILURE(record_below(8, "error", 1, 1, ""), "out of tolerance");
  const std::string lines = read("08-RecordOracle.FailsTheTestWhenOutOfToleranceAndRecordsThatToo.jsonl");
  EXPECT_NE(lines.find("\"measured\": NaN"), std::string::npos);
  EXPECT_EQ(lines.find("true"), std::string::npos);
}

TEST_F(RecordOracle, WritesNothingWithoutTheFolderButStillJudges) {
  unsetenv("SONARD_ORACLES");
  record_oracle(9, "level", 0, 0.1, 0.3, "dB");
  EXPECT_NONFATAL_FAILURE(record_oracle(9, "level", 0, 1, 0.3, "dB"), "out of tolerance");
  EXPECT_FALSE(std::filesystem::exists(folder_));
}

}  // namespace
}  // namespace sonar::test
