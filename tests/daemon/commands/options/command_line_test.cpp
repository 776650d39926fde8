// The user's options replace values of the configuration file; options that are absent change nothing.
#include "daemon/commands/options/command_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/config/load_config.hpp"

namespace sonar {
namespace {

Command parse(std::vector<std::string> words) {
  words.insert(words.begin(), "sonard");
  std::vector<char*> arguments;
  for (std::string& w : words) arguments.push_back(w.data());
  arguments.push_back(nullptr);
  return parse_command_line(static_cast<int>(words.size()), arguments.data());
}

/// Returns a configuration with this engine section, changed by the options.
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

/// Applies these options to a configuration without control interfaces.
Result<void> deaf_with(const std::string& clock, const std::vector<std::string>& words) {
  auto config = parse_config(
      "world: {scene: demo.yaml}\nvehicles: [{name: rov}]\nsonars: [{name: a, profile: oculus-m1200d, bind_ip: "
      "127.0.0.2}]\ncontrol: {stream: off, http: off}\nclock: " +
          clock + "\n",
      "test.yaml", {});
  if (!config) throw std::runtime_error(config.error().text);
  return override_config(*config, std::get<RunCommand>(parse(words)));
}

int usage_error(const std::vector<std::string>& words) {
  const Command command = parse(words);
  const auto* leave = std::get_if<Leave>(&command);
  return leave == nullptr ? 0 : leave->exit_code;
}

TEST(CommandLine, TheClockOfTheOptionReplacesThatOfTheFile) {
  EXPECT_TRUE(deaf_with("realtime", {"run", "x.yaml"}));
  EXPECT_THAT(deaf_with("realtime", {"run", "x.yaml", "--clock", "lockstep"}).error().text,
              ::testing::StartsWith("--clock: lockstep advances time"));
  EXPECT_THAT(deaf_with("lockstep", {"run", "x.yaml"}).error().text,
              ::testing::StartsWith("test.yaml:5:8: clock: lockstep advances"));
  EXPECT_TRUE(deaf_with("lockstep", {"run", "x.yaml", "--clock", "realtime"}));
}

TEST(CommandLine, APlanOfFaultsNeedsArming) {
  const std::string plan = "realtime\nfaults: {plan: [{do: L05}]}";
  EXPECT_THAT(
      deaf_with(plan, {"run", "x.yaml"}).error().text,
      ::testing::StartsWith("test.yaml:6:16: faults.plan: faults act only when they are armed: add armed: true, or start"));
  EXPECT_TRUE(deaf_with(plan, {"run", "x.yaml", "--faults"}));
}

TEST(CommandLine, SwitchesOfTheModelReachTheEngine) {
  const Switches given = overridden({"run", "x.yaml", "--expected-power", "--fixed-fan", "16"}).engine.switches;
  Switches expected = product_switches;
  expected.expected_power = true;
  expected.fixed_fan = 16;
  EXPECT_EQ(given, expected);
}

TEST(CommandLine, EveryPartOfTheModelIsSwitchedByItsName) {
  for (const NamedSwitch& part : named_switches)
    for (const bool on : {true, false}) {
      SCOPED_TRACE(part.name);
      // The file has the opposite value, so that only this option can cause it.
      const std::string file = std::string("{") + part.name + (on ? ": off}" : ": on}");
      Switches expected = product_switches;
      expected.*part.is_on = on;
      EXPECT_EQ(overridden({"run", "x.yaml", option_of(part), on ? "on" : "off"}, file).engine.switches, expected);
    }
}

TEST(CommandLine, TheDemoTakesNoConfiguration) {
  EXPECT_EQ(usage_error({"--demo", "my.yaml"}), 64);
  EXPECT_EQ(usage_error({"run", "my.yaml", "--demo"}), 64);
  EXPECT_EQ(usage_error({"run", "--demo"}), 0);
}

const RunCommand* run_of(const Command& command) { return std::get_if<RunCommand>(&command); }

TEST(CommandLine, TheDemoHasTheRequestedSonar) {
  const auto sonar_of = [](const std::vector<std::string>& words) -> std::string {
    const Command command = parse(words);
    auto config = demo_config();
    if (run_of(command) == nullptr || !run_of(command)->demo || !override_config(*config, *run_of(command))) return "refused";
    return config->sonars.at(0).profile.model->profile;
  };
  EXPECT_EQ(sonar_of({"--demo"}), "oculus-m1200d");
  EXPECT_EQ(sonar_of({"--demo", "oculus"}), "oculus-m1200d");
  EXPECT_EQ(sonar_of({"--demo", "blueview"}), "blueview-p900-90");
  EXPECT_EQ(sonar_of({"--demo", "aris"}), "aris-3000");
  EXPECT_EQ(sonar_of({"--demo", "3d15"}), "waterlinked-3d15");
  EXPECT_EQ(sonar_of({"--demo", "ping360"}), "ping360");
  EXPECT_EQ(sonar_of({"--demo", "surveyor"}), "surveyor-240");
  EXPECT_EQ(sonar_of({"--demo", "omniscan"}), "omniscan-450");
  EXPECT_EQ(sonar_of({"--demo", "ping1d"}), "ping1d");
  EXPECT_EQ(sonar_of({"--demo", "s500"}), "s500");
  EXPECT_EQ(sonar_of({"--demo", "dvl"}), "dvl-a50");
  EXPECT_EQ(sonar_of({"--demo", "m3"}), "m3");
  EXPECT_EQ(sonar_of({"--demo", "micron"}), "micron");
  EXPECT_EQ(sonar_of({"--demo", "norbit"}), "norbit-wbms");
  EXPECT_EQ(sonar_of({"run", "--demo=blueview", "--threads", "1"}), "blueview-p900-90");
  EXPECT_EQ(sonar_of({"--demo", "--threads", "1"}), "oculus-m1200d");
  EXPECT_EQ(sonar_of({"--profile", "blueview-m900-130"}), "blueview-m900-130");
  EXPECT_EQ(sonar_of({"--demo", "--profile", "oculus-m370s"}), "oculus-m370s");
  EXPECT_EQ(sonar_of({"--profile", "oculus-m1300d"}), "refused");
}

TEST(CommandLine, TheSonarIsChosenOnlyForTheDemo) {
  EXPECT_EQ(usage_error({"--demo", "bluview"}), 64);
  EXPECT_EQ(usage_error({"--demo", "blueview", "my.yaml"}), 64);
  EXPECT_EQ(usage_error({"--demo", "blueview", "--profile", "oculus-m370s"}), 64);
  EXPECT_EQ(usage_error({"my.yaml", "--profile", "oculus-m370s"}), 64);
}

TEST(CommandLine, TheModeReachesTheEngine) {
  EXPECT_EQ(overridden({"--mode", "paper"}).engine.switches.mode, Mode::paper);
  EXPECT_EQ(overridden({"--mode", "raster"}).engine.switches.mode, Mode::raster);
  EXPECT_EQ(overridden({"--mode", "canonical"}, "{mode: paper}").engine.switches.mode, Mode::canonical);
}

TEST(CommandLine, PartsThatTheModeLeavesOutAreNotSwitchedOn) {
  for (const NamedSwitch& part : named_switches) {
    const std::string option = option_of(part);
    EXPECT_THROW(overridden({"--mode", "paper", option, "on"}), std::runtime_error) << option;
    EXPECT_THROW(overridden({option, "on"}, "{mode: raster}"), std::runtime_error) << option;
    EXPECT_NO_THROW(overridden({"--mode", "paper", option, "off"})) << option;
  }
  EXPECT_THROW(overridden({"--fixed-fan", "8", "--multipath", "on"}), std::runtime_error);
  EXPECT_NO_THROW(overridden({"--fixed-fan", "8", "--specular", "on"}));
  EXPECT_NO_THROW(overridden({"--mode", "paper"}, "{specular: on}"));  // the file's own setting is logged, not refused
}

TEST(CommandLine, OnlyGivenSwitchesReplaceTheFilesValues) {
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
                               "--engine", "cuda", "--log-format", "json", "--log-level", "error"});
  EXPECT_EQ(c.clock, ClockMode::stepped);
  EXPECT_EQ(c.engine.threads, 3);
  EXPECT_EQ(c.seed, 9u);
  EXPECT_EQ(c.engine.simd, SimdLevel::portable);
  EXPECT_EQ(overridden({"--simd", "auto"}).engine.simd, SimdLevel::avx512)
      << "the best of the program, even if SONARD_SIMD differs";
  EXPECT_EQ(c.engine.device, EngineDevice::cuda);
  EXPECT_EQ(text_of(c.sonars.at(0).bind_ip), "127.0.0.9");
  EXPECT_EQ(text_of(c.sonars.at(0).advertise_ip), "127.0.0.9");
  EXPECT_TRUE(c.log.json);
  EXPECT_EQ(c.log.level, LogLevel::error);
}

