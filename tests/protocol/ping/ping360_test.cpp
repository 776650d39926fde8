// Tests a host's conversation with an emulated Ping360, without a socket: turn times, scans, echoes, refusals, discovery.
#include <gmock/gmock.h>

#include <variant>

#include "core/base/geometry.hpp"
#include "protocol/ping/ping360_settings.hpp"
#include "protocol/ping/products.hpp"
#include "tests/protocol/ping/ping_testing.hpp"

namespace sonar::ping::ping360 {
namespace {

using namespace tests;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Bytes ping_at(std::uint16_t angle, Transducer t = {0, 1, 0, 100, 88, 750, 1200, 1, 0}) {
  t.angle = angle;
  return framed_message(Id::transducer, 0, t);
}
Bytes scan(std::uint16_t start, std::uint16_t stop, std::uint8_t steps = 1) {
  return framed_message(Id::auto_transmit, 0, AutoTransmit{1, 0, 80, 80, 750, 200, start, stop, steps, 0});
}
std::vector<int> angles(const std::vector<Frame>& frames) {
  std::vector<int> all;
  for (const Frame& frame : frames)
    if (frame.header.id == Id::auto_device_data) all.push_back(message_in<AutoDeviceData>(frame).angle);
  return all;
}
std::string text_in(const Frame& frame) {
  std::string text;
  for (const std::byte b : frame.payload) text += static_cast<char>(b);
  return text;
}

TEST(Ping360, AnswersRequestsForDeviceAndVersion) {
  Talk talk("ping360");
  talk.say(general(Id::device_information));
  talk.say(general(Id::protocol_version));
  talk.say(general(Id::device_data));
  talk.say(general(Id{1234}));
  const auto replies = talk.take();
  ASSERT_EQ(replies.size(), 4u);
  EXPECT_EQ(replies[0].header.source, 2);
  EXPECT_EQ(replies[0].payload, hex("02 00 03 03 08 00"));
  EXPECT_EQ(replies[1].payload[0], std::byte{1});
  const auto state = message_in<DeviceData>(replies[2]);
  EXPECT_EQ(state.count, 0);
  EXPECT_EQ(state.samples, 1024);
  EXPECT_EQ(state.khz, 740);
  EXPECT_EQ(replies[3].header.id, Id::nack);
  EXPECT_EQ(replies[3].payload[0], std::byte{1234 & 0xff});
}

TEST(Ping360, APingWaitsForTheHead) {
  Talk talk("ping360");
  talk.say(ping_at(200));
  EXPECT_NEAR(talk.run_to(5), 1.2, 1e-6) << "a turn of 200 grad takes 6 ms per grad";
  const auto replies = talk.take();
  ASSERT_EQ(replies.size(), 1u);
  const auto data = message_in<DeviceData>(replies[0]);
  EXPECT_EQ(data.mode, 0);
  EXPECT_EQ(data.gain, 1);
  EXPECT_EQ(data.angle, 200);
  EXPECT_EQ(data.transmit_us, 100);
  EXPECT_EQ(data.period, 88);
  EXPECT_EQ(data.count, 1200);
  EXPECT_EQ(replies[0].payload.size(), wire::wire_size<DeviceData>() + 1200);
  talk.say(ping_at(201), 5);
  EXPECT_NEAR(talk.run_to(6), 5.006, 1e-6);
  talk.say(ping_at(400), 6);
  EXPECT_NEAR(talk.run_to(9), 7.194, 1e-6) << "the head turns the shorter way; hosts send 400 for 0";
  EXPECT_EQ(message_in<DeviceData>(talk.take().back()).angle, 0);
}

TEST(Ping360, TheHeadTurnsToStarboard) {
  Talk talk("ping360", 0, {{"mount_grad", "50"}});
  talk.say(ping_at(50));
  talk.run_to(1);
  EXPECT_NEAR(talk.aim.head_rad, -pi / 2, 1e-12);
}

TEST(Ping360, TurnsAndAnswersWithoutTransmitting) {
  Talk talk("ping360");
  Transducer t{1, 2, 0, 10, 80, 800, 300, 0, 0};
  talk.say(ping_at(10, t));
  const auto due = talk.dialogue->next_ping_request();
  ASSERT_TRUE(due) << "stepped time waits for the turn";
  EXPECT_NEAR(seconds(*due - at_s(0)), 0.06, 1e-6);
  EXPECT_NEAR(talk.run_to(1), 0.06, 1e-6);
  EXPECT_FALSE(talk.dialogue->next_ping_request());
  const auto replies = talk.take();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(talk.pings, 0);
  const auto data = message_in<DeviceData>(replies[0]);
  EXPECT_EQ(data.angle, 10);
  EXPECT_EQ(data.samples, 300);
  EXPECT_EQ(data.count, 0);
}

TEST(Ping360, AScanStartsAgainAtItsStart) {
  Talk talk("ping360");
  talk.say(scan(0, 6, 2));
  talk.run_to(0.25);
  const auto got = angles(talk.take());
  ASSERT_GE(got.size(), 6u);
  EXPECT_THAT(std::vector<int>(got.begin(), got.begin() + 6), ElementsAre(0, 2, 4, 6, 0, 2));
}

TEST(Ping360, AScanAcrossZeroTurnsAroundOrWraps) {
  for (const bool wrap : {false, true}) {
    Talk talk("ping360", 0, {{"sector_scan", wrap ? "wrap" : "oscillate"}});
    talk.say(scan(398, 1));
    talk.run_to(0.2);
    const auto got = angles(talk.take());
    ASSERT_GE(got.size(), 6u);
    const std::vector<int> first(got.begin(), got.begin() + 6);
    if (wrap)
      EXPECT_THAT(first, ElementsAre(398, 399, 0, 1, 398, 399));
    else
      EXPECT_THAT(first, ElementsAre(398, 399, 0, 1, 0, 399));
  }
}

TEST(Ping360, AScanIsAsSlowAsItsLink) {
  Talk fast("ping360"), slow("ping360", 0, {{"link_rate", "115200"}});
  for (Talk* talk : {&fast, &slow}) {
    talk->say(scan(0, 399));
    talk->run_to(10);
  }
  EXPECT_NEAR(fast.pings, 10 / 0.0064, 2) << "6 ms per grad and 0.4 ms of samples";
  EXPECT_NEAR(slow.pings, 10 / (0.0064 + 230 * 10 / 115200.0), 2);
}

TEST(Ping360, AnyNewRequestEndsAScan) {
  for (const Bytes& end :
       {request(Id::motor_off), request(Id::reset, hex("00 00")), ping_at(0, {1, 0, 0, 10, 80, 750, 200, 0, 0})}) {
    Talk talk("ping360");
    talk.say(scan(0, 399));
    talk.run_to(0.05);
    talk.take();
    talk.apply(talk.dialogue->on_tick(talk.dialogue->next_tick(), false));  // a ping is in progress
    talk.say(end, 0.06);
    talk.deliver(0.061);
    talk.run_to(5);
    EXPECT_THAT(angles(talk.take()), ElementsAre()) << "a ping of the scan came after its end";
  }
}

TEST(Ping360, RefusesWrongRequestsWithTheirMessageId) {
  for (const Bytes& wrong :
       {ping_at(401), ping_at(0, {1, 3, 0, 10, 80, 750, 200, 1, 0}), ping_at(0, {1, 0, 0, 10, 79, 750, 200, 1, 0}),
        ping_at(0, {1, 0, 0, 10, 80, 750, 1201, 1, 0}), scan(0, 400), scan(400, 10), scan(0, 10, 11), request(Id{2222}),
        request(Id::transducer, hex("01 00"))}) {
    Talk talk("ping360");
    talk.say(wrong);
    const auto replies = talk.take();
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_EQ(replies[0].header.id, Id::nack);
    EXPECT_EQ(replies[0].payload[0], wrong[4]);
    EXPECT_EQ(replies[0].payload[1], wrong[5]);
  }
  Talk talk("ping360");
  talk.say(ping_at(0, {1, 0, 0, 10, 80, 750, 1201, 1, 0}));
  EXPECT_THAT(text_in(talk.take().front()), HasSubstr("number_of_samples 1201 is not in 200..1200"));
}

TEST(Ping360, ADatagramGetsOneAnswerAndMessagesOfDevicesGetNone) {
  Talk talk("ping360");
  Bytes flood = general(Id::protocol_version);
  for (int i = 0; i < 300; ++i)
    for (const std::byte b : hex("42 52 00 00")) flood.push_back(b);
  talk.say(flood);
  EXPECT_EQ(talk.take().size(), 1u);
  talk.say(Bytes(flood.begin() + 12, flood.end()));
  EXPECT_EQ(talk.take().size(), 0u) << "false starts with wrong sums";
  Bytes wrong = general(Id::protocol_version);
  wrong.back() = std::byte{0x55};
  talk.say(wrong);
  EXPECT_EQ(talk.take().size(), 1u) << "a datagram that is one frame with a wrong sum is refused";
  for (const Bytes& of_a_device : {ack(Id::motor_off, 1), nack(Id::device_information, 1, "unknown message")}) {
    talk.say(of_a_device);
    EXPECT_EQ(talk.take().size(), 0u) << "otherwise two devices would answer each other endlessly";
  }
}

/// Hosts send such datagrams through a bridge to a serial line.
TEST(Ping360, TheAnswerToADatagramIsOnlyALittleLonger) {
  Talk talk("ping360");
  Bytes three = request(Id::set_device_id, hex("09"));
  for (const Bytes& more : {general(Id::protocol_version), ping_at(0)}) three.insert(three.end(), more.begin(), more.end());
  auto reaction = talk.dialogue->on_bytes(three, at_s(2));
  EXPECT_EQ(reaction.replies.size(), 1u);
  talk.apply(std::move(reaction));
  talk.run_to(3);
  std::vector<Id> ids;
  for (const Frame& frame : talk.take()) ids.push_back(frame.header.id);
  EXPECT_THAT(ids, testing::ElementsAre(Id::ack, Id::protocol_version, Id::device_data));

  Bytes flood;
  for (int i = 0; i < 140; ++i)
    for (const std::byte b : request(Id{2222})) flood.push_back(b);
  const auto answers = talk.dialogue->on_bytes(flood, at_s(4)).replies;
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_LT(answers.front().size(), flood.size() + 256);
}

TEST(Ping360, TheIdOfTheDeviceCanBeSet) {
  Talk talk("ping360");
  talk.say(request(Id::set_device_id, hex("09")));
  talk.say(ping_at(0), 1);
  talk.run_to(2);
  const auto replies = talk.take();
  ASSERT_EQ(replies.size(), 2u);
  EXPECT_EQ(replies[0].header.id, Id::ack);
  EXPECT_EQ(replies[1].header.source, 9);
  talk.say(request(Id::ping360_set_device_id, hex("00 00")));
  EXPECT_EQ(talk.take().front().header.id, Id::nack);
}

TEST(Ping360, APingThatIsNotMadeDoesNotEndAScan) {
  Talk talk("ping360");
  talk.say(scan(0, 399));
  talk.apply(talk.dialogue->on_tick(at_s(0), false));  // requested, but never delivered
  talk.run_to(3);
  EXPECT_GT(talk.pings, 10);
}

TEST(Ping360, ASinglePingThatIsLateIsAnswered) {
  Talk talk("ping360");
  talk.say(ping_at(0));
  talk.apply(talk.dialogue->on_tick(at_s(0), false));
  talk.run_to(3);
  EXPECT_EQ(talk.pings, 1) << "the ping is not requested again";
  talk.deliver(3.5);
  const auto answers = talk.take();
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].header.id, Id::device_data);
  talk.deliver(3.6);
  EXPECT_TRUE(talk.take().empty());
}

