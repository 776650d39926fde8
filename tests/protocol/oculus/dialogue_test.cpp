// Tests one client's conversation: the messages of public clients in any pieces, with other bytes between them, and the replies.
#include "core/base/random.hpp"
#include "tests/protocol/oculus/oculus_testing.hpp"

namespace sonar::oculus::tests {
namespace {

using protocol::ChangeSettings;
using protocol::Notice;
using protocol::Reaction;
using protocol::RequestPing;
using protocol::StoreAddress;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct Conversation {
  protocol::DeviceState state;
  std::unique_ptr<protocol::Dialogue> dialogue;
  Conversation() : Conversation(protocol::OptionValues{}) {}
  Conversation(const char* option, const char* value) : Conversation(protocol::OptionValues{{option, value}}) {}
  explicit Conversation(const protocol::OptionValues& options)
      : state(device("oculus-m1200d", options)), dialogue(protocol::vendors().front()->converse({}, state, at(0))) {}
  Reaction say(BytesView bytes, double when_s = 0) { return dialogue->on_bytes(Exact(bytes).view(), at(when_s)); }
};

// Defaults of the public clients (docs/protocols/oculus.md names them): the message of each, and the settings that it must give.
struct Client {
  const char* name;
  int version;
  bool payload_zero;
  int mode;
  PingRate rate;
  int flags;
  double range, gain, sound_speed;
  int gamma, network;
  std::uint32_t ext;
  // expected
  double range_m, rate_hz;
  int beams, bits;
  bool gains;
};
const Client clients[] = {
    {"ENS", 0, false, 2, PingRate::hz10, 0x0D, 2.54, 50, 0, 127, 255, 0, 2.54, 10, 256, 8, true},
    {"BLU", 2, false, 2, PingRate::hz10, 0x1D, 2.54, 50, 0, 127, 255, 0, 2.54, 10, 256, 8, true},
    {"APL 8", 2, false, 2, PingRate::hz10, 0x4D, 4, 50, 0, 127, 255, 0, 4, 10, 512, 8, true},
    {"APL 16", 2, false, 2, PingRate::hz10, 0x4F, 4, 50, 0, 127, 255, 0, 4, 10, 512, 16, true},
    {"APL 32", 2, false, 2, PingRate::hz10, 0x4F, 4, 50, 0, 127, 255, 0x200, 4, 10, 512, 32, true},
    {"VND", 0, true, 1, PingRate::hz15, 0x49, 10, 50, 0, 127, 255, 0, 10, 15, 512, 8, false},
    {"VND gain assist", 0, true, 1, PingRate::hz15, 0x59, 10, 50, 0, 127, 255, 0, 10, 15, 512, 8, false},
    {"BAS", 0, true, 2, PingRate::hz40, 0x49, 5, 80, 0, 255, 255, 0, 5, 40, 512, 8, false},
    {"MRG", 0, true, 1, PingRate::hz10, 0x49, 10, 20, 1500, 127, 0, 0, 10, 10, 512, 8, false},
    {"TID", 0, true, 1, PingRate::hz10, 0x49, 120, 100, 1500, 1, 255, 0, 40, 10, 512, 8, false},
    {"ALD", 0, true, 1, PingRate::hz10, 0x19, 1, 0, 0, 150, 255, 0, 1, 10, 256, 8, false},
    {"BRG 1", 1, false, 2, PingRate::hz15, 0x00, 20, 50, 1500, 127, 0, 0, 2, 15, 256, 8, false},
    {"BRG 2", 2, false, 2, PingRate::hz15, 0x00, 20, 50, 1500, 127, 0, 0, 2, 15, 256, 8, false},
};

FireRequest request_of(const Client& c) {
  FireRequest request = fire(c.version, c.mode, c.rate, c.flags, c.range, c.gain);
  request.settings.sound_speed_mps = c.sound_speed;
  request.settings.gamma = static_cast<std::uint8_t>(c.gamma);
  request.settings.network_speed = static_cast<std::uint8_t>(c.network);
  request.extension.flags = c.ext;
  return request;
}

TEST(Dialogue, UnderstandsEveryPublicClient) {
  for (const Client& c : clients) {
    Conversation talk;
    const Bytes message = make_fire(request_of(c), 0, c.payload_zero);
    EXPECT_EQ(message.size(), c.version == 2 ? 89u : 53u);
    const auto changes = events_of<ChangeSettings>(talk.say(message));
    ASSERT_THAT(changes, SizeIs(1)) << c.name;
    const PingSettings& s = changes[0].settings;
    EXPECT_EQ(s.mode, c.mode - 1) << c.name;
    EXPECT_NEAR(s.range_m, c.range_m, 1e-5) << c.name;
    EXPECT_EQ(s.rate_hz, c.rate_hz) << c.name;
    EXPECT_EQ(s.beam_count, c.beams) << c.name;
    EXPECT_EQ(s.format.bits, c.bits) << c.name;
    EXPECT_EQ(s.format.row_gains, c.gains) << c.name;
    EXPECT_FALSE(changes[0].summary.empty()) << c.name;
  }
}

// Uses all steps: fire message, dialogue, made-up ping, frame, our decoder. The drivers' comparison with the first ping must
// succeed.
TEST(Dialogue, EchoSatisfiesEveryPublicClient) {
  for (const Client& c : clients) {
    Conversation talk;
    const FireRequest request = request_of(c);
    const auto changes = events_of<ChangeSettings>(talk.say(make_fire(request, 0, c.payload_zero)));
    ASSERT_THAT(changes, SizeIs(1)) << c.name;
    Ping ping = made_up_ping(talk.state, changes[0].settings);
    ping.request.vendor_settings = changes[0].vendor_settings;
    const auto bytes = protocol::vendors().front()->frame(ping, talk.state);
    const auto decoded = decode_ping(*bytes);
    ASSERT_TRUE(decoded.has_value()) << c.name;
    EXPECT_THAT(decoded->violations, IsEmpty()) << c.name;
    EXPECT_THAT(echo_violations(request, *decoded), IsEmpty()) << c.name;
    EXPECT_EQ(decoded->head.fixed.header.version, c.version) << c.name;
  }
}

TEST(Dialogue, ARepeatedMessageGivesEqualSettings) {
  Conversation talk;
  const Bytes message = make_fire(fire(0, 1, PingRate::hz10, 0x49, 5, 50), 0, true);
  const auto first = events_of<ChangeSettings>(talk.say(message)), again = events_of<ChangeSettings>(talk.say(message));
  ASSERT_THAT(first, SizeIs(1));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_TRUE(first[0].vendor_settings->equals(*again[0].vendor_settings))
      << "the daemon recognises a repeated message by equal settings";
  EXPECT_EQ(first[0].summary, again[0].summary);
}

TEST(Dialogue, WithNetworkTriggerEachMessageRequestsOnePing) {
  Conversation talk;
  const Bytes message = make_fire(fire(0, 1, PingRate::hz10, 0xC9, 5, 50));
  const auto reaction = talk.say(joined({message, message, message}));
  EXPECT_THAT(events_of<RequestPing>(reaction), SizeIs(3));
  const auto changes = events_of<ChangeSettings>(reaction);
  ASSERT_THAT(changes, SizeIs(3));
  EXPECT_TRUE(changes[0].settings.triggered);
  EXPECT_TRUE(std::holds_alternative<ChangeSettings>(reaction.events[0])) << "settings first, then the ping made with them";
  EXPECT_TRUE(std::holds_alternative<RequestPing>(reaction.events[1]));
  const Bytes standby = make_fire(fire(0, 1, PingRate::standby, 0xC9, 5, 50));
  EXPECT_THAT(events_of<RequestPing>(talk.say(standby)), IsEmpty());
}

TEST(Dialogue, StandbyIsAcknowledgedWithADummy) {
  Conversation talk;
  const Bytes standby = make_fire(fire(0, 1, PingRate::standby, 0x49, 5, 50));
  const auto reaction = talk.say(standby, 0.5);
  EXPECT_EQ(events_of<ChangeSettings>(reaction).at(0).settings.rate_hz, 0);
  ASSERT_THAT(reaction.replies, SizeIs(1));
  EXPECT_TRUE(std::holds_alternative<DummyMessage>(decode_message(reaction.replies[0])));
  EXPECT_EQ(talk.dialogue->next_tick(), at(1.5));
  EXPECT_THAT(talk.say(standby, 0.6).replies, IsEmpty()) << "a repeated request for standby gets no dummy";
}

TEST(Dialogue, DummiesOnlyFillSilence) {
  Conversation talk;
  EXPECT_EQ(talk.dialogue->next_tick(), at(1));
  EXPECT_THAT(talk.dialogue->on_tick(at(0.5), false).replies, IsEmpty());
  EXPECT_THAT(talk.dialogue->on_tick(at(1), false).replies, SizeIs(1));
  EXPECT_EQ(talk.dialogue->next_tick(), at(2));
  talk.dialogue->on_ping_queued(at(1.9));
  EXPECT_THAT(talk.dialogue->on_tick(at(2), false).replies, IsEmpty());
  EXPECT_EQ(talk.dialogue->next_tick(), at(2.9));
}

struct Asking : Conversation {
  /// Sends a fire message and applies the changes, as the device does.
  std::size_t fire_at(double when_s, PingRate rate, int flags = 0x49) {
    const auto reaction = say(make_fire(fire(0, 1, rate, flags, 5, 50)), when_s);
    for (const auto& change : events_of<ChangeSettings>(reaction)) state.settings = change.vendor_settings;
    return reaction.replies.size();
  }
  /// Calls on_tick() in virtual time and counts the dummies.
  std::size_t dummies(double from_s, double to_s) {
    std::size_t count = 0;
    for (double s = from_s; s < to_s; s += 0.1) count += dialogue->on_tick(at(s), false).replies.size();
    return count;
  }
};

// ENS stores standby as its rate when a dummy arrives, and requests it when it connects again.
TEST(Dialogue, NoDummyComesWhilePingsAreRequested) {
  Asking talk;
  EXPECT_EQ(talk.dummies(0, 3.05), 3u) << "dummies come before the first fire message";
  EXPECT_EQ(talk.fire_at(3.5, PingRate::hz10), 0u);
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max());
  EXPECT_EQ(talk.dummies(3.5, 60), 0u) << "the first ping takes a minute";
  talk.dialogue->on_ping_queued(at(60));
  EXPECT_EQ(talk.fire_at(60.1, PingRate::hz40), 0u) << "no dummy comes after a fire message with another rate";
  EXPECT_EQ(talk.dummies(60.1, 90), 0u);
  EXPECT_EQ(talk.fire_at(90, PingRate::standby), 1u);
  EXPECT_EQ(talk.dummies(90, 93.05), 3u);
  EXPECT_EQ(talk.fire_at(93.1, PingRate::hz2), 0u);
  EXPECT_EQ(talk.dummies(93.1, 120), 0u);
  talk.state.settings.reset();  // as after another client has left: the sonar has its initial settings
  EXPECT_GE(talk.dummies(120, 121.05), 1u);
}

TEST(Dialogue, WithNetworkTriggerDummiesAreSentBetweenRequests) {
  Asking talk;
  EXPECT_EQ(talk.fire_at(0.5, PingRate::hz10, 0xC9), 0u);
  EXPECT_EQ(talk.dummies(0.5, 20), 0u) << "the ping is being computed";
  talk.dialogue->on_ping_queued(at(20));
  EXPECT_EQ(talk.dummies(20, 23.05), 3u);
  EXPECT_EQ(talk.fire_at(23.1, PingRate::hz10, 0xC9), 0u);
  EXPECT_EQ(talk.dummies(23.1, 40), 0u);
}

TEST(Dialogue, DummyPeriodIsAnOption) {
  EXPECT_EQ(Conversation("dummy_period_ms", "250").dialogue->next_tick(), at(0.25));
  EXPECT_EQ(Conversation("dummy_period_ms", "10").dialogue->next_tick(), at(0.01)) << "the shortest period";
}

TEST(Dialogue, NotANumberIsIgnoredWithANotice) {
  Conversation talk;
  FireRequest bad = fire(0, 1, PingRate::hz10, 0x49, 5, 50);
  bad.settings.gain_percent = std::nan("");
  const auto reaction = talk.say(make_fire(bad));
  EXPECT_THAT(events_of<ChangeSettings>(reaction), IsEmpty());
  ASSERT_THAT(events_of<Notice>(reaction), SizeIs(1));
  EXPECT_THAT(events_of<Notice>(reaction)[0].text, HasSubstr("not a finite number"));
}

TEST(Dialogue, OutOfRangeMayBeIgnored) {
  const Bytes far = make_fire(fire(0, 2, PingRate::hz10, 0x49, 20, 50));
  EXPECT_THAT(events_of<ChangeSettings>(Conversation().say(far)), SizeIs(1));
  const auto reaction = Conversation("out_of_range", "ignore").say(far);
  EXPECT_THAT(events_of<ChangeSettings>(reaction), IsEmpty());
  EXPECT_THAT(events_of<Notice>(reaction), SizeIs(1));
}

TEST(Dialogue, SummaryHasTheRequestedSettings) {
  const auto summary = [](FireRequest request, double sound_speed_mps, std::uint32_t extended) {
    request.settings.gamma = 127;
    request.settings.sound_speed_mps = sound_speed_mps;
    request.extension.flags = extended;
    return events_of<ChangeSettings>(Conversation().say(make_fire(request))).at(0).summary;
  };
  EXPECT_EQ(
      summary(fire(0, 2, PingRate::hz10, 0x49, 5, 50), 0, 0),
      "mode 2, range 5 m, gain 50 %, gamma 127, rate 10 Hz, sound speed of the device, 512 beams, 8 bits, flags 73, version 0");
  EXPECT_THAT(summary(fire(0, 1, PingRate::standby, 0x4B, 5, 50), 1480, 0),
              HasSubstr("gamma 127, standby, sound speed 1480 m/s, 512 beams, 16 bits"));
  EXPECT_THAT(summary(fire(2, 1, PingRate::hz10, 0x0D, 5, 50), 0, 0x200), HasSubstr("256 beams, 32 bits"));
}

TEST(Dialogue, ShortAndForeignMessagesCauseNotices) {
  Conversation talk;
  Bytes shorty = make_fire(fire(0, 1, PingRate::hz10, 0x49, 5, 50));
  overwrite(shorty, 10, hex("0A 00 00 00"));
  shorty.resize(26);
  const auto reaction = talk.say(joined({shorty, hex("53 4F 00 00 00 00 77 00 00 00 00 00 00 00 00 00")}));
  const auto notices = events_of<Notice>(reaction);
  ASSERT_THAT(notices, SizeIs(2));
  EXPECT_EQ(notices[0].text, "ignored a fire message of 26 bytes, 53 are needed");
  EXPECT_EQ(notices[1].text, "ignored a message of unexpected type 0x0077 (16 bytes)");
  EXPECT_THAT(talk.say(hex("53 4F 00 00 00 00 FF 00 00 00 00 00 00 00 00 00")).events, IsEmpty()) << "a dummy causes no event";
}

// VND requests the configuration with payload size 0 and reads the first 28 bytes that it gets.
TEST(Dialogue, UserConfigIsReadAndWritten) {
  Conversation talk;
  const Bytes read = hex("53 4F 00 00 00 00 55 00 00 00 00 00 00 00 00 00  00 00 00 00 00 00 00 00 00 00 00 00");
  const Bytes write = hex("53 4F 00 00 00 00 55 00 00 00 00 00 00 00 00 00  07 01 A8 C0 00 00 FF FF 01 00 00 00");
  auto reaction = talk.say(read, 0.9);
  ASSERT_THAT(reaction.replies, SizeIs(1));
  EXPECT_EQ(reaction.replies[0], hex("53 4F 59 1B 00 00 55 00 00 00 0C 00 00 00 00 00  02 01 A8 C0 00 FF FF FF 00 00 00 00"))
      << "the reply has the advertised address";
  EXPECT_EQ(talk.dialogue->next_tick(), at(1.9)) << "the next dummy comes a period after the reply";
  reaction = talk.say(joined({write, read}));
  ASSERT_THAT(events_of<StoreAddress>(reaction), SizeIs(1));
  EXPECT_EQ(events_of<StoreAddress>(reaction)[0].address.ip, 0xC0A80107u);
  EXPECT_EQ(events_of<StoreAddress>(reaction)[0].address.netmask, 0xFFFF0000u);
  EXPECT_TRUE(events_of<StoreAddress>(reaction)[0].address.dhcp);
  ASSERT_THAT(reaction.replies, SizeIs(1)) << "the write is not answered; the read returns the written values";
  EXPECT_EQ(Bytes(reaction.replies[0].begin() + 16, reaction.replies[0].end()), hex("07 01 A8 C0 00 00 FF FF 01 00 00 00"));
  talk.state.stored_address = events_of<StoreAddress>(reaction)[0].address;
  EXPECT_EQ(talk.say(read).replies.at(0), reaction.replies[0]);
  EXPECT_THAT(Conversation("user_config_write", "reply").say(write).replies, SizeIs(1));
}

TEST(Dialogue, BootTextIsSentAtOnceIfConfigured) {
  Conversation talk("boot_text", "on");
  EXPECT_EQ(talk.dialogue->next_tick(), at(0));
  const auto reaction = talk.dialogue->on_tick(at(0), false);
  ASSERT_THAT(reaction.replies, SizeIs(1));
  const auto received = decode_message(reaction.replies[0]);
  ASSERT_TRUE(std::holds_alternative<LogText>(received));
  EXPECT_THAT(std::get<LogText>(received).text, HasSubstr("M1200d"));
  EXPECT_EQ(talk.dialogue->next_tick(), at(1));
}

bool sends_boot_text_at(Conversation& talk, double when_s) {
  for (const Bytes& reply : talk.dialogue->on_tick(at(when_s), false).replies)
    if (std::holds_alternative<LogText>(decode_message(reply))) return true;
  return false;
}

// A client may wait for the text before it fires; clients that do not wait must never receive it.
TEST(Dialogue, BootTextIsSentOnceToASilentClient) {
  Conversation waits;
  EXPECT_FALSE(sends_boot_text_at(waits, 1)) << "the first message is a dummy";
  EXPECT_EQ(waits.dialogue->next_tick(), at(2));
  EXPECT_TRUE(sends_boot_text_at(waits, 2));
  EXPECT_FALSE(sends_boot_text_at(waits, 3)) << "the text is sent once";

  Conversation fires;
  EXPECT_FALSE(sends_boot_text_at(fires, 1));
  fires.say(make_fire(fire(0, 1, PingRate::standby, 0x49, 5, 50)), 1.2);
  Conversation observes;
  observes.dialogue->on_ping_queued(at(1.5));
  Conversation is_off("boot_text", "off");
  for (Conversation* talk : {&fires, &observes, &is_off})
    for (int second = 2; second < 9; ++second) EXPECT_FALSE(sends_boot_text_at(*talk, second));
}

TEST(Dialogue, FirstPingsAreAnOption) {
  const auto& vendor = *protocol::vendors().front();
  EXPECT_FALSE(vendor.pings_before_first_request(device()));
  const auto state = device("oculus-m1200d", {{"before_first_fire", "pings"}});
  EXPECT_TRUE(vendor.pings_before_first_request(state));
  const auto initial = vendor.initial_settings(state);
  Ping made = made_up_ping(state, initial.settings);
  made.request.vendor_settings = initial.vendor_settings;
  const auto ping = decode_ping(*vendor.frame(made, state));
  ASSERT_TRUE(ping.has_value());
  EXPECT_THAT(ping->violations, IsEmpty());
  EXPECT_EQ(ping->head.fixed.header.version, 0) << "all clients can read version 0";
}

TEST(Dialogue, EverySplitGivesTheSameSettings) {
  const Bytes stream = joined({make_fire(fire(0, 1, PingRate::hz10, 0x49, 5, 50), 0, true), hex("30 30"),
                               make_fire(fire(2, 2, PingRate::hz40, 0xC9, 5, 50))});
  for (std::size_t i = 0; i <= stream.size(); ++i) {
    Conversation talk;
    std::vector<ChangeSettings> changes;
    for (const BytesView part : {BytesView(stream).first(i), BytesView(stream).subspan(i)})
      for (auto& change : events_of<ChangeSettings>(talk.say(part))) changes.push_back(change);
    ASSERT_THAT(changes, SizeIs(2)) << "split at " << i;
    EXPECT_EQ(changes[1].settings.rate_hz, 40);
  }
}

TEST(Dialogue, TruncatedMessagesWait) {
  const Bytes whole = make_fire(fire(2, 1, PingRate::hz10, 0x49, 5, 50));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    Conversation talk;
    const auto reaction = talk.say(BytesView(whole).first(length));
    EXPECT_THAT(reaction.events, IsEmpty()) << length;
    EXPECT_THAT(reaction.replies, IsEmpty()) << length;
  }
}

