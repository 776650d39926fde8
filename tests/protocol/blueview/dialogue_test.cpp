#include "protocol/blueview/blueview.hpp"

#include <gtest/gtest.h>

#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::blueview {
namespace {

using protocol::ChangeSettings;
using protocol::Close;
using protocol::Reaction;
using protocol::RequestPing;
using test::at_s;

/// One host, and a device that applies requests as the daemon applies them.
struct Host {
  explicit Host(protocol::DeviceState& d) : device(d), dialogue(make_dialogue(d, at_s(0))) {}
  Reaction say(const wire::Bytes& bytes, double s = 0) { return apply_changes(dialogue->on_bytes(bytes, at_s(s))); }
  Reaction tick(double s) { return apply_changes(dialogue->on_tick(at_s(s), ping_pending)); }
  protocol::Delivery ready(double s = 0) { return dialogue->on_ping(device.settings.get(), 1000, at_s(s)); }
  Reaction apply_changes(Reaction r) {
    for (const auto& event : r.events)
      if (const auto* change = std::get_if<ChangeSettings>(&event)) device.settings = change->vendor_settings;
    return r;
  }
  protocol::DeviceState& device;
  bool ping_pending = false;
  std::unique_ptr<protocol::Dialogue> dialogue;
};
int pings_requested(const Reaction& r) {
  return static_cast<int>(
      std::count_if(r.events.begin(), r.events.end(), [](const auto& e) { return std::holds_alternative<RequestPing>(e); }));
}
bool closes(const Reaction& r) {
  return std::any_of(r.events.begin(), r.events.end(), [](const auto& e) { return std::holds_alternative<Close>(e); });
}
std::uint32_t id_of(const wire::Bytes& header) { return test::reply_from(header).header.request_id; }

TEST(BlueViewDialogue, HelloIsAnsweredWithTheSonarsDescription) {
  auto device = test::device("blueview-m900-2250-130");
  Host host(device);
  const Reaction r = host.say(test::hello());
  ASSERT_EQ(r.replies.size(), 1u);
  const auto reply = test::reply_from(r.replies[0]);
  EXPECT_EQ(reply.header.type, reply_to(FrameType::hello));
  EXPECT_EQ(reply.header.request_id, 1u);
  wire::Reader reader(reply.payload);
  std::uint16_t version = 0;
  float temperature = 0;
  std::uint32_t capabilities = 9;
  std::uint8_t heads = 0;
  reader("proto", version);
  EXPECT_EQ(read_text(reader, "model"), "M900-2250-130");
  EXPECT_EQ(read_text(reader, "name"), "front");
  EXPECT_EQ(read_text(reader, "serial"), "7001");
  read_text(reader, "firmware");
  reader("temp_c", temperature);
  reader("caps", capabilities);
  reader("n_heads", heads);
  EXPECT_EQ(heads, 2);
  EXPECT_EQ(capabilities, 0u);
  EXPECT_NEAR(temperature, 14, 0.01);
}

TEST(BlueViewDialogue, AnotherVersionIsRefusedAndClosed) {
  auto device = test::device();
  Host host(device);
  const Reaction r = host.say(test::hello(2));
  ASSERT_EQ(r.replies.size(), 1u);
  EXPECT_EQ(test::error_code_of(test::reply_from(r.replies[0])), 14004);
  EXPECT_TRUE(closes(r));
}

TEST(BlueViewDialogue, RequestsBeforeHelloAndUnknownTypesAreRefused) {
  auto device = test::device();
  Host host(device);
  EXPECT_EQ(test::error_code_of(test::reply_from(host.say(test::ping(5)).replies.at(0))), 14004);
  host.say(test::hello());
  const auto unknown = test::reply_from(host.say(test::request(static_cast<FrameType>(0x0777), 9)).replies.at(0));
  EXPECT_EQ(test::error_code_of(unknown), 14001);
  EXPECT_EQ(unknown.header.request_id, 9u);
}

TEST(BlueViewDialogue, SettingsAreSharedByAllHosts) {
  auto device = test::device();
  Host one(device), two(device);
  one.say(test::hello());
  two.say(test::hello());
  const auto set = test::reply_from(one.say(test::set(2, 0, Key::range, FloatPair{1, 20})).replies.at(0));
  EXPECT_EQ(set.header.type, reply_to(FrameType::set));
  const auto got = test::reply_from(two.say(test::get(3, 0, Key::stop_range)).replies.at(0));
  wire::Reader reader(got.payload);
  EXPECT_EQ(std::get<float>(*read_value(reader, Key::stop_range)), 20);
}

TEST(BlueViewDialogue, AllOfSeveralSetRequestsInOneReadAreApplied) {
  auto device = test::device();
  Host host(device);
  wire::Bytes all = test::hello();
  for (const wire::Bytes& more : {test::set(2, 0, Key::gain, 5.0f), test::set(3, 0, Key::tvg, 0.5f)})
    all.insert(all.end(), more.begin(), more.end());
  EXPECT_EQ(host.say(all).replies.size(), 3u);
  const SonarSettings now = settings_from(device.settings.get(), device);
  EXPECT_EQ(now.heads[0].gain_db, 5);
  EXPECT_EQ(now.heads[0].tvg_db_per_m, 0.5f);
}

TEST(BlueViewDialogue, APingGoesOnceToHostsThatRequestedIt) {
  auto device = test::device();
  Host one(device), two(device), quiet(device);
  for (Host* h : {&one, &two, &quiet}) h->say(test::hello());
  EXPECT_EQ(pings_requested(one.say(test::ping(11))), 1);
  EXPECT_EQ(pings_requested(two.say(test::ping(22))), 1);
  one.say(test::ping(12));
  const auto first = one.ready(), second = two.ready();
  ASSERT_EQ(first.prefixes.size(), 2u);
  EXPECT_EQ(id_of(first.prefixes[0]), 11u);
  EXPECT_EQ(id_of(first.prefixes[1]), 12u);
  EXPECT_EQ(test::reply_from(first.prefixes[0]).header.payload_length, 1000u);
  ASSERT_EQ(second.prefixes.size(), 1u);
  EXPECT_EQ(id_of(second.prefixes[0]), 22u);
  EXPECT_TRUE(quiet.ready().prefixes.empty());
  EXPECT_TRUE(one.ready().prefixes.empty()) << "the requests are answered already";
}

TEST(BlueViewDialogue, APingWithOlderSettingsDoesNotAnswerARequest) {
  auto device = test::device();
  Host host(device);
  host.say(test::hello());
  const auto before = device.settings;
  host.say(test::set(2, 0, Key::transmit, std::int32_t{0}));
  host.say(test::ping(3));
  const auto stale = host.dialogue->on_ping(before.get(), 10, at_s(0));
  EXPECT_TRUE(stale.prefixes.empty());
  EXPECT_FALSE(stale.events.empty()) << "the dialogue requests another ping";
  const auto fresh = host.ready();
  ASSERT_EQ(fresh.prefixes.size(), 1u);
  EXPECT_EQ(id_of(fresh.prefixes[0]), 3u);
}

TEST(BlueViewDialogue, TriggersOfTwoHeadsAreServedOneAfterTheOther) {
  auto device = test::device("blueview-m900-2250-130");
  Host host(device);
  host.say(test::hello());
  host.say(test::ping(1, 0));
  const auto of_first_head = device.settings;
  host.say(test::ping(2, 1));
  const auto delivery = host.dialogue->on_ping(of_first_head.get(), 10, at_s(0));
  ASSERT_EQ(delivery.prefixes.size(), 1u);
  EXPECT_EQ(id_of(delivery.prefixes[0]), 1u);
  ASSERT_EQ(delivery.events.size(), 2u) << "the other head pings next";
  EXPECT_EQ(std::get<ChangeSettings>(delivery.events[0]).settings.mode, 1);
}

TEST(BlueViewDialogue, ASubscriptionWaitsForAPendingSinglePingOfAnotherHead) {
  auto device = test::device("blueview-m900-2250-130");
  Host one(device), two(device);
  for (Host* h : {&one, &two}) h->say(test::hello());
  two.say(test::two_numbers(FrameType::subscribe, 4, 1, 200));
  one.say(test::ping(1, 0));
  two.ping_pending = true;
  EXPECT_EQ(pings_requested(two.tick(0.2)), 0);
  two.ping_pending = false;
  EXPECT_EQ(pings_requested(two.tick(0.4)), 1);
}

TEST(BlueViewDialogue, HeadsMayBeNumberedFromZeroOrOne) {
  auto device = test::device();
  Host host(device);
  host.say(test::hello());
  EXPECT_EQ(pings_requested(host.say(test::ping(1, 0))), 1);
  EXPECT_EQ(pings_requested(host.say(test::ping(2, 1))), 1);
  EXPECT_EQ(test::error_code_of(test::reply_from(host.say(test::ping(3, 2)).replies.at(0))), 2010);
  auto strict = test::device("blueview-p900-90", {{"heads_base", "strict"}});
  Host other(strict);
  other.say(test::hello());
  EXPECT_EQ(test::error_code_of(test::reply_from(other.say(test::ping(1, 1)).replies.at(0))), 2010);
}

TEST(BlueViewDialogue, ATriggerWithoutPingTimesOut) {
  auto device = test::device();
  Host host(device);
  host.say(test::hello());
  host.say(test::ping(7, 0, 500), 1);
  EXPECT_LE(host.dialogue->next_tick(), at_s(1.5));
  EXPECT_TRUE(host.tick(1.4).replies.empty());
  const auto late = host.tick(1.5);
  ASSERT_EQ(late.replies.size(), 1u);
  EXPECT_EQ(test::error_code_of(test::reply_from(late.replies[0])), 18);
  EXPECT_TRUE(host.ready(1.6).prefixes.empty());
}

TEST(BlueViewDialogue, SubscriptionsMakePingsWithoutRequests) {
  auto device = test::device();
  Host host(device);
  host.say(test::hello());
  host.say(test::two_numbers(FrameType::subscribe, 4, 0, 200), 1);
  EXPECT_EQ(pings_requested(host.tick(1)), 1);
  const auto delivery = host.ready(1.05);
  ASSERT_EQ(delivery.prefixes.size(), 1u);
  EXPECT_EQ(id_of(delivery.prefixes[0]), 0u);
  EXPECT_EQ(pings_requested(host.tick(1.1)), 0);
  EXPECT_EQ(pings_requested(host.tick(1.2)), 1);
  host.say(test::two_numbers(FrameType::subscribe, 5, 0, 0), 1.3);
  EXPECT_EQ(pings_requested(host.tick(1.5)), 0);
}

TEST(BlueViewDialogue, KeepAliveIsSentInSilence) {
  auto device = test::device();
  Host host(device);
  host.say(test::hello());
  const auto filled = host.tick(2);
  ASSERT_EQ(filled.replies.size(), 1u);
  EXPECT_EQ(test::reply_from(filled.replies[0]).header.type, FrameType::keep_alive);
  EXPECT_FALSE(closes(host.tick(1000))) << "simulated time does not end the connection of a silent host";
  EXPECT_EQ(blueview::make_dialogue(device, test::at_s(0))->longest_silence(), std::chrono::seconds(10));
}

TEST(BlueViewDialogue, GarbageGetsAtMostOneReply) {
  for (std::uint32_t seed = 1; seed < 200; ++seed) {
    auto device = test::device();
    Host host(device);
    host.say(test::hello());
    wire::Bytes junk = test::set(1, 0, Key::range, FloatPair{1, 2});
    std::uint32_t x = seed;
    for (int flips = 0; flips < 4; ++flips) {
      x = x * 1664525u + 1013904223u;
      junk[(x >> 8) % junk.size()] ^= static_cast<std::byte>(x >> 24);
    }
    const Reaction r = host.say(junk);
    EXPECT_LE(r.replies.size(), 1u);
  }
}

TEST(BlueViewHost, ARefusalIsAnErrorOfUsage) {
  const auto host = *make_host({});
  host->on_open({}, at_s(0));
  const auto actions = host->on_bytes(0, make_error(1, Code::bad_parameter, "no such head"), at_s(0.1));
  ASSERT_EQ(actions.size(), 1u);
  const auto* refusal = std::get_if<Error>(&actions[0]);
  ASSERT_NE(refusal, nullptr);
  EXPECT_EQ(refusal->kind, ErrorKind::usage);
  EXPECT_EQ(refusal->text.find("a BlueView sonar refuses a request: no such head"), 0u) << refusal->text;
}

TEST(BlueViewHost, ATimeOutIsNoRefusal) {
  const auto host = *make_host({});
  host->on_open({}, at_s(0));
  const auto actions = host->on_bytes(0, make_error(1, Code::timeout, "no ping in the time given"), at_s(0.1));
  ASSERT_EQ(actions.size(), 1u);
  const auto* late = std::get_if<Error>(&actions[0]);
  ASSERT_NE(late, nullptr);
  EXPECT_EQ(late->kind, ErrorKind::unavailable);
  EXPECT_EQ(late->text.find("sends no ping: no ping in the time given"), 0u) << late->text;
}

TEST(BlueViewDialogue, NoMoreThanEightTriggersWait) {
  auto device = test::device();
  Host host(device);
  host.say(test::hello());
  for (std::uint32_t id = 1; id <= 8; ++id) EXPECT_TRUE(host.say(test::ping(id)).replies.empty());
  EXPECT_EQ(test::error_code_of(test::reply_from(host.say(test::ping(9)).replies.at(0))), 6);
}

}  // namespace
}  // namespace sonar::blueview