TEST(Ping360, AScanLosesNoPingThatIsLate) {
  Talk talk("ping360");
  talk.say(scan(0, 399));
  const auto tick = [&](bool pending) { talk.apply(talk.dialogue->on_tick(talk.dialogue->next_tick(), pending)); };
  tick(false);
  const protocol::RequestPing first = talk.aim;
  tick(false);  // the first ping is too late
  tick(false);
  EXPECT_EQ(talk.pings, 2);
  tick(true);  // no further request while a ping is pending
  EXPECT_EQ(talk.pings, 2);
  const protocol::RequestPing second = std::exchange(talk.aim, first);
  talk.deliver(5);
  talk.aim = second;
  talk.deliver(5.1);
  talk.run_to(5.2);
  const auto received = angles(talk.take());
  ASSERT_GE(received.size(), 3u);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(received[static_cast<std::size_t>(i)], i);
}

TEST(Ping360, IsFoundByOneDatagram) {
  Talk talk("ping360");
  const protocol::Port& port = talk.vendor.ports()[1];
  const auto ask = [&](std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    return talk.vendor.on_datagram(port, bytes, talk.state, at_s(0));
  };
  const auto found = ask("Discovery");
  ASSERT_EQ(found.replies.size(), 1u);
  std::string text;
  for (const std::byte b : found.replies[0]) text += static_cast<char>(b);
  EXPECT_EQ(text, "PING360\r\nBlue Robotics\r\nMAC Address:- 02-53-4F-00-00-01\r\nIP Address:- 192.168.002.010\r\n");
  EXPECT_TRUE(ask("discover").replies.empty());
  const auto stored = ask("SetSS1IP 192.168.002.011");
  ASSERT_EQ(stored.events.size(), 1u);
  EXPECT_EQ(std::get<protocol::StoreAddress>(stored.events[0]).address.ip, 0xC0A8020Bu);
  EXPECT_TRUE(ask("SetSS1IP 192.168.002.999").events.empty());
}

