// Replay of sonars whose drivers decide which pings they get. Tests which scan line answers a request, which port sends which
// messages, and that a driver's sockets receive the recorded pings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "protocol/norbit/norbit.hpp"
#include "protocol/ping/products.hpp"
#include "tests/daemon/commands/requested_replay_testing.hpp"
#include "tests/protocol/micron/micron_testing.hpp"
#include "tests/protocol/norbit/norbit_testing.hpp"

namespace sonar::requested_replay_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// ---- which ping is sent

/// Messages of two bytes, one per second: a port and any number, or 0 and a direction in degrees. Port 99: not a ping.
Messages recorded(const std::vector<std::pair<int, int>>& messages) {
  std::vector<RecordedMessage> all;
  for (const auto& [port, number] : messages)
    all.push_back({Time(std::chrono::seconds(all.size())),
                   Origin::device,
                   Carrier::datagram,
                   {static_cast<std::byte>(port), static_cast<std::byte>(number)}});
  return Messages(std::move(all));
}
std::optional<recording::PingPart> part_of(recording::BytesView message) {
  const auto port = std::to_integer<std::uint16_t>(message[0]);
  if (port == 99) return std::nullopt;
  if (port != 0) return recording::PingPart{.port = port};
  return recording::PingPart{.head_rad = std::to_integer<int>(message[1]) * pi / 180};
}
const recording::Codec codec{.ping_part = part_of};

int second_of(const PlayedPing& ping) { return static_cast<int>(seconds(ping.at.time_since_epoch())); }

TEST(PlayedPings, OfTheNearestLinesOfAScanTheNextInTimeIsUsed) {
  Messages reader = recorded({{0, 10}, {99, 0}, {0, 20}, {0, 30}, {0, 20}, {0, 10}});
  PlayedPings pings(reader, codec);
  ASSERT_TRUE(pings.open("f"));
  ASSERT_TRUE(pings.is_scan());
  const auto at = [&](double deg) { return second_of(pings.nearest(deg * pi / 180)); };
  EXPECT_EQ(at(20), 2);
  EXPECT_EQ(at(20), 4) << "the next pass of the head";
  EXPECT_EQ(at(20), 2) << "the recording begins again";
  EXPECT_EQ(at(31), 3);
  EXPECT_EQ(at(11), 5);
  EXPECT_EQ(at(-350), 0) << "the same direction, less a full turn";
  EXPECT_EQ(at(200), 3) << "the nearest, as nothing was recorded there";
}

TEST(PlayedPings, PartsOfPortsMakeUpAPing) {
  Messages reader = recorded({{7, 1}, {8, 1}, {99, 0}, {7, 2}, {7, 3}, {8, 3}});
  PlayedPings pings(reader, codec);
  ASSERT_TRUE(pings.open("f"));
  EXPECT_FALSE(pings.is_scan());
  for (int round = 0; round < 2; ++round) {
    std::vector<std::size_t> parts;
    while (const auto ping = pings.next()) {
      parts.push_back(ping->parts.size());
      EXPECT_EQ(pings.at_end(), parts.size() == 3);
    }
    EXPECT_THAT(parts, ElementsAre(2, 1, 2));
    pings.rewind();
  }
}

TEST(PlayedPings, NeedAPing) {
  Messages reader = recorded({{99, 0}});
  PlayedPings pings(reader, codec);
  const auto opened = pings.open("f");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().text, "f holds no ping");
}

// ---- a driver at its sockets

Bytes micron_line(int bearing, char bin) {
  const auto state = micron::tests::device();
  micron::Settings s;
  s.command = micron::tests::sector();
  s.bearing = static_cast<std::uint16_t>(bearing);
  Ping ping;
  ping.request.settings = micron::ping_settings(s, state);
  ping.request.vendor_settings = std::make_shared<micron::HeldSettings>(s);
  ping.samples.assign(static_cast<std::size_t>(ping.request.settings.range_bin_count), static_cast<std::byte>(bin));
  return *micron::vendor().frame(ping, state);
}

