// The configuration file: every key, every default, every refusal with file, line, column and key.
#include "daemon/config/load_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "daemon/config/products.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::config_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string directory() {
  static const std::string made = [] {
    const std::string d = ::testing::TempDir();
    std::ofstream(d + "/scene.yaml") << "name: test\n";
    return d;
  }();
  return made;
}
Result<Config> parse(const std::string& yaml) { return parse_config(yaml, "sonard.yaml", directory()); }
std::string why(const std::string& yaml) {
  const auto config = parse(yaml);
  return config ? "accepted" : config.error().text;
}

const std::string world = "world: {scene: scene.yaml}\n";
const std::string vehicles = "vehicles: [{name: rov}]\n";
const std::string sonar = "sonars:\n  - name: front\n    profile: oculus-m1200d\n    bind_ip: 127.0.0.2\n";

TEST(Config, DefaultsAreTheManuals) {
  const auto c = parse(world + vehicles + sonar);
  ASSERT_TRUE(c) << c.error().text;
  EXPECT_EQ(c->seed, 1u);
  const SonarConfig& s = c->sonars.at(0);
  EXPECT_EQ(text_of(s.advertise_ip), "127.0.0.2");
  EXPECT_EQ(text_of(s.status_to.at(0).ip), "127.255.255.255");
  EXPECT_EQ(s.status_to.at(0).port, 0);
  EXPECT_EQ(s.device_id, 7001);
  EXPECT_EQ(s.max_clients, 1);
  EXPECT_EQ(s.when_full, WhenClientsFull::close_new);
  EXPECT_EQ(s.outbox.depth, 1);
  EXPECT_EQ(s.options.at("before_first_fire"), "dummies");
  EXPECT_EQ(text_of(c->poses.protobuf.at), "127.0.0.1:14770");
  EXPECT_EQ(text_of(c->poses.json.at), "127.0.0.1:14771");
  EXPECT_EQ(c->poses.extrapolate_max_s, 0.2);
  EXPECT_EQ(c->poses.stale_after_s, 1.0);
  EXPECT_EQ(c->poses.max_jump_m, 50);
  EXPECT_EQ(c->poses.on_stale, OnStale::hold);
  EXPECT_EQ(c->clock, ClockMode::realtime);
  EXPECT_TRUE(c->engine.switches.noise);
}

constexpr const char* least =
    "world: {scene: demo.yaml}\nvehicles: [{name: rov}]\n"
    "sonars: [{name: a, profile: oculus-m1200d, bind_ip: 127.0.0.2}]\nengine: ";

TEST(Config, EveryPartOfTheModelIsSwitchedByItsName) {
  for (const NamedSwitch& part : named_switches)
    for (const bool on : {true, false}) {
      const auto c = parse(std::string(least) + "{" + part.name + (on ? ": on}" : ": off}"));
      ASSERT_TRUE(c) << c.error().text;
      Switches expected = product_switches;
      expected.*part.is_on = on;
      EXPECT_EQ(c->engine.switches, expected) << part.name;
    }
  const auto c = parse(std::string(least) + "{mode: raster, fixed_fan: 5}");
  ASSERT_TRUE(c) << c.error().text;
  EXPECT_EQ(c->engine.switches.mode, Mode::raster);
  EXPECT_EQ(c->engine.switches.fixed_fan, 5);
}

TEST(Config, PartsThatTakeNoEffectTogetherAreRefused) {
  const auto refusal = [](const std::string& engine) {
    const auto c = parse(least + engine);
    return c ? std::string("accepted") : c.error().text;
  };
  EXPECT_NE(refusal("{fixed_fan: 8, multipath: on}").find("a fixed fan leaves out multipath"), std::string::npos);
  EXPECT_NE(refusal("{mode: paper, noise: on}").find("mode paper leaves out noise"), std::string::npos);
  EXPECT_NE(refusal("{leak: on, mode: raster}").find("mode raster leaves out leak"), std::string::npos);
  EXPECT_EQ(refusal("{mode: paper, noise: off}"), "accepted");
  EXPECT_EQ(refusal("{fixed_fan: 8, specular: on}"), "accepted");
}

