// Replay of sonars of the ping protocol that send results one by one or in a stream, at the sockets of a driver.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/s500_messages.hpp"
#include "tests/daemon/commands/requested_replay_testing.hpp"

namespace sonar::requested_replay_test {
namespace {

using ::testing::ElementsAre;

// ---- range finders: a host requests each result, or a stream of results

Bytes ping1d_profile(std::uint32_t number) {
  ping::Profile profile;
  profile.distance_mm = 1000 + number;
  profile.confidence = 90;
  profile.ping = number;
  profile.length_mm = 4000;
  profile.count = 3;
  Bytes payload = wire::bytes_of(profile);
  payload.insert(payload.end(), 3, static_cast<std::byte>(number));
  return ping::framed(ping::Id::ping1d_profile, 1, payload);
}
template <class M>
M message_in(const ping::Frame& frame) {
  M message;
  wire::Reader reader(frame.payload);
  fields(reader, message);
  EXPECT_TRUE(reader.ok());
  return message;
}
/// Returns a message whose content is the number of another kind of message.
Bytes about(ping::Id request, ping::Id id) {
  const auto number = static_cast<unsigned>(id);
  return ping::framed(request, 0, Bytes{static_cast<std::byte>(number & 0xFF), static_cast<std::byte>(number >> 8)});
}
Bytes wanted(ping::Id id) { return about(ping::Id::general_request, id); }

TEST(ReplayOfPing1D, AHostByUdpGetsTheResultsThatItRequestsOneByOne) {
  Replay replay(file_of(raw_dump, {ping1d_profile(1), ping1d_profile(2), ping1d_profile(3), ping1d_profile(4)}));
  Udp host(9090);
  host.send(wanted(ping::Id::ping1d_general_info));
  EXPECT_EQ(host.next_id(), ping::Id::ping1d_general_info) << "the emulated device answers, not the recording";
  host.send(wanted(ping::Id::ping1d_profile));
  auto frame = host.read();
  ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_profile);
  EXPECT_EQ(message_in<ping::Profile>(*frame).ping, 1u);
  EXPECT_EQ(frame->payload.back(), std::byte{1}) << "a profile has its samples";
  host.send(wanted(ping::Id::ping1d_distance));
  frame = host.read();
  ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_distance) << "the distance is made of the recorded profile";
  const auto distance = message_in<ping::Distance>(*frame);
  EXPECT_EQ(distance.distance_mm, 1002u);
  EXPECT_EQ(distance.length_mm, 4000u);
  host.send(wanted(ping::Id::ping1d_distance_simple));
  frame = host.read();
  ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_distance_simple);
  EXPECT_EQ(message_in<ping::DistanceSimple>(*frame).distance_mm, 1003u);
  host.send(wanted(ping::Id::ping1d_profile));
  ASSERT_EQ(host.next_id(), ping::Id::ping1d_profile);
  EXPECT_TRUE(replay.ends()) << "that was the last ping";
  EXPECT_EQ(replay.figures().messages, 4u);
}

TEST(ReplayOfPing1D, AHostByTcpGetsTheRecordedBytes) {
  Bytes all;
  std::vector<Bytes> profiles;
  for (std::uint32_t i = 1; i <= 3; ++i) profiles.push_back(ping1d_profile(i));
  for (const Bytes& one : profiles) all.insert(all.end(), one.begin(), one.end());
  Replay replay(file_of(raw_dump, profiles));
  Tcp host(9090);
  host.send(about(ping::Id::ping1d_continuous_start, ping::Id::ping1d_profile));
  const Bytes acked = ping::ack(ping::Id::ping1d_continuous_start, 1), got = host.read_to_end();
  ASSERT_EQ(got.size(), acked.size() + all.size());
  EXPECT_EQ(Bytes(got.begin() + static_cast<std::ptrdiff_t>(acked.size()), got.end()), all);
}

