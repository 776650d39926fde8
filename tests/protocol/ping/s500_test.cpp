// Tests a host's conversation with an emulated S500, without a socket: single pings, streams, refusals, distances over several
// pings, and the automatic range and gain.
#include <gmock/gmock.h>

#include <variant>

#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/s500.hpp"
#include "tests/protocol/ping/ping_testing.hpp"

namespace sonar::ping::s500 {
namespace {

using namespace tests;
using testing::ElementsAre;

Bytes params(SetPingParams p) { return framed_message(Id::s500_set_ping_params, 0, p); }
std::vector<Id> ids_in(const std::vector<Frame>& frames) {
  std::vector<Id> ids;
  for (const Frame& frame : frames) ids.push_back(frame.header.id);
  return ids;
}

/// Returns a profile of noise at -100 dB with an echo that begins at this row.
Ping profile_with(const Settings& settings, int row, double echo_db) {
  Ping ping;
  ping.request.model = models().front();
  ping.request.settings = ping_settings(settings);
  ping.request.vendor_settings = std::make_shared<HeldSettings>(settings);
  ping.request.number = PingNumber(7);
  ping.request.fired_at = at_s(2.5);
  const SampleFormat& format = ping.request.settings.format;
  for (int i = 0; i < 1024; ++i) {
    const double db = i >= row && i < row + 8 ? echo_db : -100;
    const auto floor_db = static_cast<double>(format.floor_db);
    const auto code = static_cast<unsigned>(65535 * (db - floor_db) / (static_cast<double>(format.ceiling_db) - floor_db));
    for (const unsigned part : {code & 0xFFu, code >> 8}) ping.samples.push_back(static_cast<std::byte>(part));
  }
  return ping;
}

TEST(S500, AStreamHasTheRequestedReport) {
  Talk talk("s500");
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max()) << "the device sends nothing without a request";
  // Message 1015 as ping-python sends it for 5 m: automatic gain, 100 ms, report 1308.
  talk.say(hex("42 52 14 00 f7 03 00 00 00 00 00 00 88 13 00 00 ff ff 64 00 00 00 1c 05 00 00 00 00 c0 04"));
  EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::ack));
  EXPECT_DOUBLE_EQ(talk.settings.range_m, 5);
  EXPECT_FLOAT_EQ(talk.settings.rate_hz, 10);
  EXPECT_TRUE(talk.dialogue->hosts_fall_silent());
  for (int i = 1; i <= 3; ++i) {
    talk.apply(talk.dialogue->on_tick(talk.dialogue->next_tick(), false));
    talk.deliver(0.1 * i);
    EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::s500_profile6));
  }
  talk.say(params({.period_ms = 200, .report = Id::s500_distance2}), 1);
  EXPECT_FLOAT_EQ(talk.settings.rate_hz, 5);
  talk.apply(talk.dialogue->on_tick(at_s(1), false));
  talk.deliver(1);
  EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::ack, Id::s500_distance2));
  talk.say(params({}), 2);
  EXPECT_EQ(talk.settings.rate_hz, 0);
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max());
}

TEST(S500, ASinglePingIsSentOnce) {
  Talk talk("s500");
  talk.say(params({.report = Id::s500_profile6}));
  talk.run_to(5, 0.05);
  EXPECT_EQ(talk.pings, 1);
  EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::ack, Id::s500_profile6));
  talk.say(general(Id::s500_distance2), 6);
  talk.say(request(Id::ping1d_distance_simple), 6);
  talk.run_to(7, 0.05);
  EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::ping1d_distance_simple, Id::s500_distance2)) << "both answers are of one ping";
  talk.say(params({}), 8);
  talk.take();
  talk.say(general(Id::s500_distance2), 8);
  EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::nack)) << "pings are disabled";
}