TEST(Config, EveryKeyIsRead) {
  const auto c = parse(R"(
world:
  scene: scene.yaml
  seed: 18446744073709551615
  origin: {lat: 47.60, lon: -122.33, alt: 0}
  water: {temperature_c: 12.5, salinity_psu: 31, ph: 7.9, sound_speed_mps: 1490}
vehicles:
  - name: rov
    initial_pose: {frame: NED_FRD, xyz_m: [1, 2, 3], rpy_deg: [0, 0, 90]}
    trajectory: orbit
  - name: buoy
sonars:
  - name: front
    profile: oculus-m750d
    vehicle: buoy
    mount: {frame: FRD, xyz_m: [0.3, 0.2, 0.1], rpy_deg: [0, -15, 0]}
    bind_ip: 192.168.2.42
    advertise_ip: 192.168.2.43
    netmask: 255.255.0.0
    status_to: [192.168.255.255, '10.1.2.3:52103']
    groups: [239.1.2.3, 192.168.255.255]
    device_id: 9
    clients: {max: 3, when_full: take_over}
    outbox: {depth: 2, full: drop_newest}
    options: {before_first_fire: pings, dummy_period_ms: 500}
poses:
  protobuf: off
  json: 0.0.0.0:15000
  allow_from: [192.168.2.0/24, 10.0.0.1]
  extrapolate_max_s: 0.5
  stale_after_s: 2
  on_stale: stop
  max_jump_m: 5
engine: {threads: 3, device: auto, simd: portable, expected_power: true, noise: off, fixed_fan: 16}
clock: stepped
log: {level: debug, format: json}
)");
  ASSERT_TRUE(c) << c.error().text;
  EXPECT_EQ(c->seed, 18446744073709551615u);
  EXPECT_EQ(c->water.salinity_psu, 31);
  EXPECT_EQ(c->water.sound_speed_mps, 1490);
  const Pose rov = c->vehicles.at(0).initial_pose;
  EXPECT_EQ(rov.position_m.x, 2);
  EXPECT_EQ(rov.position_m.y, 1);
  EXPECT_EQ(rov.position_m.z, -3);
  EXPECT_NEAR(deg_from_rad(heading_rad(rov.orientation)), 90, 1e-9);
  EXPECT_TRUE(c->vehicles.at(0).orbits);
  const SonarConfig& s = c->sonars.at(0);
  EXPECT_EQ(s.vehicle, 1u);
  EXPECT_EQ(s.mount.position_m.y, -0.2);
  EXPECT_EQ(s.mount.position_m.z, -0.1);
  EXPECT_NEAR(rotate(s.mount.orientation, {1, 0, 0}).z, -std::sin(rad_from_deg(15)), 1e-12) << "pitched down";
  EXPECT_EQ(text_of(s.advertise_ip), "192.168.2.43");
  EXPECT_EQ(text_of(s.status_to.at(1)), "10.1.2.3:52103");
  EXPECT_EQ(text_of(s.groups.at(0)), "239.1.2.3");
  EXPECT_EQ(text_of(s.groups.at(1)), "192.168.255.255");
  EXPECT_EQ(s.device_id, 9);
  EXPECT_EQ(s.max_clients, 3);
  EXPECT_EQ(s.when_full, WhenClientsFull::take_over);
  EXPECT_EQ(s.outbox.depth, 2);
  EXPECT_EQ(s.outbox.when_full, WhenFull::drop_newest);
  EXPECT_EQ(s.options.at("dummy_period_ms"), "500");
  EXPECT_FALSE(c->poses.protobuf.enabled);
  EXPECT_EQ(c->poses.json.at.port, 15000);
  EXPECT_TRUE(c->poses.allow_from.at(0).contains({192, 168, 2, 200}));
  EXPECT_FALSE(c->poses.allow_from.at(0).contains({192, 168, 3, 200}));
  EXPECT_FALSE(c->poses.allow_from.at(1).contains({10, 0, 0, 2}));
  EXPECT_EQ(c->poses.on_stale, OnStale::stop);
  EXPECT_EQ(c->engine.threads, 3);
  EXPECT_EQ(c->engine.device, EngineDevice::automatic);
  EXPECT_EQ(c->engine.simd, SimdLevel::portable);
  EXPECT_FALSE(c->engine.switches.noise);
  EXPECT_EQ(c->engine.switches.fixed_fan, 16);
  EXPECT_EQ(c->clock, ClockMode::stepped);
  EXPECT_TRUE(c->log.json);
}