TEST(Ping360, RangesFollowFromSampleTimesAndTheTrueSpeedOfSound) {
  for (const double speed : {1450.0, 1500.0}) {
    protocol::DeviceState d = device("ping360");
    d.water.sound_speed_mps = speed;
    const PingSettings s = ping_settings(settings_of(Transducer{1, 0, 0, 10, 88, 750, 1200, 1, 0}), d);
    EXPECT_NEAR(s.range_of_row(0), 88 * 25e-9 * speed / 2, 1e-9);
    EXPECT_NEAR(s.range_m, 1200 * 88 * 25e-9 * speed / 2, 1e-9);
  }
}

TEST(Ping360Host, RepeatsItsFirstRequestUntilItIsAnswered) {
  const auto host = ping360::make_host({});
  ASSERT_TRUE(host);
  const auto sent = [](const protocol::HostActions& actions) {
    return actions.size() == 1 ? std::get<protocol::HostSend>(actions.front()).bytes : Bytes{};
  };
  const Bytes first = sent((*host)->on_open({}, at_s(0)));
  EXPECT_FALSE(first.empty());
  EXPECT_TRUE((*host)->on_tick(at_s(0.9)).empty());
  for (const double s : {1.0, 2.0}) {
    EXPECT_EQ((*host)->next_tick(), at_s(s));
    EXPECT_EQ(sent((*host)->on_tick(at_s(s))), first);
  }
  EXPECT_FALSE((*host)->is_open());
  (*host)->on_bytes(0, framed_message(Id::protocol_version, 1, ProtocolVersion{}), at_s(2.5));
  EXPECT_TRUE((*host)->is_open());
  EXPECT_FALSE((*host)->next_tick());
  EXPECT_TRUE((*host)->on_tick(at_s(9)).empty());
}

}  // namespace
}  // namespace sonar::ping::ping360