TEST(S500, ValuesAreReadBack) {
  Talk talk("s500");
  talk.say(params({.start_mm = 500, .length_mm = 20000, .gain = 13, .period_ms = 250, .report = Id::s500_profile6}));
  talk.say(framed_message(Id::set_sound_speed_before, 0, SoundSpeed{1444000}));
  talk.take();
  EXPECT_EQ(talk.settings.device_sound_speed_mps, 1444);
  const auto answer = [&](Id id) {
    talk.say(general(id));
    return talk.take().at(0);
  };
  EXPECT_EQ(message_in<ScanRange>(answer(Id::ping1d_range)).length_mm, 20000u);
  EXPECT_EQ(message_in<SoundSpeed>(answer(Id::ping1d_sound_speed)).mm_per_s, 1444000u);
  for (const auto& [id, size] : {std::pair(Id::ping1d_firmware_version, 6u), std::pair(Id::ping1d_gain, 4u),
                                 std::pair(Id::ping1d_interval, 2u), std::pair(Id::ping1d_processor_temperature, 4u)}) {
    const Frame frame = answer(id);
    EXPECT_EQ(frame.header.id, id);
    EXPECT_EQ(frame.payload.size(), size);
  }
  EXPECT_EQ(answer(Id::ping1d_gain).payload.at(0), std::byte{13});
  EXPECT_EQ(answer(Id::ping1d_interval).payload.at(0), std::byte{250});
  EXPECT_EQ(answer(Id::ping1d_voltage_5).header.id, Id::nack) << "only a Ping1D has this message";
}

TEST(S500, RefusesWrongRequests) {
  for (const SetPingParams& wrong :
       {SetPingParams{.length_mm = 999, .report = Id::s500_profile6}, SetPingParams{.length_mm = 142001},
        SetPingParams{.start_mm = 4294967295u, .length_mm = 4294967295u}, SetPingParams{.start_mm = 141001, .length_mm = 0},
        SetPingParams{.gain = 14}, SetPingParams{.gain = -2}, SetPingParams{.period_ms = -2},
        SetPingParams{.report = Id::ping1d_profile}, SetPingParams{.chirp = 2}}) {
    Talk talk("s500");
    talk.say(params(wrong));
    EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::nack)) << complaint(wrong);
  }
  Talk talk("s500");
  talk.say(framed_message(Id::set_sound_speed_before, 0, SoundSpeed{1500}));
  talk.say(request(Id::s500_set_ping_params));
  EXPECT_THAT(ids_in(talk.take()), ElementsAre(Id::nack, Id::nack));
}

TEST(S500, TheEchoIsDetectedOnce) {
  Talk talk("s500");
  Settings s;
  s.parameters = requested(s.parameters, {.length_mm = 10240, .gain = 3, .report = Id::s500_profile6});
  Ping ping = profile_with(s, 400, -20);
  const auto said = [&] {
    const auto frame = frames_in(talk.vendor.datagrams(talk.vendor.ports()[1], ping, talk.state)).front();
    const auto next = settings_from(talk.vendor.after_ping(ping, talk.state)->vendor_settings.get());
    return std::tuple(message_in<Profile6>(frame).depth_m, talk.vendor.distance_in(ping)->range_m, next.earlier.back().range_m);
  };
  const auto detected_now = said();
  look_at(ping);
  std::fill(ping.samples.begin(), ping.samples.end(), std::byte{0});
  EXPECT_EQ(said(), detected_now) << "look_at() has stored the echo before the samples were lost";
  look_at(ping);
  EXPECT_NE(said(), detected_now);
}

TEST(S500, AProfileHasTheSettingsOfThePing) {
  Talk talk("s500");
  talk.state.powered_up_at = at_s(0);
  Settings s;
  s.parameters =
      requested(s.parameters, {.start_mm = 1000, .length_mm = 10240, .gain = 3, .period_ms = 0, .report = Id::s500_profile6});
  const Ping ping = profile_with(s, 400, -20);
  const auto frames = talk.vendor.datagrams(talk.vendor.ports()[1], ping, talk.state);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_LT(frames.front().size(), 4096u) << "UDP hosts receive 4096 bytes at most";
  const auto profile = message_in<Profile6>(frames_in(frames).front());
  EXPECT_EQ(profile.ping, 6u) << "pings are numbered from 0";
  EXPECT_EQ(profile.start_mm, 1000u);
  EXPECT_EQ(profile.length_mm, 10240u);
  EXPECT_EQ(profile.start_hz, 500000u);
  EXPECT_EQ(profile.power_up_ms, 2500u);
  EXPECT_EQ(profile.gain, 3);
  EXPECT_EQ(profile.results, 1024);
  EXPECT_NEAR(profile.depth_m, 5, 0.03);
  EXPECT_EQ(profile.confidence, 100);
  EXPECT_EQ(talk.vendor.region(protocol::Region::image, frames.front()), std::pair(std::size_t{74}, std::size_t{2048}));
  Bytes changed = frames.front();
  const auto gain = talk.vendor.field(protocol::Part::ping, protocol::FieldName::gain, changed);
  ASSERT_TRUE(gain);
  changed[gain->offset] = std::byte{9};
  talk.vendor.reseal(frames.front(), changed);
  EXPECT_EQ(message_in<Profile6>(frames_in({changed}).at(0)).gain, 9);
}