TEST(Config, LimitsAndPriorityAreRead) {
  const std::string base = world + vehicles + sonar;
  const auto usual = parse(base);
  ASSERT_TRUE(usual);
  EXPECT_EQ(usual->limits.clients, 256);
  EXPECT_EQ(usual->limits.input_bytes_per_s, 1u << 20);
  EXPECT_EQ(usual->limits.stall, std::chrono::seconds(10));
  EXPECT_EQ(usual->limits.dead_peer, std::chrono::seconds(15));
  EXPECT_EQ(usual->limits.spare_descriptors, 32);
  EXPECT_EQ(usual->engine.io_priority, 0);
  const auto c =
      parse(base +
            "limits: {clients: 7, control_clients: 3, viewers: 2, input_bytes_per_s: 4096, control_message_bytes: 2048, stall_s: "
            "0.5, dead_peer_s: 4,"
            " spare_descriptors: 9}\nengine: {io_priority: 5}\n");
  ASSERT_TRUE(c) << c.error().text;
  EXPECT_EQ(c->limits.clients, 7);
  EXPECT_EQ(c->limits.control_clients, 3);
  EXPECT_EQ(c->limits.viewers, 2);
  EXPECT_EQ(c->limits.input_bytes_per_s, 4096u);
  EXPECT_EQ(c->limits.control_message_bytes, 2048u);
  EXPECT_EQ(c->limits.stall, std::chrono::milliseconds(500));
  EXPECT_EQ(c->limits.dead_peer, std::chrono::seconds(4));
  EXPECT_EQ(c->limits.spare_descriptors, 9);
  EXPECT_EQ(c->engine.io_priority, 5);
  EXPECT_THAT(why(base + "limits: {clients: 0}\n"), HasSubstr("limits.clients"));
  EXPECT_THAT(why(base + "limits: {control_message_bytes: 1048577}\n"), HasSubstr("limits.control_message_bytes"));
  EXPECT_THAT(why(base + "limits: {dead_peer_s: 1}\n"), HasSubstr("limits.dead_peer_s"));
  EXPECT_THAT(why(base + "limits: {stal_s: 1}\n"), HasSubstr("stall_s"));
  EXPECT_THAT(why(base + "engine: {io_priority: 100}\n"), HasSubstr("engine.io_priority"));
}

TEST(Config, OverloadIsRead) {
  EXPECT_EQ(parse(world + vehicles + sonar)->sonars.at(0).bearings, Bearings::are_true);
  for (const auto& [bearing, means] :
       {std::pair("true", Bearings::are_true), {"device_sound_speed", Bearings::follow_device_speed}})
    EXPECT_EQ(parse(world + vehicles + sonar + "    bearing: " + bearing + "\n")->sonars.at(0).bearings, means);
  EXPECT_THAT(why(world + vehicles + sonar + "    bearing: false\n"), StartsWith("sonard.yaml:7:14: sonars[0].bearing: "));
  EXPECT_EQ(parse(world + vehicles + sonar)->sonars.at(0).overload, Overload::slow);
  EXPECT_EQ(parse(world + vehicles + sonar + "    overload: count\n")->sonars.at(0).overload, Overload::count);
  EXPECT_THAT(why(world + vehicles + sonar + "    overload: counts\n"),
              AllOf(StartsWith("sonard.yaml:7:15: sonars[0].overload: "), HasSubstr("did you mean \"count\"?")));
}

