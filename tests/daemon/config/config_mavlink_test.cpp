// poses.mavlink and world.origin: every key, every default, every refusal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "daemon/config/load_config.hpp"
#include "daemon/config/restart_keys.hpp"

namespace sonar::config_mavlink_test {
namespace {

using ::testing::HasSubstr;

Result<Config> parse(const std::string& poses, const std::string& vehicles = "[{name: rov}]", const std::string& world = "") {
  static const std::string directory = [] {
    std::ofstream(::testing::TempDir() + "/scene.yaml") << "name: test\n";
    return ::testing::TempDir();
  }();
  return parse_config("world: {scene: scene.yaml" + world + "}\nvehicles: " + vehicles +
                          "\nsonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2, vehicle: rov}]\nposes: " + poses +
                          "\n",
                      "sonard.yaml", directory);
}
std::string why(const std::string& poses, const std::string& vehicles = "[{name: rov}]", const std::string& world = "") {
  const auto config = parse(poses, vehicles, world);
  return config ? "accepted" : config.error().text;
}

TEST(ConfigMavlink, ByDefaultThereIsNoLink) {
  EXPECT_TRUE(parse("{}")->poses.mavlink.empty());
  EXPECT_TRUE(parse("{mavlink: off}")->poses.mavlink.empty());
}

TEST(ConfigMavlink, OneEndpointIsEnough) {
  const auto c = parse("{mavlink: 'udpin:127.0.0.1:14551'}");
  ASSERT_TRUE(c) << c.error().text;
  const MavlinkConfig& link = c->poses.mavlink.at(0);
  EXPECT_FALSE(link.dials);
  EXPECT_EQ(text_of(link.at), "127.0.0.1:14551");
  EXPECT_EQ(link.vehicle, "rov");
  EXPECT_EQ(link.system_id, 0);
  EXPECT_EQ(link.component_id, 0);
  EXPECT_FALSE(link.request_rates);
  EXPECT_EQ(link.rate_hz, 50);
  EXPECT_TRUE(parse("{mavlink: 'udpout:192.168.2.2:14660'}")->poses.mavlink.at(0).dials) << "dialling needs no allow_from";
}

TEST(ConfigMavlink, AListHasSeveralLinks) {
  const auto c = parse(
      "{allow_from: [10.0.0.0/8], mavlink: [{endpoint: 'udpin:0.0.0.0:14551', vehicle: boat, system_id: 2, component_id: 1, "
      "request_rates: true, rate_hz: 20}, {endpoint: 'udpout:127.0.0.1:14552', vehicle: rov}]}",
      "[{name: rov}, {name: boat}]");
  ASSERT_TRUE(c) << c.error().text;
  const MavlinkConfig& first = c->poses.mavlink.at(0);
  EXPECT_EQ(first.vehicle, "boat");
  EXPECT_EQ(first.system_id, 2);
  EXPECT_EQ(first.component_id, 1);
  EXPECT_TRUE(first.request_rates);
  EXPECT_EQ(first.rate_hz, 20);
  EXPECT_EQ(c->poses.mavlink.at(1).vehicle, "rov");
}

TEST(ConfigMavlink, MistakesAreNamed) {
  for (const char* wrong :
       {"14551", "127.0.0.1:14551", "udp:127.0.0.1:14551", "udpin:14551", "udpin:127.0.0.1",
        "udpin:127.0.0.1:", "udpin:127.0.0.1:70000", "udpout:127.0.0.1:0", "udpin:localhost:14551", "udpin::"})
    EXPECT_THAT(why(std::string("{mavlink: '") + wrong + "'}"),
                HasSubstr("poses.mavlink: is not a MAVLink endpoint; write udpin:"));
  EXPECT_THAT(why("{mavlink: 'udpin:0.0.0.0:14551'}"), HasSubstr("need poses.allow_from"));
  EXPECT_THAT(why("{mavlink: 'udpout:0.0.0.0:14551'}"), HasSubstr("udpout needs the address of the other end"));
  EXPECT_THAT(why("{mavlink: 'udpin:127.0.0.1:14551'}", "[{name: rov}, {name: boat}]"),
              HasSubstr("there are several vehicles; write [{endpoint: udpin:127.0.0.1:14551, vehicle: rov}]"));
  EXPECT_THAT(why("{mavlink: [{endpoint: 'udpin:127.0.0.1:1'}]}", "[{name: rov}, {name: boat}]"), HasSubstr("vehicle"));
  EXPECT_THAT(why("{mavlink: [{endpoint: 'udpin:127.0.0.1:1', vehicle: ship}]}"), HasSubstr("rov"));
  EXPECT_THAT(why("{mavlink: [{endpoint: 'udpin:127.0.0.1:1', rate_hz: 0}]}"), HasSubstr("poses.mavlink[0].rate_hz"));
  EXPECT_THAT(why("{mavlink: [{endpoint: 'udpin:127.0.0.1:1', system_id: 256}]}"), HasSubstr("poses.mavlink[0].system_id"));
  EXPECT_THAT(why("{mavlink: [{endpoint: 'udpin:127.0.0.1:1'}, {endpoint: 'udpin:127.0.0.1:1'}]}"),
              HasSubstr("another link already uses"));
  EXPECT_THAT(why("{mavlink: [{endpont: 'udpin:127.0.0.1:1'}]}"), HasSubstr("endpoint"));
}

TEST(ConfigMavlink, DistancesNeedARangeFinderOnTheVehicle) {
  const std::string link = "{mavlink: [{endpoint: 'udpout:127.0.0.1:14551', distance_sensor: true}]}";
  EXPECT_THAT(why(link),
              HasSubstr("poses.mavlink[0].distance_sensor: vehicle \"rov\" has no range finder; mount an altimeter on it"));
  const std::string altimeter =
      "world: {scene: scene.yaml}\nvehicles: [{name: rov}, {name: boat}]\nsonars:\n"
      "  - {name: alt, profile: ping1d, bind_ip: 127.0.0.2, vehicle: rov}\nposes: {mavlink: [{vehicle: ";
  const std::string rest = ", endpoint: 'udpout:127.0.0.1:14551', distance_sensor: true}]}\n";
  const auto good = parse_config(altimeter + "rov" + rest, "sonard.yaml", ::testing::TempDir());
  ASSERT_TRUE(good) << good.error().text;
  EXPECT_TRUE(good->poses.mavlink.at(0).distance_sensor);
  EXPECT_THAT(range_finders_of(*good, "rov"), ::testing::ElementsAre("alt"));
  const auto other = parse_config(altimeter + "boat" + rest, "sonard.yaml", ::testing::TempDir());
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().text, HasSubstr("vehicle \"boat\" has no range finder"));
  EXPECT_FALSE(parse("{mavlink: [{endpoint: 'udpout:127.0.0.1:14551'}]}")->poses.mavlink.at(0).distance_sensor);
}

TEST(ConfigMavlink, TheOriginIsRead) {
  EXPECT_FALSE(parse("{}")->origin);
  const auto c = parse("{}", "[{name: rov}]", ", origin: {lat: 90, lon: -180, alt: 12.5}");
  ASSERT_TRUE(c && c->origin);
  EXPECT_DOUBLE_EQ(c->origin->latitude_rad, pi / 2);
  EXPECT_DOUBLE_EQ(c->origin->longitude_rad, -pi);
  EXPECT_EQ(c->origin->altitude_m, 12.5);
  EXPECT_THAT(why("{}", "[{name: rov}]", ", origin: {lat: 91, lon: 0}"), HasSubstr("world.origin.lat"));
}

TEST(ConfigMavlink, LinksAndOriginNeedARestart) {
  const Config now = *parse("{mavlink: 'udpin:127.0.0.1:14551'}");
  Config same = now;
  EXPECT_TRUE(keep_restart_keys(now, same).empty());
  Config next = *parse("{mavlink: 'udpin:127.0.0.1:14552'}", "[{name: rov}]", ", origin: {lat: 1, lon: 2}");
  EXPECT_THAT(keep_restart_keys(now, next), ::testing::ElementsAre("poses.mavlink", "world.origin"));
  EXPECT_EQ(next.poses.mavlink.at(0).at.port, 14551);
  EXPECT_FALSE(next.origin);
}

}  // namespace
}  // namespace sonar::config_mavlink_test