TEST(S500, DistancesAreAveragedOverTwentyPings) {
  protocol::DeviceState state = device("s500");
  Settings s;
  s.parameters = requested(s.parameters, {.length_mm = 10240, .gain = 3, .period_ms = 0, .report = Id::s500_distance2});
  s.results = distance_result;
  const auto distance = [&](int row, double echo_db) {
    const Ping ping = profile_with(s, row, echo_db);
    const auto message = message_in<Distance2>(frames_in(frames_of(ping, state)).at(0));
    s = after(ping, s);
    return message;
  };
  EXPECT_NEAR(distance(100, -20).averaged_mm, 1000, 30);
  const Distance2 second = distance(300, -20);
  EXPECT_NEAR(second.ping_mm, 3000, 30);
  EXPECT_NEAR(second.averaged_mm, 2000, 30);
  const Distance2 lost = distance(700, -100);
  EXPECT_EQ(lost.ping_confidence, 0);
  EXPECT_NEAR(lost.averaged_mm, 2000, 30);
  EXPECT_EQ(lost.averaged_confidence, 67);
  for (int i = 0; i < 20; ++i) distance(500, -20);
  EXPECT_NEAR(distance(500, -20).averaged_mm, 5000, 30) << "older distances do not count";
  EXPECT_EQ(s.earlier.size(), 20u);
}

TEST(S500, OnlyAutomaticSettingsFollowAPing) {
  const auto next = [](const SetPingParams& asked, int row, double echo_db) {
    Settings s;
    s.parameters.reach = {10000, 5};
    s.parameters = requested(s.parameters, asked);
    return after(profile_with(s, row, echo_db), s).parameters.reach;
  };
  EXPECT_EQ(next({.length_mm = 0, .gain = -1}, 900, 5).length_mm, 15000u);
  EXPECT_EQ(next({.length_mm = 0, .gain = -1}, 900, 5).gain, 4);
  EXPECT_EQ(next({.length_mm = 10000, .gain = -1}, 900, 5).length_mm, 10000u);
  EXPECT_EQ(next({.length_mm = 0, .gain = 7}, 900, 5).gain, 7);
  EXPECT_EQ(next({.length_mm = 0, .gain = -1}, 500, -30).gain, 11) << "the gain keeps the echo below full scale";
  Settings now;
  now.parameters.reach = {10000, 5};
  now.parameters = requested(now.parameters, {.length_mm = 0});
  const Ping before = profile_with(Settings{}, 900, 5);
  EXPECT_EQ(after(before, now).parameters.reach.length_mm, 10000u) << "the ping has older settings";
}

TEST(S500, TheAutomaticRangeCountsFromTheSonar) {
  const auto next = [](std::uint32_t start_mm, std::uint32_t length_mm, int row, double echo_db) {
    Settings s;
    s.parameters.reach = {length_mm, 5};
    s.parameters = requested(s.parameters, {.start_mm = start_mm, .length_mm = 0});
    return after(profile_with(s, row, echo_db), s).parameters.reach.length_mm;
  };
  EXPECT_EQ(next(10000, 10000, 400, 5), 10000u) << "13.9 m is at 70 % of 20 m";
  EXPECT_EQ(next(10000, 10000, 900, 5), 21500u) << "18.8 m is at 60 % of 31.5 m";
  EXPECT_EQ(next(20000, 40000, 20, 5), 15000u) << "20.8 m is at 60 % of 35 m";
  EXPECT_EQ(next(10000, 10000, 400, -100), 30000u) << "without an echo, an end at 20 m becomes one at 40 m";
  EXPECT_EQ(next(100000, 42000, 400, -100), 1000u) << "after the farthest end comes the shortest range";
  Settings now;
  now.parameters = requested(now.parameters, {.start_mm = 10000, .length_mm = 0});
  Settings before = now;
  before.parameters.ping.start_mm = 0;
  EXPECT_EQ(after(profile_with(before, 100, 5), now).parameters.reach.length_mm, 5000u) << "the ping has another start";
}