TEST(Config, UnknownKeysNameTheNearest) {
  EXPECT_THAT(why(world + vehicles + sonar + "    bind_pi: 127.0.0.3\n"),
              StartsWith("sonard.yaml:7:5: sonars[0].bind_pi: unknown key; did you mean \"bind_ip\"?"));
  EXPECT_THAT(why(world + vehicles + sonar + "pose: {}\n"), HasSubstr("did you mean \"poses\"?"));
  EXPECT_THAT(why(world + vehicles + sonar + "    options: {gain_ehco: auto}\n"),
              StartsWith("sonard.yaml:7:15: sonars[0].options.gain_ehco: unknown key; did you mean \"gain_echo\"?"));
  EXPECT_THAT(why(world + vehicles + sonar + "    options: {before_first_fire: pings, gain_echo: aut}\n"),
              AllOf(StartsWith("sonard.yaml:7:52: sonars[0].options.gain_echo: "), HasSubstr("did you mean \"auto\"?")));
  for (const char* beyond : {"0", "9", "60001"})
    EXPECT_EQ(why(world + vehicles + sonar + "    options: {dummy_period_ms: " + beyond + "}\n"),
              std::string("sonard.yaml:7:32: sonars[0].options.dummy_period_ms: must be between 10 and 60000, found ") + beyond);
  EXPECT_EQ(why(world + vehicles + sonar + "    options: {row_rate_hz: 9999}\n"),
            "sonard.yaml:7:28: sonars[0].options.row_rate_hz: must be between 10000 and 10000000, found 9999");
  for (const char* real : {"1e-300", "2.5"})
    EXPECT_THAT(why(world + vehicles + sonar + "    options: {device_type: " + real + "}\n"),
                AllOf(HasSubstr("sonars[0].options.device_type: "), HasSubstr("must be a whole decimal number")))
        << real;
  EXPECT_THAT(why(world + vehicles + sonar + "    clients: {when_full: close}\n"), HasSubstr("close_new"));
}

TEST(Config, OptionsReachTheModel) {
  const auto c = parse(world + vehicles + sonar + "    options: {lf_aperture_deg: 100, hf_aperture_deg: product}\n");
  ASSERT_TRUE(c) << c.error().text;
  const auto& modes = c->sonars.at(0).profile.model->modes;
  EXPECT_NEAR(deg_from_rad(modes.at(0).horizontal_aperture_rad), 100, 1e-4);
  EXPECT_NEAR(deg_from_rad(modes.at(1).horizontal_aperture_rad), 60, 1e-4);
  EXPECT_THAT(why(world + vehicles + sonar + "    options: {lf_aperture_deg: 180}\n"),
              StartsWith("sonard.yaml:7:32: sonars[0].options.lf_aperture_deg: "));
}

