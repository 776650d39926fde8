// Compares a DVL with the published protocol: lines, commands, coordinate frames, signs, and the formulas of velocity and
// dead reckoning.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"
#include "tests/protocol/dvl/dvl_testing.hpp"

namespace sonar::dvl {
namespace {

using namespace std::chrono_literals;
using namespace tests;
using Json = nlohmann::json;
using ::testing::HasSubstr;

constexpr std::array<double, beam_count> level{2, 2, 2, 2};

/// Returns the measurement for this velocity in the axes x forward, y to starboard, z down.
Measurement moving(Vec3d frd_mps, Settings settings = {}, std::array<double, beam_count> distances = level) {
  const protocol::DeviceState state = device();
  settings.mode = 1;
  Ping ping = ping_of(distances, settings, state);
  ping.request.sonar_moves.velocity_mps = flu_from_frd(frd_mps);
  return measure(ping);
}

TEST(DvlVelocity, ForwardStarboardAndDownArePositive) {
  const Measurement m = moving({1, 0.5, -0.25});
  ASSERT_TRUE(m.is_valid);
  EXPECT_NEAR(m.velocity_mps.x, 1, 1e-9);
  EXPECT_NEAR(m.velocity_mps.y, 0.5, 1e-9);
  EXPECT_NEAR(m.velocity_mps.z, -0.25, 1e-9);
  EXPECT_NEAR(m.altitude_m, 2 * std::cos(rad_from_deg(22.5)), 1e-9);
}

/// Lines of a real A50 (docs/protocols/dvl.md) show that beam 0 points aft to starboard, 1 aft to port, 2 forward to port and 3
/// forward to starboard, and that the velocity of a beam is positive towards the ground.
TEST(DvlVelocity, BeamsHaveTheOrderAndSignsOfARealDevice) {
  const double out = std::sin(rad_from_deg(22.5)) * std::sqrt(0.5), down = std::cos(rad_from_deg(22.5));
  const std::array<double, beam_count> of_x{-out, -out, out, out}, of_y{out, -out, -out, out};
  const Measurement ahead = moving({1, 0, 0}), aside = moving({0, 1, 0}), sinking = moving({0, 0, 1});
  for (std::size_t i = 0; i < beam_count; ++i) {
    EXPECT_NEAR(ahead.beams[i].velocity_mps, of_x[i], 1e-9) << i;
    EXPECT_NEAR(aside.beams[i].velocity_mps, of_y[i], 1e-9) << i;
    EXPECT_NEAR(sinking.beams[i].velocity_mps, down, 1e-9) << i;
  }
}

TEST(DvlVelocity, ThreeBeamsAreEnoughAndTwoAreNot) {
  const Measurement three = moving({1, 0.5, -0.25}, {}, {2, 0, 2, 2});
  ASSERT_TRUE(three.is_valid);
  EXPECT_NEAR(three.velocity_mps.y, 0.5, 1e-9);
  EXPECT_FALSE(three.beams[1].is_valid);
  EXPECT_GT(three.fom, moving({1, 0.5, -0.25}).fom);
  const Measurement two = moving({1, 0.5, -0.25}, {}, {2, 0, 2, 0});
  EXPECT_FALSE(two.is_valid);
  EXPECT_EQ(two.velocity_mps, Vec3d{});
  EXPECT_EQ(two.altitude_m, -1);
  EXPECT_FALSE(moving({5, 0, 0}).is_valid) << "5 m/s exceeds the range of an A50";
}

TEST(DvlVelocity, AltitudeIsAlongTheAxisAboveSlopingGround) {
  // On the plane z = 2 + 0.2 x, the distance d along a unit vector u satisfies d u_z = 2 + 0.2 d u_x.
  std::array<double, beam_count> distances{};
  for (std::size_t i = 0; i < beam_count; ++i) distances[i] = 2 / (beam_direction(i).z - 0.2 * beam_direction(i).x);
  EXPECT_NEAR(moving({}, {}, distances).altitude_m, 2, 0.002);
}

/// The DVL is mounted a quarter turn clockwise, so its x axis points to the vehicle's starboard.
TEST(DvlVelocity, MountingRotationTurnsIntoTheVehiclesFrame) {
  Settings s;
  s.mounting_rotation_deg = 90;
  const Measurement m = moving({1, 0, 0.2}, s);  // velocity in the device's axes
  EXPECT_NEAR(m.velocity_mps.x, 0, 1e-9);
  EXPECT_NEAR(m.velocity_mps.y, 1, 1e-9);
  EXPECT_NEAR(m.velocity_mps.z, 0.2, 1e-9);
}

/// After look_at(), the device reports the stored measurement, even if the samples are lost.
TEST(DvlVelocity, IsMeasuredOnceForAllItsLines) {
  const protocol::DeviceState state = device();
  Settings s;
  s.mode = 1;
  Ping ping = ping_of(level, s, state);
  ping.request.sonar_moves.velocity_mps = {1, 0, 0};
  const auto said = [&] {
    std::string all = text_of(*vendor().frame(ping, state));
    for (const protocol::Port& port : vendor().ports())
      for (const Bytes& part : vendor().datagrams(port, ping, state)) all += text_of(part);
    return all + std::to_string(settings_from(vendor().after_ping(ping, state)->vendor_settings.get()).reckoning.velocity_mps.x);
  };
  const std::string measured_now = said();
  look_at(ping);
  EXPECT_EQ(said(), measured_now);
  std::fill(ping.samples.begin(), ping.samples.end(), std::byte{0});
  EXPECT_EQ(said(), measured_now);
  look_at(ping);
  EXPECT_NE(said(), measured_now);
}

TEST(DvlVelocity, AWrongSpeedOfSoundScalesTheVelocity) {
  const protocol::DeviceState state = device();
  Settings s;
  s.mode = 1;
  Ping ping = ping_of(level, s, state);
  ping.request.sonar_moves.velocity_mps = {1, 0, 0};
  ping.request.water.sound_speed_mps = 1.02 * s.speed_of_sound_mps;
  EXPECT_NEAR(measure(ping).velocity_mps.x, 1 / 1.02, 1e-9);
}

TEST(DvlVelocity, NoiseHasTheStatedCovarianceAndRepeats) {
  const protocol::DeviceState state = device();
  Settings s;
  s.mode = 1;
  Ping ping = ping_of(level, s, state);
  ping.request.switches.noise = true;
  ping.request.sonar_moves.velocity_mps = {0.5, 0, 0};
  double sum = 0, of_squares = 0, stated = 0;
  constexpr int pings = 4000;
  for (std::uint32_t i = 1; i <= pings; ++i) {
    ping.request.number = PingNumber{i};
    const Measurement m = measure(ping);
    EXPECT_EQ(m.velocity_mps, measure(ping).velocity_mps);
    sum += m.velocity_mps.x - 0.5;
    of_squares += (m.velocity_mps.x - 0.5) * (m.velocity_mps.x - 0.5);
    stated = m.covariance[0][0];
  }
  EXPECT_NEAR(sum / pings, 0, 4 * std::sqrt(stated / pings));
  EXPECT_NEAR(of_squares / pings, stated, 0.1 * stated);
}

/// Uses the example in the maker's documentation.
TEST(DvlVelocity, FigureOfMeritIsTheRootOfTheLargestEigenvalue) {
  const Covariance example{{{2.4471841442164077e-08, -3.3937477272871774e-09, -1.6659699175747278e-09},
                            {-3.3937477272871774e-09, 1.4654466085062268e-08, 4.0409570134514183e-10},
                            {-1.6659699175747278e-09, 4.0409570134514183e-10, 1.5971971523143225e-09}}};
  EXPECT_NEAR(std::sqrt(largest_eigenvalue(example)), 0.00016016385052353144, 2e-9);
}

TEST(DvlModes, ChangeWithTheAltitudeAndSearchUpwards) {
  const Product& product = product_of(*models()[0]);
  Settings s;
  Measurement m;
  m.is_valid = true;
  const auto next = [&](int mode, double altitude_m) {
    s.mode = mode;
    m.altitude_m = altitude_m;
    return next_mode(m, s, product);
  };
  EXPECT_EQ(next(1, 2.9), 1);
  EXPECT_EQ(next(1, 3.1), 2);
  EXPECT_EQ(next(2, 2), 2);
  EXPECT_EQ(next(2, 1.4), 1);
  EXPECT_EQ(next(3, 40), 4);
  m.is_valid = false;
  EXPECT_EQ(next(1, -1), 2);
  EXPECT_EQ(next(4, -1), 0);
  ASSERT_TRUE(allow_modes("1<=2", s));
  EXPECT_EQ(next(2, -1), 1);
  for (const char* wrong : {"", "=5", "3<=1", "1<2", "wt", "1<=9", "auto "}) EXPECT_FALSE(allow_modes(wrong, s)) << wrong;
}

// ---- dead reckoning

TEST(DvlReckoning, IntegratesInTheAxesOfItsStart) {
  const protocol::DeviceState state = device();
  Settings s;
  s.mode = 1;
  Reckoning r;
  // One second to the north at 1 m/s, a quarter turn to starboard, one second at 1 m/s along the new heading.
  const auto step = [&](double at_s, double clockwise_deg) {
    Ping ping = ping_of(level, s, state);
    ping.request.fired_at += nanoseconds_from(at_s);
    const Quatd vehicle = quat_from_rpy({0, 0, rad_from_deg(90 - clockwise_deg)});
    ping.request.sonar_in_world.orientation = vehicle * quat_from_rpy({0, pi / 2, 0});
    ping.request.sonar_moves.velocity_mps = rotate(vehicle, Vec3d{1, 0, 0});
    r = reckoned(r, measure(ping), ping.request, s);
  };
  for (int i = 0; i <= 10; ++i) step(0.1 * i, 0);
  EXPECT_NEAR(r.position_m.x, 1, 1e-9);
  r.velocity_mps = {};
  for (int i = 11; i <= 21; ++i) {
    if (i == 11) r.at = Time(1'700'000'000s) + 1100ms;
    step(0.1 * i, 90);
  }
  EXPECT_NEAR(r.position_m.x, 1, 1e-9);
  EXPECT_NEAR(r.position_m.y, 1, 1e-9) << "the second metre is to starboard of the first heading";
  const Json line = Json::parse(text_of(position_line(r, Time(1'700'000'002s))));
  EXPECT_NEAR(line["yaw"].get<double>(), 90, 1e-6);
  EXPECT_NEAR(line["roll"].get<double>(), 0, 1e-6);
  EXPECT_EQ(line["type"], "position_local");
  EXPECT_NEAR(line["ts"].get<double>(), 1'700'000'002, 1e-3);
  EXPECT_NEAR(extrapolated(r, r.at + 500ms).position_m.y, 1.5, 1e-9);
}

TEST(DvlReckoning, AfterAGapThePositionContinuesWhereItStayed) {
  const protocol::DeviceState state = device();
  Settings s;
  s.mode = 1;
  const Ping ping = ping_of(level, s, state);
  const Reckoning last{.is_started = true,
                       .at = ping.request.fired_at - 10s,
                       .first = {},
                       .last = {},
                       .position_m = {5, 0, 0},
                       .velocity_mps = {1, 0, 0},
                       .std_m = 0.5,
                       .fom = 0.1};
  const Reckoning reported = extrapolated(last, ping.request.fired_at);
  EXPECT_NEAR(reported.position_m.x, 8, 1e-9) << "after 3 s the position stays";
  const Reckoning next = reckoned(last, measure(ping), ping.request, s);
  EXPECT_NEAR(next.position_m.x, 8, 1e-9);
  EXPECT_NEAR(next.std_m, reported.std_m, 1e-9);
  EXPECT_NEAR(next.velocity_mps.x, 0, 0.01) << "the velocity is that of the new ping";
}

// ---- lines

TEST(DvlLines, AVelocityReportHasTheMembersOfTheDocumentation) {
  const Measurement m = moving({1, 0.5, -0.25}, {}, {2, 2, 2, 0});
  const std::string text = text_of(velocity_line(m, 106ms, m.heard_at + 5ms));
  EXPECT_TRUE(text.ends_with("}\r\n"));
  const Json line = Json::parse(text);
  for (const char* name : {"time", "vx", "vy", "vz", "fom", "covariance", "altitude", "transducers", "velocity_valid", "status",
                           "format", "type", "time_of_validity", "time_of_transmission"})
    EXPECT_TRUE(line.contains(name)) << name;
  EXPECT_EQ(line.size(), 14u);
  EXPECT_EQ(line["type"], "velocity");
  EXPECT_EQ(line["format"], "json_v3.3");
  EXPECT_NEAR(line["time"].get<double>(), 106, 1e-9);
  EXPECT_NEAR(line["vx"].get<double>(), 1, 1e-9);
  EXPECT_EQ(line["velocity_valid"], true);
  EXPECT_EQ(line["covariance"].size(), 3u);
  ASSERT_EQ(line["transducers"].size(), 4u);
  EXPECT_EQ(line["transducers"][3],
            (Json{{"id", 3}, {"velocity", 0.0}, {"distance", -1.0}, {"rssi", -150.0}, {"nsd", -90.0}, {"beam_valid", false}}));
  EXPECT_EQ(line["time_of_validity"].get<std::int64_t>(), 1'700'000'000'000'000 + static_cast<std::int64_t>(1e6 * 2 / 1475));
  EXPECT_GT(line["time_of_transmission"], line["time_of_validity"]);
}

struct Client {
  Json ask(std::string_view sent) {
    answers.clear();
    take(dialogue->on_bytes(bytes_of(sent), now));
    return answers.empty() ? Json() : answers.back();
  }
  void take(const protocol::Reaction& reaction) {
    for (const protocol::Event& event : reaction.events) {
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        state.settings = change->vendor_settings;
        settings = change->settings;
      }
      requests += std::holds_alternative<protocol::RequestPing>(event);
      notices += std::holds_alternative<protocol::Notice>(event);
    }
    for (const Bytes& reply : reaction.replies) answers.push_back(Json::parse(text_of(reply)));
  }
  void ping() {
    for (const protocol::Event& event : dialogue->on_ping(nullptr, 1, now).events)
      requests += std::holds_alternative<protocol::RequestPing>(event);
  }
  protocol::DeviceState state = device();
  PingSettings settings;
  Time now = Time(1'700'000'000s) + 50ms;
  std::unique_ptr<protocol::Dialogue> dialogue = vendor().converse(vendor().ports()[0], state, now);
  std::vector<Json> answers;
  int requests = 0, notices = 0;
};

TEST(DvlCommands, TheConfigurationIsReadAndSet) {
  Client client;
  EXPECT_EQ(client.ask(R"({"command": "get_config"})"),
            Json::parse(R"({"response_to": "get_config", "success": true, "error_message": "", "format": "json_v3.3",
                            "type": "response", "result": {"speed_of_sound": 1475.0, "acoustic_enabled": true,
                            "dark_mode_enabled": false, "mounting_rotation_offset": 0.0, "range_mode": "auto",
                            "periodic_cycling_enabled": true}})"));
  EXPECT_EQ(client.ask(R"({"command":"set_config","parameters":{"speed_of_sound":1480,"range_mode":"=1"}})")["success"], true);
  EXPECT_EQ(client.settings.device_sound_speed_mps, 1480);
  EXPECT_EQ(client.settings.rate_hz, 10);
  const Json read = client.ask("{\"command\": \"get_config\"}\n")["result"];
  EXPECT_EQ(read["speed_of_sound"], 1480);
  EXPECT_EQ(read["range_mode"], "=1");
}

TEST(DvlCommands, ASetCommandWithAMistakeChangesNothing) {
  Client client;
  for (const char* wrong :
       {R"({"speed_of_sound":1490,"mounting_rotation_offset":361})", R"({"speed_of_sound":999})", R"({"acoustic_enabled":1})",
        R"({"speed_of_sound":1490,"range_mode":"9"})", R"({"range_mode":"wt"})", R"({"volume":11})", "[]", "null"}) {
    const Json answer = client.ask(R"({"command":"set_config","parameters":)" + std::string(wrong) + "}");
    EXPECT_EQ(answer["success"], false) << wrong;
    EXPECT_NE(answer["error_message"], "") << wrong;
  }
  EXPECT_EQ(client.ask(R"({"command":"get_config"})")["result"]["speed_of_sound"], 1475);
  EXPECT_EQ(client.ask(R"({"command":"dance"})")["success"], false);
  EXPECT_EQ(client.ask(R"({"order":"dance"})")["success"], false);
}

TEST(DvlCommands, CommandsComeInPiecesWithoutLineEndsAndBesideJunk) {
  Client client;
  for (const char c : std::string_view("xx {\"command\":\"get_config\",\"parameters\":{\"}\\\"{\":1}}"))
    client.take(client.dialogue->on_bytes(bytes_of(std::string_view(&c, 1)), client.now));
  ASSERT_EQ(client.answers.size(), 1u);
  EXPECT_EQ(client.answers[0]["success"], true);
  EXPECT_GT(client.notices, 0);
  client.ask(R"({"command":"get_config"}{"command":"calibrate_gyro"})");
  ASSERT_EQ(client.answers.size(), 2u);
  EXPECT_EQ(client.answers[1]["response_to"], "calibrate_gyro");
  client.ask(std::string(100'000, '{'));
  EXPECT_EQ(client.ask("}" + std::string(R"({"command":"get_config"})"))["success"], true);
}

TEST(DvlCommands, PingsAreTriggeredOneByOneWhileAcousticsAreDisabled) {
  Client client;
  const char* trigger = R"({"command":"trigger_ping"})";
  EXPECT_EQ(client.ask(trigger)["success"], false);
  client.ask(R"({"command":"set_config","parameters":{"acoustic_enabled":false}})");
  EXPECT_EQ(client.settings.rate_hz, 0);
  for (int i = 0; i < 15; ++i) EXPECT_EQ(client.ask(trigger)["success"], true);
  EXPECT_EQ(client.ask(trigger)["success"], false) << "15 triggers wait already";
  EXPECT_GT(client.settings.rate_hz, 0);
  EXPECT_TRUE(client.settings.triggered);
  EXPECT_EQ(client.requests, 1);
  for (int i = 0; i < 20; ++i) client.ping();
  EXPECT_EQ(client.requests, 15);
}

TEST(DvlCommands, DeadReckoningIsReportedFiveTimesPerSecondAndReset) {
  Client client;
  Settings s;
  s.reckoning = {.is_started = true, .at = client.now, .first = {}, .last = {}, .position_m = {3, 2, 1}, .velocity_mps = {}};
  client.state.settings = change_to(s, client.state).vendor_settings;
  for (int i = 0; i < 100; ++i) {
    client.now += 10ms;
    if (client.dialogue->next_tick() <= client.now) client.take(client.dialogue->on_tick(client.now, false));
  }
  ASSERT_EQ(client.answers.size(), 5u);
  EXPECT_EQ(client.answers[0]["x"], 3.0);
  EXPECT_EQ(client.ask(R"({"command":"reset_dead_reckoning"})")["success"], true);
  client.now += 200ms;
  client.answers.clear();
  client.take(client.dialogue->on_tick(client.now, false));
  EXPECT_EQ(client.answers.at(0)["x"], 0.0);
}

TEST(DvlCommands, TimesHaveTheJumpsOfSteppedTime) {
  Client client;
  client.state.skipped = 1h;
  Settings s;
  s.reckoning = {.is_started = true, .at = client.now + 1h, .first = {}, .last = {}, .position_m = {}, .velocity_mps = {1, 0, 0}};
  client.state.settings = change_to(s, client.state).vendor_settings;
  EXPECT_EQ(client.ask(R"({"command":"get_time_status"})")["result"]["system_time"], "2023-11-14T23:13:20Z");
  client.now = client.dialogue->next_tick();
  client.answers.clear();
  client.take(client.dialogue->on_tick(client.now, false));
  EXPECT_NEAR(client.answers.at(0)["ts"].get<double>(), 1'700'003'600.2, 1e-3);
  EXPECT_NEAR(client.answers.at(0)["x"].get<double>(), 0.15, 1e-6);
}

TEST(DvlCommands, VersionAndTimeAreAnswered) {
  Client client;
  const Json info = client.ask(R"({"command":"get_version_info"})")["result"];
  EXPECT_EQ(info["product_name"], "DVL A50");
  EXPECT_EQ(info["product_id"], 21035);
  EXPECT_EQ(info["is_ready"], true);
  EXPECT_EQ(client.ask(R"({"command":"get_time_status"})")["result"]["system_time"], "2023-11-14T22:13:20Z");
  EXPECT_EQ(client.ask(R"({"command":"set_time_ntp","parameters":{"ntp_address":"192.168.0.10"}})")["success"], true);
  for (const char* splits_sentences : {"a,b", "a b", "a\\r\\nwrx", "\\u00e9"})
    EXPECT_EQ(client.ask(std::string(R"({"command":"set_time_ntp","parameters":{"ntp_address":")") + splits_sentences +
                         R"("}})")["success"],
              false)
        << splits_sentences;
  EXPECT_EQ(client.ask(R"({"command":"get_time_ntp"})")["result"]["ntp_address"], "192.168.0.10");
  EXPECT_EQ(client.ask(R"({"command":"set_time_manual","parameters":{"now":"2026-04-20T09:04:13Z"}})")["success"], false);
}

TEST(DvlSettings, AnOperatorCanSetOnlyRangeAndStandby) {
  const protocol::DeviceState state = device();
  protocol::SettingsOverride wanted;
  wanted.range_m = 10;
  EXPECT_NEAR(vendor().apply_override(wanted, state)->settings.range_m, 14 / std::cos(rad_from_deg(22.5)), 1e-9);
  wanted = {.range_m = 60, .rate_hz = {}, .gain_percent = {}, .mode = {}, .beams = {}};
  EXPECT_THAT(vendor().apply_override(wanted, state).error().text, HasSubstr("50 m"));
  EXPECT_TRUE(vendor().apply_override(wanted, device(1))) << "an A125 has this range";
  wanted = {.range_m = {}, .rate_hz = 0, .gain_percent = {}, .mode = {}, .beams = {}};
  EXPECT_EQ(vendor().apply_override(wanted, state)->settings.rate_hz, 0);
  wanted.rate_hz = 5;
  EXPECT_THAT(vendor().apply_override(wanted, state).error().text, HasSubstr("by altitude"));
}

}  // namespace
}  // namespace sonar::dvl
