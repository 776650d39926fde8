// An invalid plan of faults is refused. The error has file and line and says what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "daemon/config/load_config.hpp"

namespace sonar::fault_plan_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Returns the error of a configuration with this plan, which begins in line 7, or "".
std::string why(const std::string& plan) {
  const std::string directory = ::testing::TempDir();
  std::ofstream(directory + "/scene.yaml") << "name: test\n";
  const std::string sonar = "- {profile: oculus-m1200d, vehicle: rov, name: ";
  const auto config =
      parse_config("world: {scene: scene.yaml}\nvehicles: [{name: rov}]\nsonars:\n" + sonar + "front, bind_ip: 127.0.0.2}\n" +
                       sonar + "rear, bind_ip: 127.0.0.3}\nfaults:\n  plan:\n" + plan,
                   "sonard.yaml", directory);
  return config ? std::string() : config.error().text;
}

TEST(FaultPlan, AValidPlanIsAccepted) {
  EXPECT_EQ(why("  - {do: L05, at: {ping: 20}}\n"
                "  - {do: overheating, sonar: front, for: {seconds: 900}}\n"
                "  - {do: D16, sonar: rear}\n"),
            "");
}

TEST(FaultPlan, APlanWithAMistakeIsRefusedWithItsLine) {
  struct Case {
    const char* plan;
    std::vector<const char*> said;
  };
  for (const Case& c : {
           Case{"  - {do: silent-opem}\n", {"sonard.yaml:8:", "\"silent-opem\" is not a fault", "silent-open"}},
           Case{"  - {do: F01}\n  - {do: F01, name: b, with: {bytes: -3}}\n",
                {"sonard.yaml:9:", "fault b", "bytes must be a whole number from", "\"-3\""}},
           Case{"  - {do: F01, with: {byte: 3}}\n", {"sonard.yaml:8:", "no parameter \"byte\"", "bytes"}},
           Case{"  - {do: D16}\n  - {do: D17, sonar: rear}\n", {"sonard.yaml:9:", "both write", "rate", "name different sonars"}},
           Case{"  - {do: L05, name: a}\n  - {do: P02, name: a}\n", {"sonard.yaml:9:", "two faults a"}},
           Case{"  - {do: L05, sonar: left}\n", {"sonard.yaml:8:", "\"left\" is unknown"}},
           Case{"  - {do: G01}\n", {"sonard.yaml:8:", "G01 has no effect on the sonar rear"}},
           Case{"  - {do: L06}\n", {"sonard.yaml:8:", "L06 has no effect"}},
           Case{"  - {do: L05, at: {ping: 3, time_s: 2}}\n", {"sonard.yaml:8:", "at: give one of"}},
           Case{"  - {do: L05, for: {seconds: 86401}}\n", {"sonard.yaml:8:", "86400"}},
           Case{"  - {do: L05, til: 4}\n", {"sonard.yaml:8:", "til"}},
       }) {
    SCOPED_TRACE(c.plan);
    const std::string text = why(c.plan);
    for (const char* words : c.said) EXPECT_THAT(text, HasSubstr(words));
  }
}

}  // namespace
}  // namespace sonar::fault_plan_test