TEST(Dialogue, EveryFlippedByteIsSurvived) {
  const Bytes whole = make_fire(fire(2, 2, PingRate::hz10, 0x49, 5, 50));
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const unsigned flip : {0x01u, 0x80u, 0xFFu}) {
      Conversation talk;
      Bytes flipped = whole;
      flipped[i] ^= static_cast<std::byte>(flip);
      talk.say(flipped);
      bool accepted = false;  // a damaged length may skip up to the largest accepted payload
      for (int tries = 0; tries < 60 && !accepted; ++tries) accepted = !events_of<ChangeSettings>(talk.say(whole)).empty();
      EXPECT_TRUE(accepted) << "byte " << i << " flip " << flip;
    }
  }
}

TEST(Dialogue, JunkGivesFewNoticesAndNoReplies) {
  Conversation talk;
  for (std::uint32_t round = 0; round < 50; ++round) {
    Bytes junk(4096);
    for (std::size_t i = 0; i < junk.size(); ++i)
      junk[i] = static_cast<std::byte>(philox(round, static_cast<std::uint32_t>(i), 0, 0, 3, 0).v[0] & 0xFF);
    const auto reaction = talk.say(junk);
    EXPECT_LE(reaction.events.size(), 9u);
    EXPECT_THAT(reaction.replies, IsEmpty());
  }
  Bytes strangers;
  for (int i = 0; i < 1000; ++i) strangers = joined({strangers, hex("53 4F 00 00 00 00 77 00 00 00 00 00 00 00 00 00")});
  EXPECT_LE(talk.say(strangers).events.size(), 9u);
}

}  // namespace
}  // namespace sonar::oculus::tests
