// Texts of sonarctl that need no device: what the terminal can show, the line under a picture, a daemon's status.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "clients/sonarctl/control/control_commands.hpp"
#include "clients/sonarctl/control/status_text.hpp"
#include "clients/sonarctl/terminal.hpp"
#include "clients/sonarctl/view_caption.hpp"

namespace sonar::clients {
namespace {

using testing::HasSubstr;

TerminalColours colours_with(bool is_terminal, std::map<std::string, std::string> variables) {
  return choose_colours({is_terminal, [variables](const std::string& name) -> std::optional<std::string> {
                           const auto found = variables.find(name);
                           return found == variables.end() ? std::nullopt : std::optional(found->second);
                         }});
}

TEST(Terminal, ShowsWhatItCan) {
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

oculus::DecodedPing ping(std::uint32_t id) {
  oculus::DecodedPing decoded;
  decoded.head.fixed.ping_id = id;
  decoded.head.fixed.row_count = 400;
  decoded.head.fixed.beam_count = 512;
  decoded.head.fixed.range_resolution_m = 0.025;
  decoded.head.fixed.frequency_hz = 2.1e6;
  return decoded;
}

TEST(ViewCaption, TellRateAndGaps) {
  ViewCaption figures;
  figures.add(ping(7), 100.0);
  EXPECT_EQ(figures.text(), "ping 7  10.00 m  2.1 MHz  512 beams x 400 rows");
  figures.add(ping(8), 100.1);
  EXPECT_EQ(figures.text(), "ping 8  10.00 m  2.1 MHz  512 beams x 400 rows  10.0 Hz  no gaps");
  figures.add(ping(11), 100.2);
  EXPECT_THAT(figures.text(), HasSubstr("10.0 Hz  2 missed"));
  for (std::uint32_t i = 0; i < 50; ++i) figures.add(ping(12 + i), 101.0 + 0.5 * i);
  EXPECT_THAT(figures.text(), HasSubstr("  2.0 Hz")) << "of late, not of all time";
  EXPECT_EQ(figures.pings(), 53u);
}

TEST(StatusText, NamesEverything) {
  control::DaemonStatus status;
  status.version = "0.1.0", status.config = "a.yaml", status.scene = "demo:harbour", status.clock = "realtime";
  status.engine = "embree", status.seed = 1, status.uptime_s = 3725, status.resident_mb = 120;
  status.environment = {12, 30, 8, 0};
  control::SonarStatus sonar;
  sonar.name = "front", sonar.profile = "oculus-m1200d", sonar.listens = "0.0.0.0:52100", sonar.advertised = "10.0.0.5";
  sonar.status_to = {"10.0.0.255:52102"}, sonar.pinging = true, sonar.range_m = 10, sonar.rate_hz = 0, sonar.frequency_hz = 2.1e6;
  sonar.beams = 512, sonar.rows = 437, sonar.transmits = false;
  sonar.in_world = {{-6, 0, -3}, quat_from_rpy({0, rad_from_deg(10), 0})};
  sonar.clients.push_back({"10.0.0.9:4000", 12, 1, 2500000, 130});
  status.sonars.push_back(sonar);
  status.vehicles.push_back({"rov", "json 127.0.0.1", true, {}});
  status.vehicles.push_back(
      {"auv", "trajectory dive.tum", false, {}, control::TrajectoryStatus{"dive.tum", 12.34, 60, 2.5, true, true}});
  status.vehicles.push_back(
      {"boat", "trajectory way.csv", false, {}, control::TrajectoryStatus{"way.csv", 60, 60, 1, false, false}});
  status.objects.push_back({"wall", "concrete", true, false, 12, {}});
  const std::string text = text_from(status);
  for (const char* part :
       {"sonard 0.1.0  up 62 min  120 MB\n", "config    a.yaml\n", "scene     demo:harbour  seed 1  clock realtime\n",
        "water     12 C, 30 psu, pH 8, sound speed computed\n",
        "sonar     front  oculus-m1200d  2.1 MHz  10 m  standby  gain 0 dB  512 beams x 437 rows  transmitter off\n",
        "tcp 0.0.0.0:52100  advertised as 10.0.0.5  status -> 10.0.0.255:52102\n",
        "place   -6.00 0.00 -3.00 m, heading 90.0, pitch -10.0, roll 0.0 deg\n",
        "10.0.0.9:4000  12 pings, 1 dropped, 2.5 MB, 2 min\n", "from json 127.0.0.1  stale\n",
        "from trajectory dive.tum  at 12.3 of 60.0 s x2.5 looped paused\n",
        "from trajectory way.csv  at 60.0 of 60.0 s x1 ended\n", "moving  hidden\n"})
    EXPECT_THAT(text, HasSubstr(part));
}

TEST(StatusText, TellsEvents) {
  EXPECT_EQ(text_from(control::Event{control::ClientEvent{"front", "10.0.0.9:4000", true, ""}, 0}),
            "client 10.0.0.9:4000 connected to front");
  EXPECT_EQ(text_from(control::Event{control::ClientEvent{"front", "10.0.0.9:4000", false, "end of file"}, 2}),
            "client 10.0.0.9:4000 left front: end of file  (2 events before this one were not sent: too slow a reader)");
  EXPECT_EQ(text_from(control::Event{control::PoseEvent{"rov", true, "no pose for 1 s"}, 0}), "pose rov stale: no pose for 1 s");
  EXPECT_EQ(text_from(control::Event{control::SceneEvent{"demo", "loaded"}, 0}), "scene demo: loaded");
  EXPECT_THAT(text_from(control::Event{control::PingEvent{"front", 5, 0, {}, 10, 512, 437, 1, 20.04}, 0}),
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
