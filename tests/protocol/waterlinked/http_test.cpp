// Tests the HTTP API of a Sonar 3D-15: every path, refusals, older releases, and the effect of settings.
#include "tests/protocol/waterlinked/waterlinked_testing.hpp"

namespace sonar::waterlinked::tests {
namespace {

constexpr const char* readable[] = {"/about",
                                    "/status",
                                    "/temperature",
                                    "/acoustics/enabled",
                                    "/acoustics/range",
                                    "/acoustics/speed_of_sound",
                                    "/acoustics/mode",
                                    "/acoustics/salinity",
                                    "/udp",
                                    "/output/imu-batch/enabled",
                                    "/time/ntp",
                                    "/time/status"};

TEST(WaterLinkedHttp, EveryPathIsJson) {
  Unit unit;
  for (const char* path : readable) EXPECT_FALSE(unit.get(path).is_discarded()) << path;
  EXPECT_EQ(unit.get("/about")["version_short"], "1.8.0");
  EXPECT_EQ(unit.get("/about")["product_id"], 21045);
  EXPECT_TRUE(unit.get("/status")["systems_check"]["operational"].get<bool>());
  EXPECT_EQ(unit.get("/time/status")["system_time"], "2023-11-14T22:15:00.000Z");
}

TEST(WaterLinkedHttp, TemperatureHasADecimalPoint) {
  Unit unit;
  unit.device.water.temperature_c = 10.5;
  EXPECT_EQ(unit.request("GET", "/temperature").body, "20.0");
}

TEST(WaterLinkedHttp, PostedValuesAreReadBack) {
  Unit unit;
  const std::pair<const char*, const char*> values[] = {
      {"/acoustics/enabled", "true"},
      {"/acoustics/range", R"({"max":0.3,"min":0.2})"},
      {"/acoustics/range", R"({"max":3.0,"min":2.0})"},
      {"/acoustics/speed_of_sound", "1442.0"},
      {"/acoustics/mode", "\"high-frequency\""},
      {"/acoustics/salinity", "\"fresh\""},
      {"/udp", R"({"mode":"unicast","unicast_destination_ip":"192.168.99.42","unicast_destination_port":4748})"},
      {"/output/imu-batch/enabled", "true"},
      {"/time/ntp", R"({"ntp_address":"192.168.99.1"})"}};
  for (const auto& [path, body] : values) {
    EXPECT_EQ(unit.post(path, body), 204u) << path;
    EXPECT_EQ(unit.get(path), Json::parse(body)) << path;
  }
  EXPECT_EQ(unit.settings.mode, 1);
  EXPECT_EQ(unit.settings.range_m, 3);
  EXPECT_EQ(unit.settings.range_start_m, 2);
  EXPECT_FLOAT_EQ(unit.settings.device_sound_speed_mps, 1442);
  EXPECT_FLOAT_EQ(unit.settings.rate_hz, 20);
  EXPECT_THAT(unit.receivers, ::testing::ElementsAre(protocol::Endpoint{{192, 168, 99, 42}, 4748}));
}

TEST(WaterLinkedHttp, RefusesBodiesThatAreNotInTheSchema) {
  Unit unit;
  const std::pair<const char*, const char*> bad[] = {
      {"/acoustics/enabled", "\"enable\""},
      {"/acoustics/enabled", ""},
      {"/acoustics/enabled", "{"},
      {"/acoustics/range", "[0, 5]"},
      {"/acoustics/range", R"({"min":5,"max":5})"},
      {"/acoustics/range", R"({"min":5,"max":5.09})"},
      {"/acoustics/range", R"({"min":0,"max":16})"},
      {"/acoustics/range", R"({"min":-1,"max":5})"},
      {"/acoustics/speed_of_sound", "999"},
      {"/acoustics/speed_of_sound", "\"0\""},
      {"/acoustics/mode", "\"low\""},
      {"/acoustics/salinity", "35"},
      {"/udp", "\"multicast\""},
      {"/udp", R"({"mode":"broadcast"})"},
      {"/udp", R"({"mode":"unicast","unicast_destination_ip":"","unicast_destination_port":1})"},
      {"/udp", R"({"mode":"unicast","unicast_destination_ip":"0.0.0.0","unicast_destination_port":1})"},
      {"/udp", R"({"mode":"unicast","unicast_destination_ip":"1.2.3.4","unicast_destination_port":0})"},
      {"/udp", R"({"mode":"unicast","unicast_destination_ip":"1.2.3.4","unicast_destination_port":65536})"},
      {"/time/ntp", "{}"},
      {"/time/manual", R"({"now":"yesterday"})"},
      {"/time/manual", R"({"now":"2026-01-02T03:04:05"})"},
      {"/time/manual", R"({"now":"2026-01-02T03:04:05+25:00"})"}};
  const auto before = unit.device.settings;
  for (const auto& [path, body] : bad) EXPECT_EQ(unit.post(path, body), 400u) << path << " " << body;
  EXPECT_EQ(unit.device.settings, before);
  EXPECT_EQ(unit.post("/udp", std::string(2000, ' ')), 413u);
  EXPECT_EQ(unit.request("GET", "/nothing").status, 404u);
  EXPECT_EQ(unit.request("GET", "x").status, 404u);
  EXPECT_EQ(unit.request("DELETE", "/udp").status, 405u);
  EXPECT_EQ(unit.request("POST", "/about", "1").allow, "GET");
  EXPECT_EQ(unit.request("GET", "/time/manual").allow, "POST");
}

TEST(WaterLinkedHttp, OlderReleasesLackPaths) {
  const std::pair<const char*, std::vector<const char*>> lacks[] = {
      {"1.7.1", {"/output/imu-batch/enabled"}},
      {"1.7.0", {"/output/imu-batch/enabled", "/time/ntp", "/time/status"}},
      {"1.6.0", {"/output/imu-batch/enabled", "/time/ntp", "/time/status", "/acoustics/mode", "/acoustics/salinity"}}};
  for (const auto& [release, missing] : lacks) {
    Unit unit(protocol::OptionValues{{"release", release}});
    for (const char* path : readable) {
      const bool is_missing = std::find_if(missing.begin(), missing.end(),
                                           [path = std::string(path)](const char* m) { return path == m; }) != missing.end();
      EXPECT_EQ(unit.request("GET", path).status, is_missing ? 404u : 200u) << release << path;
    }
    EXPECT_EQ(unit.get("/status").contains("time"), std::string(release) == "1.7.1");
  }
  EXPECT_EQ(Unit(protocol::OptionValues{{"release", "1.6.0"}}).get("/status")["calibration"]["severity"], "ok");
}

TEST(WaterLinkedHttp, SendsOnlyWithAcousticsOnAndAReceiver) {
  Unit unit;
  EXPECT_EQ(unit.settings.rate_hz, 0);
  unit.post("/acoustics/enabled", "true");
  EXPECT_EQ(unit.settings.rate_hz, 0);
  unit.post("/udp", R"({"mode":"multicast","unicast_destination_ip":"","unicast_destination_port":0})");
  EXPECT_FLOAT_EQ(unit.settings.rate_hz, 5);
  EXPECT_THAT(unit.receivers, ::testing::ElementsAre(multicast_group));
  unit.post("/udp", R"({"mode":"disabled"})");
  EXPECT_EQ(unit.settings.rate_hz, 0);
  EXPECT_TRUE(unit.receivers.empty());
  EXPECT_FLOAT_EQ(Unit(protocol::OptionValues{{"acoustics_at_start", "enabled"}, {"udp_at_start", "multicast"}}).settings.rate_hz,
                  5);
}

TEST(WaterLinkedHttp, SpeedOfSoundIsThatOfTheWaterOrThePostedOne) {
  Unit unit;
  EXPECT_NEAR(static_cast<double>(unit.settings.device_sound_speed_mps), true_sound_speed_mps(unit.device.water, 0), 0.1);
  unit.post("/acoustics/salinity", "\"fresh\"");
  EXPECT_NEAR(static_cast<double>(unit.settings.device_sound_speed_mps), 1455, 2);
  unit.post("/acoustics/speed_of_sound", "1491");
  EXPECT_FLOAT_EQ(unit.settings.device_sound_speed_mps, 1491);
}

TEST(WaterLinkedHttp, TheClockMayRunWithoutNtp) {
  Unit unit(protocol::OptionValues{{"clock", "since_boot"}});
  EXPECT_EQ(unit.get("/time/status")["system_time"], "1970-01-01T00:01:40.000Z");
  EXPECT_TRUE(unit.get("/time/status")["ntp_seconds_since_last_sync"].is_null());
  EXPECT_EQ(unit.post("/time/manual", R"({"now":"2026-01-02T03:04:05.5Z"})"), 204u);
  EXPECT_EQ(unit.get("/time/status")["system_time"], "2026-01-02T03:04:05.500Z");
  EXPECT_EQ(unit.post("/time/manual", R"({"now":"2026-01-02T03:04:05+02:00"})"), 204u);
  EXPECT_EQ(unit.get("/time/status")["system_time"], "2026-01-02T01:04:05.000Z");
  Unit synchronised;
  EXPECT_EQ(synchronised.post("/time/manual", R"({"now":"2026-01-02T03:04:05Z"})"), 409u);
  EXPECT_EQ(synchronised.post("/time/ntp/force-sync", R"({"timeout_seconds":5})"), 200u);
  EXPECT_EQ(synchronised.post("/time/ntp/force-sync", ""), 200u) << "the time limit of force-sync is optional";
}

TEST(WaterLinkedOverride, EqualsTheSettingsThatAClientPosts) {
  Unit unit(protocol::OptionValues{{"acoustics_at_start", "enabled"}, {"udp_at_start", "multicast"}});
  const auto apply = [&](const protocol::SettingsOverride& wanted) { return vendor().apply_override(wanted, unit.device); };
  protocol::SettingsOverride wanted;
  wanted.range_m = 8;
  wanted.mode = 1;
  wanted.rate_hz = 10;
  const auto change = apply(wanted);
  ASSERT_TRUE(change) << change.error().text;
  EXPECT_EQ(change->settings.range_m, 8);
  EXPECT_FLOAT_EQ(change->settings.rate_hz, 10);
  unit.device.settings = change->vendor_settings;
  unit.post("/acoustics/mode", "\"low-frequency\"");
  EXPECT_FLOAT_EQ(unit.settings.rate_hz, 5) << "the highest rate of the other mode";
  unit.post("/acoustics/mode", "\"high-frequency\"");
  EXPECT_FLOAT_EQ(unit.settings.rate_hz, 10);
  wanted.rate_hz = 0;
  EXPECT_EQ(apply(wanted)->settings.rate_hz, 0);
  wanted = {};
  wanted.range_m = 20;
  EXPECT_FALSE(apply(wanted));
  wanted = {};
  wanted.gain_percent = 50;
  EXPECT_FALSE(apply(wanted));
  EXPECT_TRUE(apply({}));
}

}  // namespace
}  // namespace sonar::waterlinked::tests
