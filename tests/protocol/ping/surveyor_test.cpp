// Tests a host's conversation with an emulated Surveyor 240, without a socket: sessions, the clock, refusals.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "protocol/ping/products.hpp"
#include "protocol/ping/surveyor.hpp"
#include "tests/protocol/ping/ping_testing.hpp"

namespace sonar::ping::surveyor {
namespace {

using namespace tests;

Bytes pings(PingParameters p = {.end_mm = 5000, .enable = 1}) { return framed_message(Id::set_ping_parameters, 0, p); }

Ping ping_of(const Talk& talk, double at) {
  Ping ping;
  ping.request.settings = talk.settings;
  ping.request.vendor_settings = talk.state.settings;
  ping.request.fired_at = at_s(at);
  ping.request.number = PingNumber(7);
  ping.beam_azimuth_rad.resize(static_cast<std::size_t>(talk.settings.beam_count));
  ping.samples.resize(2 * static_cast<std::size_t>(talk.settings.range_bin_count * talk.settings.beam_count));
  return ping;
}

TEST(Surveyor, TheEnableFieldStartsAndEndsASession) {
  Talk talk("surveyor-240");
  talk.say(general(Id::device_information));
  ASSERT_EQ(talk.take().size(), 1u);
  EXPECT_EQ(talk.settings.rate_hz, 0);
  talk.say(pings());
  EXPECT_EQ(talk.settings.rate_hz, 10);
  EXPECT_DOUBLE_EQ(talk.settings.range_start_m, 0.25) << "at least 5 % of the end";
  EXPECT_DOUBLE_EQ(talk.settings.range_m, 5);
  talk.say(pings({.end_mm = 30000, .period_ms = 10, .enable = 1}));
  EXPECT_NEAR(talk.settings.rate_hz, 1 / (60 / 1500.0 + 0.01), 1e-3) << "the travel time limits the rate";
  talk.say(pings({.end_mm = 5000, .enable = 0}));
  EXPECT_EQ(talk.settings.rate_hz, 0);
}

TEST(Surveyor, TheShortestRangeHasTenMillimetresWhereverItBegins) {
  for (std::int32_t start_mm = 0; start_mm <= 199990; start_mm += 10) {
    EXPECT_EQ(complaint({.start_mm = start_mm, .end_mm = start_mm + 10}), "") << start_mm;
    EXPECT_NE(complaint({.start_mm = start_mm, .end_mm = start_mm + 9}), "") << start_mm;
  }
  EXPECT_NE(complaint({.start_mm = 0, .end_mm = 200001}), "");
  EXPECT_NE(complaint({.start_mm = 2147483647, .end_mm = 2147483647}), "");
}

TEST(Surveyor, RequestsForMessagesOfEachPingAreAnsweredByTheNextPing) {
  Talk talk("surveyor-240");
  const auto answered = [&](Id id) {
    talk.say(general(id));
    return !talk.take().empty();
  };
  EXPECT_TRUE(answered(Id::yz_point_data)) << "the refusal, because no pings are enabled";
  talk.say(pings({.end_mm = 5000, .enable = 1, .yz = 1, .atof = 0}));
  EXPECT_FALSE(answered(Id::yz_point_data));
  EXPECT_FALSE(answered(Id::attitude_report));
  EXPECT_TRUE(answered(Id::atof_point_data)) << "the refusal, because the message is not enabled";
}

TEST(Surveyor, TheHostSetsTheClock) {
  Talk talk("surveyor-240");
  talk.say(pings());
  talk.run_to(0);
  const auto asked = talk.take();
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].header.id, Id::utc_request);
  EXPECT_EQ(talk.dialogue->next_tick(), at_s(10));
  talk.say(pings());
  EXPECT_EQ(talk.dialogue->next_tick(), at_s(10)) << "the device has requested the time already";
  const auto utc = [&](double at) {
    return message_in<AttitudeReport>(frames_in({*talk.vendor.frame(ping_of(talk, at), talk.state)}).front()).utc_ms;
  };
  EXPECT_EQ(utc(1), 0u);
  talk.say(framed_message(Id::utc_response, 0, UtcResponse{1800000000000, 0}), 1);
  EXPECT_NEAR(static_cast<double>(utc(1.5)), 1800000000500.0, 1);
  EXPECT_EQ(talk.settings.rate_hz, 10) << "the other settings stay";
}