/// A driver requests scan lines. The head turns by one grad (16 units) after each line.
TEST(ReplayOfMicron, ASendDataGetsTheRecordedLineOfItsDirection) {
  std::vector<Bytes> lines;
  for (int bearing = 2400; bearing <= 4000; bearing += 16) lines.push_back(micron_line(bearing, static_cast<char>(bearing / 16)));
  Replay replay(file_of(raw_dump, lines));
  Tcp driver(4001);
  driver.send(micron::tests::command(micron::tests::sector()));
  recording::MessageSplitter splitter(Origin::device, micron::framing);
  std::vector<int> bearings;
  for (int line = 0; line < 5; ++line) {
    driver.send(micron::tests::request());
    for (bool came = false; !came;) {
      const Bytes piece = driver.read();
      ASSERT_FALSE(piece.empty());
      splitter.append({}, piece);
      while (const auto whole = splitter.next()) {
        const auto message = micron::read_frame(whole->bytes);
        ASSERT_TRUE(message);
        if (message->header.id != micron::Id::head_data) continue;
        EXPECT_THAT(lines, ::testing::Contains(whole->bytes)) << "the line has other bytes than the recording";
        bearings.push_back(micron::read_front<micron::HeadData>(message->payload)->bearing);
        came = true;
      }
    }
  }
  for (std::size_t i = 1; i < bearings.size(); ++i) EXPECT_EQ(std::abs(bearings[i] - bearings[i - 1]), 16) << i;
}

Bytes ping360_line(std::uint16_t angle, bool of_a_scan) {
  const Bytes samples(3, static_cast<std::byte>(angle));
  Bytes payload = of_a_scan
                      ? wire::bytes_of(ping::AutoDeviceData{.angle = angle, .period = 80, .khz = 740, .samples = 3, .count = 3})
                      : wire::bytes_of(ping::DeviceData{.angle = angle, .period = 80, .khz = 740, .samples = 3, .count = 3});
  payload.insert(payload.end(), samples.begin(), samples.end());
  return ping::framed(of_a_scan ? ping::Id::auto_device_data : ping::Id::device_data, 2, payload);
}

/// The recording is of a scan. A request of a single line gets the message with which the device answers such a request.
TEST(ReplayOfPing360, ARequestGetsTheRecordedLineOfItsAngle) {
  Replay replay(file_of(ping_log, {ping360_line(10, true), ping360_line(20, true), ping360_line(30, true)}));
  Udp host(12345);
  for (const std::uint16_t angle : std::array<std::uint16_t, 3>{20, 10, 28}) {
    host.send(ping::framed_message(
        ping::Id::transducer, 0,
        ping::Transducer{.angle = angle, .transmit_us = 10, .period = 80, .khz = 740, .samples = 200, .transmit = 1}));
    const auto frame = host.read();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->header.id, ping::Id::device_data);
    EXPECT_TRUE(frame->sum_is_right);
    ping::DeviceData data;
    wire::Reader reader(frame->payload);
    fields(reader, data);
    EXPECT_EQ(data.angle, angle == 28 ? 30 : angle) << "the message has the angle of the nearest line";
    EXPECT_EQ(data.samples, 3) << "the recording's number of samples";
    EXPECT_EQ(frame->payload.back(), static_cast<std::byte>(data.angle));
  }
}

struct NorbitReplay : ::testing::Test {
  NorbitReplay() {
    norbit::Settings settings{.power = true, .stop_m = 12};
    const protocol::DeviceState state = norbit::tests::device();
    for (int row = 100; row < 105; ++row) {
      const Ping ping = norbit::tests::ping_with(settings, state, row, 10);
      const Bytes one = norbit::encode_bathymetry(ping, state), other = norbit::encode_column(ping, state);
      bathymetry.insert(bathymetry.end(), one.begin(), one.end());
      column.insert(column.end(), other.begin(), other.end());
      Bytes both = one;
      both.insert(both.end(), other.begin(), other.end());
      messages.push_back(both);  // as the daemon records them
    }
  }
  Bytes bathymetry, column;
  std::vector<Bytes> messages;
};