TEST(Config, EveryErrorHasTheMistakeAndTheLine) {
  const auto with = [&](const std::string& more) { return why(world + vehicles + sonar + more); };
  EXPECT_THAT(why("world: {scene: nowhere.yaml}\n" + vehicles + sonar),
              HasSubstr("sonard.yaml:1:16: world.scene: no such file: \"nowhere.yaml\"; looked in "));
  EXPECT_EQ(why("world: {seed: 2}\n" + vehicles + sonar), "sonard.yaml:1:8: world.scene: required key is missing");
  EXPECT_THAT(why("world: {sceen: scene.yaml}\n" + vehicles + sonar), HasSubstr("unknown key; did you mean \"scene\"?"));
  EXPECT_THAT(why(vehicles + sonar), HasSubstr("world: required key is missing"));
  EXPECT_THAT(why(world + sonar), HasSubstr("vehicles: required key is missing"));
  EXPECT_THAT(why(world + vehicles), HasSubstr("sonars: required key is missing"));
  EXPECT_THAT(why(world + vehicles + "sonars: [{name: a, profile: oculus-m12, bind_ip: 127.0.0.2}]\n"),
              HasSubstr("oculus-m1200d"));
  EXPECT_THAT(why(world + vehicles + "sonars: [{name: a, profile: oculus-m1200d, bind_ip: 127.0.0.256}]\n"),
              HasSubstr("sonars[0].bind_ip: \"127.0.0.256\" is not an IPv4 address"));
  EXPECT_THAT(why(world + vehicles + "sonars: [{name: a, profile: oculus-m1200d, bind_ip: 0.0.0.0}]\n"),
              HasSubstr("advertise_ip"));
  EXPECT_THAT(why(world + "vehicles: [{name: a}, {name: a}]\n" + sonar), HasSubstr("vehicles[1].name: \"a\" is used twice"));
  EXPECT_THAT(why(world + "vehicles: [{name: a}, {name: b}]\n" + sonar), HasSubstr("vehicle"));
  EXPECT_THAT(with("    vehicle: rvo\n"), HasSubstr("rov"));
  EXPECT_THAT(with("  - {name: front, profile: oculus-m1200d, bind_ip: 127.0.0.3}\n"), HasSubstr("\"front\" is used twice"));
  EXPECT_THAT(with("  - {name: rear, profile: oculus-m1200d, bind_ip: 127.0.0.2}\n"),
              HasSubstr("each sonar needs its own address"));
  EXPECT_THAT(with("  - {name: rear, profile: oculus-m1200d, bind_ip: 127.0.0.3, device_id: 7001}\n"),
              HasSubstr("already used by sonar"));
  EXPECT_THAT(with("    device_id: 0\n"), HasSubstr("sonars[0].device_id"));
  EXPECT_THAT(with("    clients: {max: 17}\n"), HasSubstr("sonars[0].clients.max"));
  EXPECT_THAT(with("    outbox: {depth: 4}\n"), HasSubstr("sonars[0].outbox.depth"));
  EXPECT_THAT(with("    mount: {xyz_m: [0, 0, 0]}\n"), HasSubstr("frame"));
  EXPECT_THAT(with("    mount: {frame: FRD, xyz_m: [0, 0]}\n"), HasSubstr("xyz_m"));
  EXPECT_THAT(with("    status_to: [nowhere]\n"), HasSubstr("sonars[0].status_to[0]: is not an address"));
  EXPECT_THAT(with("    status_to: ['127.0.0.1:99999']\n"), HasSubstr("port must be a number"));
  EXPECT_THAT(with("poses: {json: 127.0.0.1}\n"), HasSubstr("poses.json: is not an address; write it as 127.0.0.1:14770"));
  EXPECT_THAT(with("poses: {json: 192.168.1.2:14771}\n"), HasSubstr("need poses.allow_from"));
  EXPECT_THAT(with("poses: {allow_from: [10.0.0.0/33]}\n"), HasSubstr("poses.allow_from[0]: is not an address range"));
  EXPECT_THAT(with("poses: {json: 127.0.0.1:14770}\n"), HasSubstr("poses.json: the same address as poses.protobuf"));
  EXPECT_THAT(with("poses: {stale_after_s: 0}\n"), HasSubstr("poses.stale_after_s"));
  EXPECT_THAT(with("engine: {quality: default}\n"), HasSubstr("engine.quality: unknown key"));
  EXPECT_THAT(with("clock: folow\n"), HasSubstr("did you mean \"follow\""));
  EXPECT_THAT(with("log: {level: loud}\n"), HasSubstr("log.level"));
  const std::string hot = "world: {scene: scene.yaml, water: {temperature_c: 30}}\n";
  EXPECT_THAT(why(hot + vehicles + sonar),
              HasSubstr("world.water.temperature_c: from 30 C on a real driver warns, at 35 C it commands standby;"));
  EXPECT_EQ(why("world: {scene: scene.yaml, water: {temperature_c: 30, allow_hot: true}}\n" + vehicles + sonar), "accepted");
  EXPECT_THAT(why("world: {scene: scene.yaml, water: {sound_speed_mps: 340}}\n" + vehicles + sonar),
              HasSubstr("sound_speed_mps"));
  EXPECT_THAT(why(world + "vehicles: [{name: a, trajectory: path.csv}]\n" + sonar), HasSubstr("vehicles[0].trajectory"));
}