Bytes ping1d_distance(std::uint32_t number) {
  ping::Distance distance;
  distance.distance_mm = 1000 + number;
  distance.confidence = 90;
  distance.ping = number;
  distance.length_mm = 4000;
  return ping::framed_message(ping::Id::ping1d_distance, 1, distance);
}
Bytes ping1d_simple(std::uint32_t number) {
  return ping::framed_message(ping::Id::ping1d_distance_simple, 1, ping::DistanceSimple{1000 + number, 90});
}
/// Returns the message with which PlayedPings represents each ping of a recording.
std::vector<Bytes> played(const std::vector<Bytes>& messages, const recording::Codec& of) {
  std::vector<RecordedMessage> all;
  for (const Bytes& message : messages) all.push_back({{}, Origin::device, Carrier::datagram, message});
  Messages reader(std::move(all));
  PlayedPings pings(reader, of);
  EXPECT_TRUE(pings.open("f"));
  std::vector<Bytes> richest;
  while (const auto ping = pings.next()) richest.push_back(ping->parts.front().second);
  EXPECT_TRUE(pings.at_end());
  return richest;
}

TEST(ReplayOfPing1D, TheMessageWithTheMostContentIsUsed) {
  const recording::Codec of = ping::ping1d::codec();
  const auto simple = ping1d_simple, distance = ping1d_distance, profile = ping1d_profile;
  EXPECT_THAT(played({simple(1), profile(1), simple(2), profile(2)}, of), ElementsAre(profile(1), profile(2)));
  EXPECT_THAT(played({profile(1), simple(1), profile(2), simple(2)}, of), ElementsAre(profile(1), profile(2)));
  EXPECT_THAT(played({simple(1), distance(1), profile(1), simple(2), distance(2)}, of), ElementsAre(profile(1), distance(2)));
  EXPECT_THAT(played({simple(1), profile(2), distance(3), simple(4)}, of),
              ElementsAre(simple(1), profile(2), distance(3), simple(4)))
      << "the numbers are those of four pings";
  EXPECT_THAT(played({simple(1), simple(1), profile(1), profile(1)}, of), ElementsAre(simple(1), profile(1), profile(1)))
      << "a ping has one message of each kind";
}

TEST(ReplayOfS500, TheMessageWithTheMostContentIsUsed) {
  ping::Profile6 profile;
  profile.depth_m = 2.5f;
  profile.smooth_depth_m = 2.25f;
  profile.confidence = 80;
  profile.smooth_confidence = 70;
  profile.power_up_ms = 100;
  const Bytes distance = ping::framed_message(ping::Id::s500_distance2, 0, ping::Distance2{2500, 2250, 0, 80, 70, 100}),
              later = ping::framed_message(ping::Id::s500_distance2, 0, ping::Distance2{2500, 2250, 0, 80, 70, 200}),
              altitude = ping::framed_message(ping::Id::ping1d_distance_simple, 0, ping::DistanceSimple{2500, 80}),
              whole = ping::framed_message(ping::Id::s500_profile6, 0, profile);
  EXPECT_THAT(played({altitude, distance, whole, later}, ping::s500::codec()), ElementsAre(whole, later));
}

TEST(ReplayOfPing1D, EveryProfileHasSamplesIfEveryPingHas) {
  Replay replay(file_of(raw_dump, {ping1d_simple(1), ping1d_profile(1), ping1d_simple(2), ping1d_profile(2)}));
  Udp host(9090);
  for (std::uint32_t number = 1; number <= 2; ++number) {
    host.send(wanted(ping::Id::ping1d_profile));
    const auto frame = host.read();
    ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_profile);
    const auto profile = message_in<ping::Profile>(*frame);
    EXPECT_EQ(profile.ping, number);
    EXPECT_EQ(profile.count, 3u);
  }
  EXPECT_TRUE(replay.ends());
}

TEST(ReplayOfS500, AStreamOfAnotherReportIsMadeOfTheRecordedOne) {
  std::vector<Bytes> reports;
  for (std::uint32_t i = 1; i <= 3; ++i)
    reports.push_back(ping::framed_message(ping::Id::s500_distance2, 0, ping::Distance2{2000 + i, 2000, 0, 80, 70, 10 * i}));
  Replay replay(file_of(ping_log, reports));
  Udp host(51200);
  ping::SetPingParams params;
  params.period_ms = 0;
  params.report = ping::Id::s500_profile6;
  host.send(ping::framed_message(ping::Id::s500_set_ping_params, 0, params));
  EXPECT_EQ(host.next_id(), ping::Id::ack);
  for (std::uint32_t i = 1; i <= 3; ++i) {
    const auto frame = host.read();
    ASSERT_TRUE(frame && frame->header.id == ping::Id::s500_profile6);
    const auto report = message_in<ping::Profile6>(*frame);
    EXPECT_NEAR(report.depth_m, 2 + 1e-3f * static_cast<float>(i), 1e-5);
    EXPECT_EQ(report.confidence, 80);
    EXPECT_EQ(report.results, 0) << "the recording has no samples";
  }
  EXPECT_TRUE(replay.ends());
}