TEST(CommandLine, AddressesThatCannotServeAreRefused) {
  EXPECT_THROW(overridden({"--bind", "0.0.0.0"}), std::runtime_error);
  EXPECT_THROW(overridden({"--bind", "localhost"}), std::runtime_error);
}

/// Returns addresses, ports and device ids as text: everything that two daemons on one computer must not share.
std::string places_of(const Config& c) {
  std::string text;
  for (const SonarConfig& s : c.sonars)
    text += text_of(s.bind_ip) + " " + text_of(s.advertise_ip) + " " + text_of(s.status_to.at(0)) + " " +
            std::to_string(s.device_id) + "\n";
  for (const PoseListener& l : {c.poses.protobuf, c.poses.json, c.control.stream, c.control.http})
    text += l.enabled ? text_of(l.at) + "\n" : "off\n";
  for (const MavlinkConfig& m : c.poses.mavlink) text += text_of(m.at) + "\n";
  return text;
}
Result<Config> moved(const std::vector<std::string>& words, const std::string& bind_ip, const std::string& poses) {
  auto config = parse_config("world: {scene: demo.yaml}\nvehicles: [{name: rov}]\nposes: " + poses +
                                 "\nsonars:\n  - {name: a, profile: oculus-m1200d, bind_ip: " + bind_ip +
                                 "}\n  - {name: b, profile: oculus-m750d, bind_ip: 127.0.0.3}\n",
                             "test.yaml", {});
  if (!config) return config;
  if (const auto r = override_config(*config, std::get<RunCommand>(parse(words))); !r) return tl::make_unexpected(r.error());
  return config;
}