/// Some hosts read one message of each packet. If the request were in the packet of an answer, they would get the answer late.
TEST(Surveyor, TheDeviceRequestsTheTimeAfterEnable) {
  Talk talk("surveyor-240");
  const auto times_asked = [&] {
    const auto said = talk.take();
    return std::count_if(said.begin(), said.end(), [](const Frame& frame) { return frame.header.id == Id::utc_request; });
  };
  talk.say(general(Id::device_information));
  talk.say(pings({.end_mm = 5000, .enable = 0}));
  talk.run_to(9);
  EXPECT_EQ(times_asked(), 0);
  talk.say(pings(), 9);
  talk.run_to(9);
  EXPECT_EQ(times_asked(), 1);
  Talk other("surveyor-240");
  other.run_to(10);
  EXPECT_EQ(other.take().size(), 1u) << "after 10 s the device requests the time even if no pings are enabled";
}

TEST(Surveyor, AGeneralRequestForTheTimeRequestIsAnsweredWithIt) {
  Talk talk("surveyor-240");
  talk.say(general(Id::utc_request), 3);
  talk.run_to(3);
  const auto said = talk.take();
  ASSERT_EQ(said.size(), 1u) << "no refusal";
  EXPECT_EQ(said[0].header.id, Id::utc_request);
}

TEST(Surveyor, SendsOneFramePerDatagramAndTheSameFramesOverTcp) {
  Talk talk("surveyor-240");
  talk.state.powered_up_at = at_s(0);
  talk.state.framed_at = at_s(5.4);
  for (const bool atof : {false, true}) {
    talk.say(pings({.end_mm = 5000, .enable = 1, .yz = 1, .atof = atof}));
    const Ping ping = ping_of(talk, 5.5);
    const auto datagrams = talk.vendor.datagrams(talk.vendor.ports()[1], ping, talk.state);
    std::vector<Id> ids;
    for (const Frame& frame : frames_in(datagrams)) ids.push_back(frame.header.id);
    if (atof)
      EXPECT_THAT(ids, ::testing::ElementsAre(Id::attitude_report, Id::atof_point_data, Id::yz_point_data));
    else
      EXPECT_THAT(ids, ::testing::ElementsAre(Id::attitude_report, Id::yz_point_data));
    EXPECT_EQ(datagrams.size(), ids.size());
    Bytes all;
    for (const Bytes& one : datagrams) all.insert(all.end(), one.begin(), one.end());
    EXPECT_EQ(*talk.vendor.frame(ping, talk.state), all);
  }
  const auto size_at = [&](double at) {
    return talk.vendor.datagrams(talk.vendor.ports()[1], ping_of(talk, at), talk.state).size();
  };
  EXPECT_EQ(size_at(6.05), 4u) << "water_stats (118) is added once per second";
  EXPECT_EQ(size_at(6.35), 4u) << "also if pings are rarer than requested";
  talk.state.framed_at = at_s(6.35);
  EXPECT_EQ(size_at(6.45), 3u);
}

TEST(Surveyor, PointsAreDetectedOnce) {
  Talk talk("surveyor-240");
  talk.say(pings({.end_mm = 5000, .enable = 1, .yz = 1, .atof = 1}));
  Ping ping = ping_of(talk, 5.5);
  const std::size_t beams = ping.beam_azimuth_rad.size();
  for (std::size_t i = 0; i < beams; ++i)
    ping.beam_azimuth_rad[i] = 0.7f - 1.4f * static_cast<float>(i) / static_cast<float>(beams - 1);
  ping.samples[2 * (100 * beams + beams / 2) + 1] = std::byte{0xF0};
  const auto said = [&] { return *talk.vendor.frame(ping, talk.state); };
  const Bytes found_in_samples = said();
  look_at(ping);
  std::fill(ping.samples.begin(), ping.samples.end(), std::byte{0});
  EXPECT_EQ(said(), found_in_samples) << "look_at() has stored the point before the samples were cleared";
  look_at(ping);
  EXPECT_LT(said().size(), found_in_samples.size()) << "without samples there is no point";
}

