// Tests texts of sonarctl that need no device: the abilities of the terminal, the line under a picture, a daemon's status.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "clients/sonarctl/control/control_commands.hpp"
#include "clients/sonarctl/control/status_text.hpp"
#include "clients/sonarctl/terminal.hpp"
#include "tests/protocol/control/message_from.hpp"

namespace sonar::clients {
namespace {

using testing::HasSubstr;

TerminalColours colours_with(bool is_terminal, std::map<std::string, std::string> variables) {
  return choose_colours({is_terminal, [variables](const std::string& name) -> std::optional<std::string> {
                           const auto found = variables.find(name);
                           return found == variables.end() ? std::nullopt : std::optional(found->second);
                         }});
}

TEST(Terminal, DetectsTheColoursOfTheTerminal) {
  using enum TerminalColours;
  EXPECT_EQ(colours_with(true, {{"TERM", "xterm"}, {"LANG", "en_GB.UTF-8"}}), palette_256);
  EXPECT_EQ(colours_with(true, {{"TERM", "xterm"}, {"COLORTERM", "truecolor"}, {"LC_ALL", "C.utf8"}}), true_colour);
  EXPECT_EQ(colours_with(true, {{"TERM", "xterm"}, {"COLORTERM", "24bit"}}), true_colour);
  EXPECT_EQ(colours_with(false, {{"TERM", "xterm"}, {"COLORTERM", "truecolor"}}), none) << "a pipe";
  EXPECT_EQ(colours_with(true, {{"TERM", "xterm"}, {"NO_COLOR", "1"}}), none);
  EXPECT_EQ(colours_with(true, {{"TERM", "xterm"}, {"NO_COLOR", ""}}), palette_256) << "set but empty counts as not set";
  EXPECT_EQ(colours_with(true, {{"TERM", "dumb"}}), none);
  EXPECT_EQ(colours_with(true, {}), none);
  EXPECT_EQ(colours_with(true, {{"TERM", "xterm"}, {"LC_ALL", "C"}, {"LANG", "en_GB.UTF-8"}}), none)
      << "the first that is set counts";
}

protocol::HostPing ping(std::uint32_t id) {
  protocol::HostPing ping;
  ping.facts = {id, 512, 400, 8, 0.025, 10, 2.1e6, 1000};
  return ping;
}

TEST(ViewCaption, HasRateAndGaps) {
  const auto missing = [](std::uint64_t pings) { return protocol::Host::Counts{0, 0, 0, pings}; };
  ViewCaption figures("Hz");
  figures.add(ping(7), missing(0), 100.0);
  EXPECT_EQ(figures.text(), "ping 7  10.00 m  2.1 MHz  512 beams x 400 rows");
  figures.add(ping(8), missing(0), 100.1);
  EXPECT_EQ(figures.text(), "ping 8  10.00 m  2.1 MHz  512 beams x 400 rows  10.0 Hz  no gaps");
  figures.add(ping(11), missing(2), 100.2);
  EXPECT_THAT(figures.text(), HasSubstr("10.0 Hz  2 missed"));
  for (std::uint32_t i = 0; i < 50; ++i) figures.add(ping(12 + i), missing(2), 101.0 + 0.5 * i);
  EXPECT_THAT(figures.text(), HasSubstr("  2.0 Hz")) << "the recent rate, not the mean";
  EXPECT_EQ(figures.pings(), 53u);
  ViewCaption unnumbered("lines/s");
  for (std::uint32_t i = 0; i < 2; ++i) unnumbered.add(ping(i), std::nullopt, i);
  EXPECT_THAT(unnumbered.text(), testing::EndsWith("  1.0 lines/s"));
}

TEST(StatusText, HasAllFactsOfTheStatus) {
  const auto status = control::message_from<v1::DaemonStatus>(R"(
      version: "0.1.0" config: "a.yaml" scene: "demo:harbour" clock: "realtime" engine: "embree" seed: 1 uptime_s: 3725
      resident_mb: 120
      environment { temperature_c { value: 12 } salinity_psu { value: 30 } ph { value: 8 } sound_speed_mps { value: 0 } }
      sonars {
        name: "front" profile: "oculus-m1200d" listens: "0.0.0.0:52100" advertised: "10.0.0.5"
        addresses { protocol: "tcp" address: "0.0.0.0:52100" carries: "settings, pings" }
        addresses { protocol: "status" address: "10.0.0.255:52102" sonar_speaks_first: true }
        pinging: true range_m: 10 frequency_hz: 2.1e6 beams: 512 rows: 437
        position { x: -6 z: -3 } orientation { w: 0.9961946980917455 y: 0.08715574274765817 }  # 10 degrees bow down
        clients { address: "10.0.0.9:4000" pings_written: 12 pings_dropped: 1 bytes_written: 2500000 connected_s: 130 }
      }
      vehicles { name: "rov" source: "json 127.0.0.1" stale: true }
      vehicles {
        name: "auv" source: "trajectory dive.tum"
        trajectory { file: "dive.tum" position_s: 12.34 duration_s: 60 speed: 2.5 paused: true loop: true }
      }
      vehicles {
        name: "boat" source: "trajectory way.csv"
        trajectory { file: "way.csv" position_s: 60 duration_s: 60 speed: 1 }
      }
      objects { name: "wall" material: "concrete" moving: true triangles: 12 }
      links { endpoint: "udpin:127.0.0.1:14551" vehicle: "rov" distances_sent: 7 distances_dropped: 2 })");
  const std::string text = text_from(status);
  for (const char* part :
       {"sonard 0.1.0  up 62 min  120 MB\n", "config    a.yaml\n", "scene     demo:harbour  seed 1  clock realtime\n",
        "water     12 C, 30 psu, pH 8, sound speed computed\n",
        "sonar     front  oculus-m1200d  2.1 MHz  10 m  standby  gain 0 dB  512 beams x 437 rows  transmitter off\n",
        "tcp        0.0.0.0:52100              settings, pings\n",
        "status     10.0.0.255:52102           sent without a request\n", "advertised as 10.0.0.5\n",
        "place   -6.00 0.00 -3.00 m, heading 90.0, bow-up pitch -10.0, roll 0.0 deg\n",
        "10.0.0.9:4000  12 pings, 1 dropped, 2.5 MB, 2 min\n", "from json 127.0.0.1  stale\n",
        "from trajectory dive.tum  at 12.3 of 60.0 s x2.5 looped paused\n",
        "from trajectory way.csv  at 60.0 of 60.0 s x1 ended\n", "moving  hidden\n",
        "mavlink   udpin:127.0.0.1:14551  rov  7 distances sent, 2 dropped\n"})
    EXPECT_THAT(text, HasSubstr(part));
}

TEST(StatusText, OfManyObjectsTheFirstAndThoseThatMoveAreListed) {
  v1::DaemonStatus status;
  for (int i = 0; i < 20; ++i) status.add_objects()->set_name("stone" + std::to_string(i));
  EXPECT_THAT(text_from(status),
              testing::AllOf(HasSubstr("stone11 "), testing::Not(HasSubstr("stone12 ")), HasSubstr("8 more, which do not move")));
  status.mutable_objects(19)->set_moving(true);
  EXPECT_THAT(text_from(status), testing::AllOf(HasSubstr("stone19 "), HasSubstr("7 more, which do not move")));
}

TEST(StatusText, ASonarWaitsOnlyWhileNoDriverIsConnected) {
  const auto text_of = [](const std::string& client) {
    return text_from(control::message_from<v1::DaemonStatus>(
        R"(sonars { addresses { protocol: "tcp" address: "10.0.0.5:1" carries: "pings" } )" + client + " }"));
  };
  EXPECT_THAT(text_of(""), HasSubstr("tcp        10.0.0.5:1                 pings; waits for the driver\n"));
  for (const char* listener : {R"(clients { address: "10.0.0.9:4000" })", R"(receivers: "224.0.0.96:4747")"})
    EXPECT_THAT(text_of(listener), HasSubstr("tcp        10.0.0.5:1                 pings\n"));
}

TEST(StatusText, CountsOneTickAsOne) {
  const auto status = control::message_from<v1::DaemonStatus>("sonars { figures { skipped_ticks: 1 } }");
  EXPECT_THAT(text_from(status), HasSubstr("0 refused, 1 tick skipped\n"));
}

TEST(StatusText, HasTheMeasuredRateBesideTheOneThatIsSet) {
  const auto text_of = [](const std::string& sonar) {
    return text_from(control::message_from<v1::DaemonStatus>("sonars { range_m: 10 pinging: true " + sonar + " }"));
  };
  EXPECT_THAT(text_of(R"(profile: "oculus-m1200d" rate_hz: 10 figures { made_hz: 7.24 })"),
              HasSubstr("  10 Hz, measured 7.2 Hz  gain"));
  EXPECT_THAT(text_of(R"(profile: "oculus-m1200d" rate_hz: 10)"), HasSubstr("  10 Hz  gain")) << "none was measured yet";
  EXPECT_THAT(text_of(R"(profile: "ping360" rate_hz: 1000 on_request: true figures { made_hz: 14 })"),
              HasSubstr("  on request, measured 14.0 lines/s  gain"));
  EXPECT_THAT(text_of(R"(profile: "omniscan-450" rate_hz: 10 figures { made_hz: 9.96 })"),
              HasSubstr("  10 Hz, measured 10.0 lines/s  gain"));
  EXPECT_THAT(text_of(R"(profile: "oculus-m1200d" rate_hz: 10 preview: true figures { made_hz: 4.97 })"),
              HasSubstr("  10 Hz, preview 5.0 Hz  gain"));
}

TEST(StatusText, CountsNoPingsOfAConnectionForCommands) {
  const auto text = text_from(control::message_from<v1::DaemonStatus>(
      R"(sonars { profile: "norbit-wbms" clients { address: "10.0.0.7:1" commands_only: true connected_s: 90 } })"));
  EXPECT_THAT(text, HasSubstr("10.0.0.7:1  commands only, 0.0 MB, 90 s\n"));
}

TEST(StatusText, PrintsHowLongAHostWithoutAConnectionIsSilent) {
  const auto text_of = [](const std::string& silent) {
    return text_from(control::message_from<v1::DaemonStatus>(R"(sonars { profile: "ping360" clients { address: "10.0.0.7:1" )" +
                                                             silent + " connected_s: 90 } }"));
  };
  EXPECT_THAT(text_of("silent_s: 41.2"), HasSubstr("0.0 MB, 90 s, last heard 41 s ago\n"));
  EXPECT_THAT(text_of("silent_s: 0.4"), HasSubstr("0.0 MB, 90 s\n"));
}

TEST(StatusText, PrintsEvents) {
  const auto text_of_event = [](const std::string& event) { return text_from(control::message_from<v1::Event>(event)); };
  EXPECT_EQ(text_of_event(R"(client { sonar: "front" client: "10.0.0.9:4000" connected: true })"),
            "client 10.0.0.9:4000 connected to front");
  EXPECT_EQ(text_of_event(R"(client { sonar: "front" client: "10.0.0.9:4000" why: "end of file" } unsent: 2)"),
            "client 10.0.0.9:4000 left front: end of file  (2 events before this one were not sent: too slow a reader)");
  EXPECT_EQ(text_of_event(R"(pose { vehicle: "rov" stale: true text: "no pose for 1 s" })"), "pose rov stale: no pose for 1 s");
  EXPECT_EQ(text_of_event(R"(scene { scene: "demo" text: "loaded" })"), "scene demo: loaded");
  EXPECT_EQ(
      text_of_event(R"(ping { sonar: "front" number: 5 range_m: 10 beams: 512 rows: 437 clients: 1 simulation_ms: 20.04 })"),
      "ping 5  front  10 m  512 beams x 437 rows  20.0 ms  1 client");
}

TEST(LoadScene, NamesFilesOfThisComputerInFull) {
  const std::string here = std::string(SONARD_SOURCE_DIR) + "/scenes/demo.yaml";
  const std::string relative = std::filesystem::relative(here).string();
  EXPECT_EQ(scene_path_for({"127.0.0.1", 14770}, relative), here);
  EXPECT_EQ(scene_path_for({"192.0.2.7", 14770}, relative), relative) << "of another computer we know nothing";
  EXPECT_EQ(scene_path_for({"127.0.0.1", 14770}, "no-such-scene.yaml"), "no-such-scene.yaml");
}

}  // namespace
}  // namespace sonar::clients