TEST(CommandLine, TheNumberOfClientsIsForEverySonar) {
  EXPECT_EQ(overridden({"--demo"}).sonars.at(0).max_clients, 1);
  const Config c = *moved({"run", "x.yaml", "--clients", "5"}, "127.0.0.2", "{}");
  EXPECT_EQ(c.sonars.at(0).max_clients, 5);
  EXPECT_EQ(c.sonars.at(1).max_clients, 5);
  EXPECT_EQ(usage_error({"--demo", "--clients", "0"}), 64);
  EXPECT_EQ(usage_error({"--demo", "--clients", "17"}), 64);
}

TEST(CommandLine, AnOffsetMovesWhatTwoDaemonsWouldShare) {
  const std::string poses = "{json: off, mavlink: [{endpoint: 'udpin:127.0.0.1:14551'}, {endpoint: 'udpout:127.0.0.1:14600'}]}";
  EXPECT_EQ(places_of(*moved({"run", "x.yaml", "--offset", "2"}, "127.0.0.2", poses)),
            "127.0.2.2 127.0.2.2 127.255.255.255:0 7201\n127.0.2.3 127.0.2.3 127.255.255.255:0 7202\n"
            "127.0.0.1:14790\noff\n127.0.0.1:14790\n127.0.0.1:8108\n127.0.0.1:14571\n127.0.0.1:14600\n");
  EXPECT_EQ(places_of(*moved({"run", "x.yaml", "--offset", "0"}, "192.168.2.42", poses)),
            places_of(*moved({"run", "x.yaml"}, "192.168.2.42", poses)));
}