/// Returns an AtofPointData or YzPointData of a ping that ends at 15 m, with one point 10 m away and 0.1 rad to port.
Bytes one_point(Id id, std::uint32_t ping) {
  Bytes payload, point;
  if (id == Id::atof_point_data) {
    payload = wire::bytes_of(AtofPointData{.listening_s = 0.02f, .speed_mps = 1500, .ping = ping, .points = 1});
    point = wire::bytes_of(AtofPoint{0.1f, 20.0f / 1500, {}});
  } else {
    payload = wire::bytes_of(YzPointData{.ping = ping, .speed_mps = 1500, .end_m = 15, .points = 1});
    const float y = 10 * std::sin(0.1f), z = -10 * std::cos(0.1f);
    wire::Writer write(point);
    write("y", y);
    write("z", z);
  }
  payload.insert(payload.end(), point.begin(), point.end());
  return framed(id, 0, payload);
}

TEST(Surveyor, TheHostReadsThePointsOfAPingOnceFromEitherMessage) {
  const auto host = *make_host({.as_it_is = true, .settings = {}});
  const auto read = [&](const Bytes& bytes) {
    std::vector<protocol::HostPing> pings;
    for (const protocol::HostAction& action : host->on_bytes(0, bytes, at_s(0)))
      if (const auto* const ping = std::get_if<protocol::HostPing>(&action)) pings.push_back(*ping);
    return pings;
  };
  std::uint32_t number = 0;
  for (const Id id : {Id::atof_point_data, Id::yz_point_data}) {
    const auto pings = read(one_point(id, ++number));
    ASSERT_EQ(pings.size(), 1u);
    EXPECT_EQ(pings[0].facts.number, number);
    EXPECT_NEAR(pings[0].facts.range_m, 15, 1e-4);
    const SonarPicture picture = pings[0].drawing();
    ASSERT_EQ(picture.points.size(), 1u);
    EXPECT_NEAR(picture.points[0].first, 0.1, 1e-5);
    EXPECT_NEAR(picture.points[0].second, 10, 1e-4);
  }
  Bytes both = one_point(Id::atof_point_data, ++number);
  const Bytes again = one_point(Id::yz_point_data, number);
  both.insert(both.end(), again.begin(), again.end());
  EXPECT_EQ(read(both).size(), 1u);
}

TEST(Surveyor, RefusesWrongRequests) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const PingParameters& p :
       {PingParameters{.end_mm = -1}, PingParameters{.end_mm = 9}, PingParameters{.end_mm = 300000},
        PingParameters{.start_mm = 6000, .end_mm = 5000}, PingParameters{.speed_mps = nan}, PingParameters{.gain = 101},
        PingParameters{.steps = 199}, PingParameters{.pulse_steps = nan}, PingParameters{.period_ms = -1}}) {
    Talk talk("surveyor-240");
    talk.say(pings(p));
    const auto replies = talk.take();
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_EQ(replies[0].header.id, Id::nack);
  }
  Talk talk("surveyor-240");
  talk.say(pings({.end_mm = 10, .speed_mps = 2000, .period_ms = 0, .enable = 1}));
  EXPECT_FLOAT_EQ(talk.settings.rate_hz, talk.state.model->max_rate_hz) << "the shortest range has the highest rate";
}

TEST(Surveyor, ASilentUdpHostIsDroppedEarlierIfItEnablesNoPings) {
  Talk tcp("surveyor-240", 0), udp("surveyor-240", 1);
  EXPECT_FALSE(tcp.dialogue->longest_silence());
  EXPECT_EQ(udp.dialogue->longest_silence(), std::chrono::seconds(10));
  udp.say(pings());
  tcp.say(pings());
  EXPECT_EQ(udp.dialogue->longest_silence(), std::chrono::seconds(60)) << "the sender of a datagram may be forged";
  EXPECT_FALSE(udp.dialogue->hosts_fall_silent()) << "hosts answer requests for the time";
  EXPECT_FALSE(tcp.dialogue->longest_silence());
}

}  // namespace
}  // namespace sonar::ping::surveyor
