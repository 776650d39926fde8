// What the user types reaches the configuration, and wins over the file; what is not typed changes nothing.
#include "daemon/command_line.hpp"

#include <gtest/gtest.h>

namespace sonar {
namespace {

Command parse(std::vector<std::string> words) {
  words.insert(words.begin(), "sonard");
  std::vector<char*> arguments;
  for (std::string& w : words) arguments.push_back(w.data());
  arguments.push_back(nullptr);
  return parse_command_line(static_cast<int>(words.size()), arguments.data());
}

/// The file's engine section, as overridden.
Config overridden(const std::vector<std::string>& words, const std::string& engine = "{}") {
  auto config = parse_config(
      "world: {scene: demo.yaml}\nvehicles: [{name: rov}]\nsonars: [{name: a, profile: oculus-m1200d, bind_ip: "
      "127.0.0.2}]\nengine: " +
          engine + "\n",
      "test.yaml", {});
  if (!config) throw std::runtime_error(config.error().text);
  const Command command = parse(words);
  if (const auto r = override_config(*config, std::get<RunCommand>(command)); !r) throw std::runtime_error(r.error().text);
  return *std::move(config);
}

int usage_error(const std::vector<std::string>& words) {
  const Command command = parse(words);
  const auto* leave = std::get_if<Leave>(&command);
  return leave == nullptr ? 0 : leave->exit_code;
}

TEST(CommandLine, SwitchesOfTheModelReachTheEngine) {
  const Switches given = overridden({"run", "x.yaml", "--expected-power", "--noise", "off", "--fixed-fan", "16"}).engine.switches;
  EXPECT_TRUE(given.expected_power);
  EXPECT_FALSE(given.noise);
  EXPECT_EQ(given.fixed_fan, 16);
}

TEST(CommandLine, SwitchesWinOverTheFileOnlyWhenGiven) {
  const std::string file = "{expected_power: true, noise: off, fixed_fan: 8}";
  const Switches kept = overridden({"--demo"}, file).engine.switches;
  EXPECT_TRUE(kept.expected_power);
  EXPECT_FALSE(kept.noise);
  EXPECT_EQ(kept.fixed_fan, 8);
  const Switches replaced = overridden({"--demo", "--noise", "on", "--fixed-fan", "0"}, file).engine.switches;
  EXPECT_TRUE(replaced.noise);
  EXPECT_EQ(replaced.fixed_fan, 0);
}

TEST(CommandLine, TheOtherRunOptionsReplaceTheFilesValues) {
  const Config c = overridden({"--clock", "stepped", "--threads", "3", "--seed", "9", "--simd", "portable", "--bind", "127.0.0.9",
                               "--log-format", "json", "--log-level", "error"});
  EXPECT_EQ(c.clock, ClockMode::stepped);
  EXPECT_EQ(c.engine.threads, 3);
  EXPECT_EQ(c.seed, 9u);
  EXPECT_EQ(c.engine.simd, SimdLevel::portable);
  EXPECT_EQ(text_of(c.sonars.at(0).bind_ip), "127.0.0.9");
  EXPECT_EQ(text_of(c.sonars.at(0).advertise_ip), "127.0.0.9");
  EXPECT_TRUE(c.log.json);
  EXPECT_EQ(c.log.level, LogLevel::error);
}

TEST(CommandLine, AddressesThatCannotServeAreRefused) {
  EXPECT_THROW(overridden({"--bind", "0.0.0.0"}), std::runtime_error);
  EXPECT_THROW(overridden({"--bind", "localhost"}), std::runtime_error);
}

TEST(CommandLine, WrongValuesAreUsageErrors) {
  EXPECT_EQ(usage_error({"run", "--noise", "maybe"}), 64);
  EXPECT_EQ(usage_error({"run", "--fixed-fan", "-1"}), 64);
  EXPECT_EQ(usage_error({"run", "--expected-pwoer"}), 64);
}

}  // namespace
}  // namespace sonar
