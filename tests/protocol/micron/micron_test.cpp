// Tests a driver's conversation with an emulated Micron, without a socket: frames, alive messages, scans, ignored messages, and
// how the host handles foreign bytes.
#include <gmock/gmock.h>

#include "core/base/geometry.hpp"
#include "protocol/micron/micron.hpp"
#include "tests/protocol/micron/micron_testing.hpp"

namespace sonar::micron {
namespace {

using namespace tests;
using testing::ElementsAre;

Bytes hex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += text[i] == ' ' ? 1 : 2)
    if (text[i] != ' ') bytes.push_back(static_cast<std::byte>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
  return bytes;
}
/// Requests `lines` scan lines, each after the previous one has arrived; returns their bearings.
std::vector<int> scanned(Talk& talk, int lines) {
  std::vector<int> all;
  for (int i = 0; i < lines; ++i) {
    talk.say(request(), talk.last_ping_s);
    talk.run_to(talk.last_ping_s + 0.9);
    for (const int bearing : talk.bearings()) all.push_back(bearing);
  }
  return all;
}

TEST(Micron, FramesAreThoseOfPublicDrivers) {
  EXPECT_EQ(from_host(Id::reboot, {}), hex("40 30 30 30 38 08 00 ff 02 03 10 80 02 0a"));
  EXPECT_EQ(from_host(Id::send_version, {}), hex("40 30 30 30 38 08 00 ff 02 03 17 80 02 0a"));
  EXPECT_EQ(from_host(Id::send_data, hex("ca 64 b0 03")), hex("40 30 30 30 43 0c 00 ff 02 07 19 80 02 ca 64 b0 03 0a"));
  EXPECT_EQ(command({}).size(), 66u);
  const auto front = hex("40 30 30 33 43 3c 00 ff 02 37 13 80 02 01");
  EXPECT_TRUE(std::equal(front.begin(), front.end(), command({}).begin()));
}

TEST(Micron, RepliesHaveTheirSizes) {
  Talk talk;
  Bytes both = from_host(Id::send_version, {});
  const Bytes user = from_host(Id::send_user, {});
  both.insert(both.end(), user.begin(), user.end());
  for (const std::byte b : both) talk.say({b});
  const auto replies = talk.take();
  ASSERT_EQ(replies.size(), 4u);
  EXPECT_EQ(replies[0], hex("40 30 30 31 33 13 00 02 ff 0e 01 80 02 01 00 59 1b 00 00 00 00 00 00 02 0a"));
  EXPECT_EQ(replies[1].size(), 264u);
  EXPECT_EQ(replies[2].size(), 80u);
  EXPECT_EQ(replies[3].size(), 28u);
}

TEST(Micron, AliveMessagesHaveTheStateOfTheHead) {
  Talk talk;
  talk.run_to(2.5);
  EXPECT_THAT(talk.head_infos(), ElementsAre(0x4A, 0x4A));
  talk.say(from_host(Id::reboot, {}), 2.5);
  talk.run_to(4.4);
  EXPECT_TRUE(talk.take().empty());
  talk.say(from_host(Id::send_version, {}), 4.4);
  EXPECT_TRUE(talk.take().empty()) << "a head that is starting does not answer";
  talk.run_to(6.6);
  EXPECT_THAT(talk.head_infos(), ElementsAre(0x5D, 0x4D, 0x4A));
  HeadCommand left = sector();
  left.control &= static_cast<std::uint16_t>(~control::to_right);
  talk.say(command(left), 6.6);
  talk.run_to(8.6);
  EXPECT_THAT(talk.head_infos(), ElementsAre(0xCA, 0x8A));
  talk.say(from_host(Id::stop_alives, {}), 8.6);
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max());
}

TEST(Micron, AliveMessagesPauseWhileALineIsRequested) {
  Talk talk;
  HeadCommand c = sector();
  c.left = 6384;
  c.right = 32;
  talk.say(command(c));
  talk.say(request());
  talk.run_to(1.7);
  EXPECT_THAT(talk.bearings(), ElementsAre(6384)) << "half a turn takes 1.6 s";
  EXPECT_EQ(talk.dialogue->next_tick(), at_s(talk.last_ping_s + 1));
  talk.say(request(), 1.8);
  talk.say(from_host(Id::stop_alives, {}), 1.8);
  talk.run_to(1.9);
  EXPECT_EQ(talk.take().size(), 1u);
  EXPECT_EQ(talk.dialogue->next_tick(), Time::max()) << "the line that was requested before starts no alive messages";
  talk.say(request(), 2);
  talk.run_to(3.5);
  EXPECT_EQ(talk.take().size(), 2u) << "a line and an alive message";
}

TEST(Micron, AliveMessagesHaveTheTimeOfThePings) {
  Talk talk;
  talk.run_to(1);
  const auto before = read_front<Alive>(read_frame(talk.take().at(0))->payload);
  talk.state.skipped = std::chrono::seconds(5);
  talk.run_to(2);
  const auto after = read_front<Alive>(read_frame(talk.take().at(0))->payload);
  EXPECT_EQ(after->time_ms, before->time_ms + 6000) << "stepped time has jumped by 5 s";
}