// ---- sonars that send while their host enables pings: the recording sets the pace

Bytes points(std::uint32_t number) {
  ping::AtofPointData data;
  data.power_up_ms = 200 * number;
  data.ping = number;
  return ping::framed_message(ping::Id::atof_point_data, 0, data);
}
Bytes enabling(bool enable) {
  ping::PingParameters settings;
  settings.end_mm = 5000;
  settings.period_ms = 1000;
  settings.enable = enable ? 1 : 0;
  return ping::framed_message(ping::Id::set_ping_parameters, 0, settings);
}
/// Returns the next frame except acknowledgements and requests for the time.
std::optional<ping::Frame> next_measured(Udp& host) {
  while (auto frame = host.read())
    if (frame->header.id != ping::Id::utc_request && frame->header.id != ping::Id::ack) return frame;
  return std::nullopt;
}

TEST(ReplayOfSurveyor, AHostByUdpGetsEveryMessageAtTheRecordedPace) {
  std::vector<Bytes> messages;
  for (std::uint32_t i = 1; i <= 4; ++i) {
    messages.push_back(ping::framed_message(ping::Id::attitude_report, 0, ping::AttitudeReport{{}, {}, 0, 200 * i}));
    messages.push_back(points(i));
  }
  Replay replay(file_of(ping_log, messages));
  Udp host(62312);
  host.send(wanted(ping::Id::device_information));
  ASSERT_EQ(next_measured(host)->header.id, ping::Id::device_information) << "no ping comes before it";
  const auto begin = std::chrono::steady_clock::now();
  host.send(enabling(true));  // with a period of a second; the recording has five pings per second
  for (std::uint32_t i = 1; i <= 4; ++i)
    for (const ping::Id id : {ping::Id::attitude_report, ping::Id::atof_point_data}) {
      const auto frame = next_measured(host);
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->header.id, id) << i;
      EXPECT_EQ(ping::framed(frame->header.id, 0, frame->payload), messages[2 * (i - 1) + (id == ping::Id::atof_point_data)]);
    }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(590));
  EXPECT_TRUE(replay.ends());
  EXPECT_EQ(replay.figures().messages, 8u);
}

TEST(ReplayOfSurveyor, AnotherProductsMessagesInTheLogAreNotServed) {
  const Bytes tilt = ping::framed_message(ping::Id::attitude_report, 0, ping::AttitudeReport{{}, {}, 0, 200}),
              profile = ping::framed_message(ping::Id::os_mono_profile, 0, ping::OsMonoProfile{});
  const std::vector<Bytes> log{tilt, points(1), profile, points(2), profile};
  EXPECT_THAT(played(log, ping::surveyor::codec()), ElementsAre(tilt, points(1), points(2)));
  EXPECT_THAT(played(log, ping::omniscan::codec()), ElementsAre(profile, profile));
}

TEST(ReplayOfSurveyor, AHostByTcpIsAnsweredAndGetsPingsWhileItEnablesThem) {
  Replay replay(file_of(ping_log, {points(1), points(2), points(3)}), true);
  Tcp host(62312);
  ping::Framer framer(65535);
  const auto next = [&] {
    while (true) {
      const auto frame = framer.next();
      if (frame && frame->header.id != ping::Id::utc_request) return frame->header.id;
      if (!frame) framer.append(host.read());
    }
  };
  host.send(enabling(true));
  for (int i = 0; i < 7; ++i) EXPECT_EQ(next(), ping::Id::atof_point_data) << "the recording of three pings is repeated";
  host.send(ping::framed(ping::Id::set_device_id, 0, Bytes{std::byte{9}}));
  host.send(enabling(false));
  host.send(wanted(ping::Id::protocol_version));
  bool acked = false;
  for (auto id = next(); id != ping::Id::protocol_version; id = next()) acked |= id == ping::Id::ack;
  EXPECT_TRUE(acked);
  host.send(enabling(true));
  EXPECT_EQ(next(), ping::Id::atof_point_data);
}

}  // namespace
}  // namespace sonar::requested_replay_test
