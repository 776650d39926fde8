// Tests that each figure is written to one file with all data for the table; without the folder nothing is written.
#include "tests/reliability/record.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "nlohmann/json.hpp"

namespace sonar::test {
namespace {

TEST(ReliabilityRecord, IsOneFileWithDateAndMachine) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "reliability_record_test";
  std::filesystem::remove_all(folder);
  setenv("SONARD_RELIABILITY", folder.c_str(), 1);
  EXPECT_TRUE(record_reliability({"cycles", "3 \"more\"", "0", false, "build/load --only cycles"}));
  EXPECT_TRUE(record_reliability({"cycles", "0", "0", true, "build/load --only cycles"})) << "the newer one replaces it";
  std::ifstream in(folder / "cycles.json");
  const auto record = nlohmann::json::parse(in);
  EXPECT_EQ(record.at("item"), "cycles");
  EXPECT_EQ(record.at("figure"), "0");
  EXPECT_EQ(record.at("passed"), true);
  EXPECT_NE(record.at("machine").get<std::string>().find(" x "), std::string::npos);
  EXPECT_EQ(record.at("date").get<std::string>().size(), 10u);
  unsetenv("SONARD_RELIABILITY");
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(record_reliability({"cycles", "0", "0", true, ""}));
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace sonar::test