TEST(Micron, ALineComesForEachRequest) {
  Talk talk;
  talk.say(request());
  EXPECT_EQ(talk.notices, 1) << "a request without parameters is reported";
  talk.say(command(sector()));
  EXPECT_FALSE(talk.dialogue->next_ping_request()) << "no line is requested";
  talk.say(request());
  EXPECT_EQ(talk.dialogue->next_ping_request(), std::optional(at_s(0)));
  talk.run_to(0.9);
  EXPECT_EQ(talk.pings, 1);
  const auto replies = talk.take();
  ASSERT_EQ(replies.size(), 1u);
  const auto message = read_frame(replies.front());
  ASSERT_TRUE(message);
  EXPECT_EQ(message->header.count, 0);
  EXPECT_EQ(message->header.source, 2);
  EXPECT_EQ(message->header.destination, 255);
  const auto data = *read_front<HeadData>(message->payload);
  EXPECT_EQ(replies.front().size(), data.size + 45u);
  EXPECT_EQ(replies.front().size(), data.total + 14u);
  EXPECT_EQ(data.device_type, 0x11);
  EXPECT_EQ(data.control, 0x2305);
  EXPECT_EQ(data.bearing, 3200);
  EXPECT_EQ(data.size, 200);
  EXPECT_EQ(replies.front()[13 + 31 + 77], std::byte{77});
  Talk twice("lines_per_request", "2");
  twice.say(command(sector()));
  twice.say(request());
  twice.run_to(0.9);
  EXPECT_THAT(twice.bearings(), ElementsAre(3200, 3216));
}

TEST(Micron, ASectorIsScannedBackAndForth) {
  Talk talk;
  HeadCommand c = sector();
  c.left = 3168;
  c.right = 3232;
  talk.say(command(c));
  EXPECT_THAT(scanned(talk, 8), ElementsAre(3200, 3216, 3232, 3216, 3200, 3184, 3168, 3184));
  EXPECT_NEAR(talk.aim.head_rad, 16 * 2 * pi / 6400, 1e-9) << "left of ahead is to port";
  talk.say(from_host(Id::head_command, hex("0f")), talk.last_ping_s);
  EXPECT_THAT(scanned(talk, 2), ElementsAre(3200, 3184)) << "the head was turning towards the first line";
  c.left = 6384;  // the sector crosses 0 and is far from the head's position
  c.right = 32;
  talk.say(command(c), talk.last_ping_s);
  talk.last_ping_s += 2;  // half a turn takes 1.6 s
  EXPECT_THAT(scanned(talk, 5), ElementsAre(6384, 0, 16, 32, 16));
  EXPECT_EQ(sweep_code(c, 6384), 1);
  EXPECT_EQ(sweep_code(c, 0), 0);
  EXPECT_EQ(sweep_code(c, 32), 2);
}

TEST(Micron, AFullTurnContinues) {
  Talk talk;
  HeadCommand c = sector();
  c.control |= control::continuous;
  c.step = 255;
  talk.say(command(c));
  const auto seen = scanned(talk, 30);
  for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_EQ((seen[i] - seen[i - 1] + 6400) % 6400, 255);
  c.control &= static_cast<std::uint16_t>(~control::to_right);
  talk.say(command(c), talk.last_ping_s);
  const auto back = scanned(talk, 3);
  EXPECT_EQ((back[1] - back[2] + 6400) % 6400, 255);
}

TEST(Micron, AnInvertedHeadTurnsTheOtherWay) {
  Settings s;
  s.bearing = 4800;
  EXPECT_NEAR(head_rad(s), -pi / 2, 1e-12) << "to starboard";
  s.command.control |= control::inverted;
  EXPECT_NEAR(head_rad(s), pi / 2, 1e-12);
}

TEST(Micron, TheHeadAndTheLinkTakeTime) {
  Talk talk("link_rate", "115200");
  HeadCommand c = sector();
  c.step = 32;
  talk.say(command(c));
  talk.say(request());
  talk.run_to(0.5);
  const double first = talk.last_ping_s;
  talk.say(request(), first);
  talk.run_to(0.9);
  const double bins_s = 200 * 20 * 640e-9, link_s = 245 * 10 / 115200.0, turn_s = 32 * 0.0005;
  EXPECT_NEAR(talk.last_ping_s - first, bins_s + link_s + turn_s, 1e-6);
}