TEST_F(NorbitReplay, PacketsThatWereRecordedInPiecesAreWhole) {
  Bytes stream;
  for (const Bytes& both : messages) stream.insert(stream.end(), both.begin(), both.end());
  std::vector<RecordedMessage> pieces;
  for (std::size_t at = 0; at < stream.size(); at += 1000) {
    const auto begin = stream.begin() + static_cast<std::ptrdiff_t>(at);
    const auto size = static_cast<std::ptrdiff_t>(std::min<std::size_t>(1000, stream.size() - at));
    pieces.push_back({{}, Origin::device, Carrier::stream, Bytes(begin, begin + size)});
  }
  Messages reader(std::move(pieces));
  const recording::Codec norbit_codec = norbit::codec();
  PlayedPings pings(reader, norbit_codec);
  ASSERT_TRUE(pings.open("f"));
  Bytes all;
  while (const auto ping = pings.next())
    for (const auto& part : ping->parts) all.insert(all.end(), part.second.begin(), part.second.end());
  EXPECT_EQ(all, stream);
}

TEST_F(NorbitReplay, EachPortSendsItsPacketsOnceTheDriverTurnsItOn) {
  Replay replay(file_of(raw_dump, messages));
  Tcp points(norbit::bathymetry_port), pictures(norbit::column_port), commands(norbit::command_port);
  ASSERT_THAT(commands.read(), ::testing::Not(IsEmpty())) << "no greeting; after it, the other two ports are served";
  commands.send(std::string_view("set_power 1\r\n"));
  auto received = std::async(std::launch::async, [&] { return pictures.read_to_end(); });
  EXPECT_EQ(points.read_to_end(), bathymetry);
  EXPECT_EQ(received.get(), column);
  EXPECT_THAT(commands.read_to_end(), ::testing::Not(IsEmpty())) << "no replies";
  EXPECT_TRUE(replay.ends()) << "the driver has received everything, so the replay ends";
  EXPECT_EQ(replay.figures().messages, 5u);
  EXPECT_EQ(replay.figures().clients, 3u);
}

/// While pings wait for the disk, the driver's messages are answered, and no ping is cut or lost.
TEST_F(NorbitReplay, ADiskThatBlocksDelaysNoReplies) {
  std::promise<void> goes_on;
  Replay replay(file_of(raw_dump, messages), 1000, goes_on.get_future().share());
  Tcp points(norbit::bathymetry_port), pictures(norbit::column_port), commands(norbit::command_port);
  EXPECT_THAT(commands.read(), ::testing::Not(IsEmpty())) << "no greeting";
  for (int asked = 0; asked < 3; ++asked) {
    commands.send(std::string_view("set_power 1\r\n"));
    EXPECT_THAT(commands.read(), ::testing::Not(IsEmpty())) << "the event loop waits for the disk";
  }
  goes_on.set_value();
  auto received = std::async(std::launch::async, [&] { return pictures.read_to_end(); });
  EXPECT_EQ(points.read_to_end(), bathymetry);
  EXPECT_EQ(received.get(), column);
  EXPECT_TRUE(replay.ends());
  EXPECT_EQ(replay.figures().messages, 5u);
}

TEST_F(NorbitReplay, AnErrorOfTheDiskEndsTheReplayWithItsText) {
  std::promise<void> goes_on;
  goes_on.set_exception(std::make_exception_ptr(std::runtime_error("the disk is gone")));
  Replay replay(file_of(raw_dump, messages), 1000, goes_on.get_future().share());
  Tcp commands(norbit::command_port), points(norbit::bathymetry_port);
  commands.send(std::string_view("set_power 1\r\n"));
  commands.read_to_end();
  points.read_to_end();
  ASSERT_TRUE(replay.ends());
  ASSERT_FALSE(replay.outcome());
  EXPECT_THAT(replay.outcome().error().text, ::testing::HasSubstr("the disk is gone"));
}

}  // namespace
}  // namespace sonar::requested_replay_test