/// Both products use port 51200, so the host must detect which one answers.
TEST(PowerHost, SendsTheRequestOfTheProductThatAnswers) {
  const auto sent = [](const protocol::HostActions& actions) {
    std::vector<Bytes> all;
    for (const auto& action : actions)
      if (const auto* send = std::get_if<protocol::HostSend>(&action)) all.push_back(send->bytes);
    return ids_in(frames_in(all));
  };
  const auto opened = [&] {
    auto host = *omniscan::make_host({});
    EXPECT_THAT(sent(host->on_open({}, at_s(0))), ElementsAre(Id::general_request)) << "the host sends no settings yet";
    EXPECT_FALSE(host->is_open()) << "pings are not requested yet";
    return host;
  };
  const Bytes range = framed_message(Id::ping1d_range, 1, ScanRange{0, 5000}),
              unknown = nack(Id::ping1d_range, 1, "unknown message");
  const auto beside_an_s500 = opened();
  EXPECT_THAT(sent(beside_an_s500->on_bytes(0, range, at_s(0.1))), ElementsAre(Id::s500_set_ping_params));
  EXPECT_EQ(beside_an_s500->about(), "an S500");
  EXPECT_TRUE(beside_an_s500->is_open());
  const auto beside_an_omniscan = opened();
  EXPECT_THAT(sent(beside_an_omniscan->on_bytes(0, unknown, at_s(0.1))), ElementsAre(Id::os_ping_params));
  EXPECT_FALSE(beside_an_omniscan->next_tick());
  EXPECT_TRUE(beside_an_omniscan->is_open());
  EXPECT_THAT(sent(beside_an_omniscan->on_bytes(0, range, at_s(0.2))), ElementsAre())
      << "this answers the request of another host";
  const auto unanswered = opened();
  EXPECT_THAT(unanswered->on_tick(at_s(0.4)), testing::IsEmpty());
  EXPECT_FALSE(unanswered->is_open());
  EXPECT_THAT(sent(unanswered->on_tick(*unanswered->next_tick())), ElementsAre(Id::general_request, Id::os_ping_params));
  EXPECT_TRUE(unanswered->is_open());
  EXPECT_THAT(sent(unanswered->on_bytes(0, nack(Id::os_ping_params, 1, "unknown message"), at_s(1))),
              ElementsAre(Id::s500_set_ping_params));
  EXPECT_FALSE(unanswered->next_tick());

  // Some sonars are initially silent, for example while their bridge starts, and do not refuse unknown messages.
  const auto silent = [&] {
    auto host = opened();
    host->on_tick(*host->next_tick());
    EXPECT_THAT(sent(host->on_tick(*host->next_tick())), ElementsAre(Id::general_request)) << "the second request has been sent";
    return host;
  };
  EXPECT_THAT(sent(silent()->on_bytes(0, range, at_s(2))), ElementsAre(Id::s500_set_ping_params));
  const auto omniscan = silent();
  EXPECT_THAT(sent(omniscan->on_bytes(0, unknown, at_s(2))), ElementsAre());
  EXPECT_FALSE(omniscan->next_tick());
}

/// The limit is that of the product that answers, not of the product that the host assumed.
TEST(PowerHost, RefusesARateAboveThatOfTheProductThatAnswers) {
  protocol::Wanted wanted;
  wanted.settings.rate_hz = 20;
  const auto opened = [&](const Bytes& answer) {
    auto host = *omniscan::make_host(wanted);
    host->on_open({}, at_s(0));
    return host->on_bytes(0, answer, at_s(0.1));
  };
  const auto from_an_omniscan = opened(nack(Id::ping1d_range, 1, "unknown message"));
  ASSERT_EQ(from_an_omniscan.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<protocol::HostSend>(from_an_omniscan[0]));
  const auto from_an_s500 = opened(framed_message(Id::ping1d_range, 1, ScanRange{0, 5000}));
  ASSERT_EQ(from_an_s500.size(), 1u);
  const auto* error = std::get_if<Error>(&from_an_s500[0]);
  ASSERT_NE(error, nullptr);
  EXPECT_EQ(error->kind, ErrorKind::usage);
  EXPECT_EQ(error->text, "the rate of an S500 is 0 to 10 Hz, not 20 Hz");
}

}  // namespace
}  // namespace sonar::ping::s500