TEST(CommandLine, AnOffsetDoesNotMoveAGivenAddress) {
  const Config c = *moved({"run", "x.yaml", "--offset", "1", "--bind", "192.168.2.42"}, "127.0.0.2", "{}");
  EXPECT_EQ(text_of(c.sonars.at(0).bind_ip), "192.168.2.42");
  EXPECT_EQ(text_of(c.sonars.at(1).bind_ip), "127.0.1.3");
}

TEST(CommandLine, AnOffsetThatCannotApplyIsRefused) {
  const auto why = [](const std::string& offset, const std::string& bind_ip, const std::string& poses) {
    const auto config = moved({"run", "x.yaml", "--offset", offset}, bind_ip, poses);
    return config ? std::string("moved") : config.error().text;
  };
  EXPECT_THAT(
      why("1", "192.168.2.42", "{}"),
      ::testing::StartsWith("--offset: only sonars on 127.x.x.x can be moved, and sonar \"a\" has 192.168.2.42: give it"));
  EXPECT_THAT(why("9", "127.0.250.2", "{}"), ::testing::HasSubstr("the third number of 127.0.250.2 would exceed 255"));
  EXPECT_THAT(why("9", "127.0.0.2", "{json: '127.0.0.1:65500'}"),
              ::testing::HasSubstr("the port of 127.0.0.1:65500 would exceed 65535"));
  EXPECT_EQ(why("9", "127.0.0.2", "{json: '127.0.0.1:0'}"), "moved");
  // Addresses that would coincide with one of the daemon without an offset.
  const auto links = [](const std::string& more) { return "{mavlink: [{endpoint: 'udpin:127.0.0.1:14550'}" + more + "]}"; };
  EXPECT_EQ(
      why("22", "127.0.0.2", links("")),
      "--offset: poses.mavlink would be at 127.0.0.1:14770, where poses.protobuf is without an offset; give another offset");
  EXPECT_EQ(why("21", "127.0.0.2", links("")), "moved");
  EXPECT_THAT(why("1", "127.0.0.2", links(", {endpoint: 'udpin:127.0.0.1:14560'}")),
              ::testing::HasSubstr("127.0.0.1:14560, where poses.mavlink is"));
  EXPECT_EQ(why("1", "127.0.0.2", links(", {endpoint: 'udpout:127.0.0.1:14560'}")), "moved");
  EXPECT_THAT(why("1", "127.0.0.2, device_id: 6902", "{}"),
              ::testing::HasSubstr("sonar \"a\" would have device_id 7002, which sonar \"b\" has without an offset"));
  EXPECT_THAT(why("1", "127.0.1.3", "{}"), ::testing::HasSubstr("sonar \"b\" would have 127.0.1.3, which sonar \"a\" has"));
  EXPECT_EQ(usage_error({"--demo", "--offset", "100"}), 64);
}

TEST(CommandLine, WrongValuesAreUsageErrors) {
  EXPECT_EQ(usage_error({"run", "--noise", "maybe"}), 64);
  EXPECT_EQ(usage_error({"run", "--fixed-fan", "-1"}), 64);
  EXPECT_EQ(usage_error({"run", "--mode", "raser"}), 64);
  EXPECT_EQ(usage_error({"run", "--expected-pwoer"}), 64);
}

}  // namespace
}  // namespace sonar