TEST(Config, AClockThatNobodyCanAdvanceIsRefused) {
  const auto with = [](const std::string& more) {
    const auto config = parse(world + vehicles + sonar + more);
    if (!config) return config.error().text;
    const auto passes = check_time_can_pass(*config);
    return passes ? std::string("accepted") : passes.error().text;
  };
  EXPECT_THAT(with("control: {stream: off, http: off}\nclock: lockstep\n"),
              HasSubstr("sonard.yaml:8:8: clock: lockstep advances time by control requests, and control.stream and "
                        "control.http are off"));
  EXPECT_EQ(with("clock: lockstep\ncontrol: {stream: off}\n"), "accepted");
  const std::string deaf = "control: {stream: off, http: off}\nposes: {protobuf: off, json: off";
  EXPECT_THAT(with("clock: follow\n" + deaf + "}\n"), HasSubstr("clock: follow advances time by the stamps of poses"));
  EXPECT_EQ(with("clock: follow\n" + deaf + ", mavlink: 'udpin:127.0.0.1:0'}\n"), "accepted");
  EXPECT_EQ(with("clock: stepped\n" + deaf + "}\n"), "accepted");
}

TEST(Config, ErrorsOfConfigurationsExitWith78AndMissingFilesWith66) {
  EXPECT_EQ(exit_code(parse("world: 3\n").error().kind), 78);
  EXPECT_EQ(exit_code(load_config(directory() + "/none.yaml").error().kind), 66);
}

TEST(Config, AddressesAreReadStrictly) {
  EXPECT_TRUE(parse_ipv4("1.2.3.4"));
  for (const char* wrong : {"", "1.2.3", "1.2.3.4.5", "1.2.3.4 ", "a.b.c.d", "1.2.3.-4", "01.2.3.4x"})
    EXPECT_FALSE(parse_ipv4(wrong)) << wrong;
}

TEST(Config, AddressesAndNamesThatCannotWorkAreRefused) {
  const auto with = [](const std::string& name, const std::string& addresses) {
    const auto config = parse("world: {scene: scene.yaml}\nvehicles: [{name: rov}]\nsonars: [{name: " + name +
                              ", profile: oculus-m1200d, " + addresses + "}]\n");
    return config ? std::string("accepted") : config.error().text;
  };
  EXPECT_EQ(with("front left \u00e9", "bind_ip: 192.168.2.4, netmask: 255.255.240.0"), "accepted");
  for (const char* mask : {"0.0.0.0", "255.255.255.255", "128.0.0.0"})
    EXPECT_EQ(with("front", std::string("bind_ip: 192.168.2.4, netmask: ") + mask), "accepted") << mask;
  for (const char* mask : {"255.0.255.0", "0.0.0.255", "255.255.255.1"})
    EXPECT_THAT(with("front", std::string("bind_ip: 192.168.2.4, netmask: ") + mask), HasSubstr("is not a netmask")) << mask;
  for (const char* ip : {"224.0.0.1", "239.1.2.3", "255.255.255.255", "240.0.0.1"}) {
    EXPECT_THAT(with("front", std::string("bind_ip: ") + ip), HasSubstr("is a multicast, broadcast or reserved address")) << ip;
    EXPECT_THAT(with("front", std::string("bind_ip: 0.0.0.0, advertise_ip: ") + ip), HasSubstr("advertise_ip")) << ip;
  }
  EXPECT_THAT(with("front", "bind_ip: 0.0.0.0, advertise_ip: 0.0.0.0"), HasSubstr("drivers cannot connect to 0.0.0.0"));
  for (const char* name : {"\"a\\nb\"", "a/b", "\"\\x7f\"", "\"tab\\there\""})
    EXPECT_THAT(with(name, "bind_ip: 192.168.2.4"), HasSubstr("no control characters")) << name;
}