TEST(Micron, FourBitBinsCoverAWindowAndAreTwoPerByte) {
  HeadCommand c = sector();
  c.control &= static_cast<std::uint16_t>(~control::eight_bits);
  c.ad_low = 51;
  c.ad_span = 102;
  c.bins = 5;
  for (const auto& [half, last] : {std::pair("high", "34 40"), std::pair("low", "43 04")}) {
    Talk talk("first_4bit_bin", half);
    talk.say(command(c));
    talk.say(request());
    talk.run_to(0.9);
    const auto replies = talk.take();
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_EQ(read_front<HeadData>(read_frame(replies[0])->payload)->size, 3);
    const Bytes expected = hex(half == std::string("high") ? "01 23 40" : "10 32 04");
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), replies[0].end() - 4)) << last;
    const PingSettings s = ping_settings(settings_from(talk.state.settings.get()), talk.state);
    EXPECT_EQ(s.format.max_code, 15u);
    EXPECT_FLOAT_EQ(s.format.floor_db, 16);
    EXPECT_FLOAT_EQ(s.format.ceiling_db, 48);
  }
  EXPECT_EQ(unpacked(hex("12 30")), hex("01 02 03 00"));
}

TEST(Micron, InvalidMessagesAreIgnored) {
  const auto with = [](auto change) {
    HeadCommand c = sector();
    change(c);
    return command(c);
  };
  for (const Bytes& wrong :
       {with([](HeadCommand& c) { c.bins = 0; }), with([](HeadCommand& c) { c.bins = 1501; }),
        with([](HeadCommand& c) { c.interval = 0; }), with([](HeadCommand& c) { c.interval = 65535; }),
        with([](HeadCommand& c) { c.step = 0; }), with([](HeadCommand& c) { c.left = 6400; }),
        with([](HeadCommand& c) { c.gain = 211; }), with([](HeadCommand& c) { c.kind = 7; }),
        with([](HeadCommand& c) { c.control = c.ad_span = 0; }), from_host(Id::head_command, Bytes(51)), from_host(Id(99), {}),
        hex("40 30 30 30 38 08 00 ff 02 03 10 80 02 0b"), Bytes(500, std::byte{'@'})}) {
    Talk talk;
    talk.say(wrong);
    EXPECT_GT(talk.notices, 0);
    EXPECT_TRUE(talk.take().empty());
    EXPECT_FALSE(settings_from(talk.state.settings.get()).has_parameters);
    talk.say(from_host(Id::send_version, {}));
    EXPECT_EQ(talk.take().size(), 1u) << "a valid message after it is answered";
  }
}

TEST(Micron, APingOfEarlierParametersIsNotSent) {
  Talk talk;
  talk.say(command(sector()));
  talk.say(request());
  talk.apply(talk.dialogue->on_tick(at_s(0), false));
  ASSERT_EQ(talk.pings, 1);
  const auto before = talk.aim.with;
  talk.say(command(sector()));
  EXPECT_TRUE(talk.dialogue->on_ping(before.get(), 0, at_s(0.1)).prefixes.empty());
  talk.say(request(), 0.1);
  talk.apply(talk.dialogue->on_tick(at_s(0.1), false));
  EXPECT_EQ(talk.pings, 2);
}

TEST(Micron, AnOverrideEqualsTheSettingsOfAHost) {
  const protocol::DeviceState state = device();
  const auto changed =
      vendor().apply_override({.range_m = 25, .rate_hz = {}, .gain_percent = 100, .mode = {}, .beams = {}}, state);
  ASSERT_TRUE(changed);
  EXPECT_NEAR(changed->settings.range_m, 25, 0.2);
  EXPECT_EQ(settings_from(changed->vendor_settings.get()).command.gain, 210);
  EXPECT_FALSE(vendor().apply_override({.range_m = 201, .rate_hz = {}, .gain_percent = {}, .mode = {}, .beams = {}}, state));
  EXPECT_FALSE(vendor().apply_override({.range_m = {}, .rate_hz = 5, .gain_percent = {}, .mode = {}, .beams = {}}, state));
}

TEST(MicronHost, SendsParametersAgainToAHeadThatHasRestarted) {
  const auto host = *make_host({});
  EXPECT_TRUE(host->on_open({}, at_s(0)).empty())
      << "the host waits for the parameters of the head, which it restores at the end";
  Talk talk;
  talk.run_to(1);
  const Bytes alive = talk.take().at(0);
  EXPECT_EQ(host->on_bytes(0, alive, at_s(1)).size(), 2u) << "parameters and a request";
  const auto actions = host->on_bytes(0, alive, at_s(1.1));
  ASSERT_EQ(actions.size(), 1u);
  EXPECT_EQ(read_frame(std::get<protocol::HostSend>(actions[0]).bytes)->header.id, Id::head_command);
  EXPECT_TRUE(host->on_tick(at_s(1.4)).empty());
  EXPECT_EQ(host->on_tick(at_s(1.6)).size(), 1u) << "the request is repeated, because it may be lost";
}

TEST(MicronHost, SendsParametersToASilentHead) {
  const auto host = *make_host({});
  host->on_open({}, at_s(0));
  EXPECT_TRUE(host->on_tick(at_s(2)).empty());
  EXPECT_EQ(host->on_tick(*host->next_tick()).size(), 2u);
}

}  // namespace
}  // namespace sonar::micron