TEST(Config, TheShippedExampleIsValid) {
  const auto c = load_config(std::string(SONARD_SOURCE_DIR) + "/scenes/sonard.yaml");
  ASSERT_TRUE(c) << c.error().text;
  EXPECT_EQ(c->sonars.at(0).profile.model->profile, "oculus-m1200d");
  const auto blueview = load_config(std::string(SONARD_SOURCE_DIR) + "/scenes/sonard-blueview.yaml");
  ASSERT_TRUE(blueview) << blueview.error().text;
  EXPECT_EQ(blueview->sonars.at(0).profile.model->profile, "blueview-p900-90");
  EXPECT_TRUE(notes_of_config(*blueview).empty());
  const auto aris = load_config(std::string(SONARD_SOURCE_DIR) + "/scenes/sonard-aris.yaml");
  ASSERT_TRUE(aris) << aris.error().text;
  EXPECT_EQ(aris->sonars.at(0).profile.model->profile, "aris-3000");
  EXPECT_TRUE(notes_of_config(*aris).empty());
  const auto water_linked = load_config(std::string(SONARD_SOURCE_DIR) + "/scenes/sonard-3d15.yaml");
  ASSERT_TRUE(water_linked) << water_linked.error().text;
  EXPECT_EQ(water_linked->sonars.at(0).profile.model->profile, "waterlinked-3d15");
  EXPECT_TRUE(notes_of_config(*water_linked).empty());
  for (const auto& [file, profile] : {std::pair{"sonard-ping360.yaml", "ping360"},
                                      {"sonard-surveyor.yaml", "surveyor-240"},
                                      {"sonard-omniscan.yaml", "omniscan-450"},
                                      {"sonard-ping1d.yaml", "ping1d"},
                                      {"sonard-s500.yaml", "s500"},
                                      {"sonard-micron.yaml", "micron"},
                                      {"sonard-norbit.yaml", "norbit-wbms"},
                                      {"sonard-dvl.yaml", "dvl-a50"},
                                      {"sonard-suite.yaml", "oculus-m1200d"},
                                      {"sonard-m3.yaml", "m3"}}) {
    const auto ping = load_config(std::string(SONARD_SOURCE_DIR) + "/scenes/" + file);
    ASSERT_TRUE(ping) << ping.error().text;
    EXPECT_EQ(ping->sonars.at(0).profile.model->profile, profile);
    EXPECT_TRUE(notes_of_config(*ping).empty());
  }
  const auto demo = demo_config();
  ASSERT_TRUE(demo) << demo.error().text;
  EXPECT_EQ(text_of(demo->sonars.at(0).bind_ip), "127.0.0.2");
}

TEST(FindConfig, UsesTheGivenFileUnlessTheDemoIsRequested) {
  const std::string file = std::string(SONARD_SOURCE_DIR) + "/scenes/sonard.yaml";
  const auto given = find_config(file, false);
  ASSERT_TRUE(given) << given.error().text;
  EXPECT_EQ(given->file, file);
  EXPECT_EQ(given->how, file);
  const auto demo = find_config(file, true);
  ASSERT_TRUE(demo) << demo.error().text;
  EXPECT_TRUE(demo->file.empty());
  EXPECT_EQ(demo->how, "built-in demo");
  EXPECT_FALSE(find_config("no such file.yaml", false));
}

/// A service or `sudo -u` may keep the HOME of a user whose folders are closed to the new user.
TEST(FindConfig, IgnoresAHomeThatThisUserMayNotEnter) {
  tests::TemporaryFiles files;
  const auto home = files.folder();
  const char* const home_before = std::getenv("HOME");
  const std::string before = home_before != nullptr ? home_before : "";
  ASSERT_EQ(::setenv("HOME", home.c_str(), 1), 0);
  ASSERT_EQ(::chmod(home.c_str(), 0), 0);
  const bool is_root = ::geteuid() == 0;
  ASSERT_EQ(is_root ? ::seteuid(65534) : 0, 0);  // the superuser may enter every folder
  const auto found = find_config("", false);
  ASSERT_EQ(is_root ? ::seteuid(0) : 0, 0);
  ::chmod(home.c_str(), 0700);
  ::setenv("HOME", before.c_str(), 1);
  ASSERT_TRUE(found) << found.error().text;
  EXPECT_THAT(found->how, HasSubstr("-> demo"));
}

}  // namespace
}  // namespace sonar::config_test
