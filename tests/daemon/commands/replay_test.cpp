// Replay on loopback: a driver gets exactly the recording's bytes, at the requested pace.
#include <gmock/gmock.h>

#include <thread>

#include "protocol/oculus/decode.hpp"
#include "tests/daemon/commands/replay_on_loopback.hpp"
#include "tests/protocol/recording/recording_testing.hpp"

namespace sonar {
namespace {

Bytes ping_message(std::uint32_t id) { return recording::tests::ping_message(id, 256, 300); }

std::vector<RecordedMessage> messages_of(std::uint32_t pings, milliseconds period) {
  std::vector<RecordedMessage> messages;
  for (std::uint32_t i = 0; i < pings; ++i)
    messages.push_back({Time(std::chrono::seconds(1000)) + i * period, Origin::device, Carrier::stream, ping_message(i + 1)});
  return messages;
}

Bytes stream_of(const std::vector<RecordedMessage>& messages) {
  Bytes stream;
  for (const RecordedMessage& message : messages) stream.insert(stream.end(), message.bytes.begin(), message.bytes.end());
  return stream;
}

using MakeWriter = std::unique_ptr<recording::RecordingWriter> (*)(std::unique_ptr<recording::Sink>);
constexpr MakeWriter raw_dump = [](std::unique_ptr<recording::Sink> sink) { return recording::write_raw_dump(std::move(sink)); };
Bytes file_of(MakeWriter make, const std::vector<RecordedMessage>& messages) {
  Bytes file;
  const auto writer = make(recording::sink_into(file));
  for (const RecordedMessage& message : messages) EXPECT_TRUE(writer->write(message));
  EXPECT_TRUE(writer->close());
  return file;
}

TEST(Replay, SendsEveryByteOfEveryFormat) {
  const std::vector<RecordedMessage> messages = messages_of(40, milliseconds(5));
  const MakeWriter pcap = [](std::unique_ptr<recording::Sink> sink) { return recording::write_pcap(std::move(sink), {}); };
  for (const MakeWriter make : {MakeWriter{recording::write_oculus_log}, raw_dump, pcap}) {
    Replay replay(file_of(make, messages), as_fast_as_read());
    Driver driver(replay);
    EXPECT_EQ(driver.read(everything), stream_of(messages));
    EXPECT_TRUE(replay.ends());
    EXPECT_EQ(replay.figures().messages, 40u);
    EXPECT_EQ(replay.figures().times_through, 1u);
  }
}

TEST(Replay, MessagesOfAClientChangeNothing) {
  const std::vector<RecordedMessage> messages = messages_of(20, milliseconds(10));
  Replay replay(file_of(&recording::write_oculus_log, messages), {});
  Driver driver(replay);
  driver.send(oculus::make_fire({}));
  driver.send(Bytes(5000, std::byte{0x53}));
  EXPECT_EQ(driver.read(everything), stream_of(messages));
  EXPECT_TRUE(replay.ends());
}

TEST(Replay, KeepsTheRecordedPaceScaled) {
  const std::vector<RecordedMessage> messages = messages_of(11, milliseconds(100));
  ReplayOptions options;
  options.speed = 2;
  Replay replay(file_of(&recording::write_oculus_log, messages), options);
  const auto begin = Steady::now();
  Driver driver(replay);
  EXPECT_EQ(driver.read(everything), stream_of(messages));
  EXPECT_GE(Steady::now() - begin,
            milliseconds(490));  // one second at double speed; there is no upper limit, because it depends on the machine
}

TEST(Replay, LoopsUntilStopped) {
  const std::vector<RecordedMessage> messages = messages_of(3, milliseconds(1));
  ReplayOptions options = as_fast_as_read();
  options.loop = true;
  Replay replay(file_of(raw_dump, messages), options);
  Driver driver(replay);
  const Bytes once = stream_of(messages), twice_and_more = driver.read(2 * once.size() + 100);
  EXPECT_EQ(Bytes(twice_and_more.begin(), twice_and_more.begin() + static_cast<std::ptrdiff_t>(once.size())), once);
  EXPECT_TRUE(std::equal(once.begin(), once.end(), twice_and_more.begin() + static_cast<std::ptrdiff_t>(once.size())));
  replay.stop();
  const std::size_t rest = driver.read(everything).size() + 100;
  EXPECT_EQ(rest % ping_message(1).size(), 0u) << "the stream ends with a whole message";
  EXPECT_TRUE(replay.ends());
}

TEST(Replay, TheNextClientGetsTheRecordingFromItsStart) {
  const std::vector<RecordedMessage> messages = messages_of(50, milliseconds(20));
  Replay replay(file_of(&recording::write_oculus_log, messages), {});
  {
    Driver first(replay);
    EXPECT_EQ(first.read(1000).size(), 1000u);
    Driver second(replay);
    EXPECT_TRUE(second.read(1).empty()) << "like the device, the replay serves one client at a time";
    EXPECT_EQ(first.read(1000).size(), 1000u);
    first.reset();
  }
  for (const auto give_up = Steady::now() + patience; Steady::now() < give_up;) {
    Driver next(replay);
    const Bytes begin = next.read(2000);
    if (begin.empty()) continue;  // the first client is still connected
    const Bytes expected = stream_of(messages);
    EXPECT_TRUE(std::equal(begin.begin(), begin.end(), expected.begin()));
    return;
  }
  FAIL() << "no further client was served";
}

TEST(Replay, StopsWithAClientThatDoesNotRead) {
  const std::vector<RecordedMessage> messages = messages_of(400, milliseconds(0));  // 32 MB: more than the kernel can store
  Replay replay(file_of(raw_dump, messages), as_fast_as_read());
  Driver driver(replay);
  EXPECT_EQ(driver.read(10).size(), 10u);
  std::this_thread::sleep_for(milliseconds(100));
  const auto begin = Steady::now();
  replay.stop();
  EXPECT_TRUE(replay.ends());
  EXPECT_LT(Steady::now() - begin, std::chrono::seconds(10));
}

TEST(Replay, StatusLeadsDriversHere) {
  asio::io_context io;
  udp::socket listener(io, udp::endpoint(asio::ip::address_v4(address), 0));
  std::vector<RecordedMessage> messages = messages_of(2, milliseconds(1));
  oculus::StatusMessage recorded;
  recorded.header.part_number = recorded.part_number = 1032;
  recorded.header.type = oculus::MessageType::status;
  recorded.header.source = 7001;
  recorded.device_id = 7001;
  recorded.ip_address = {192, 168, 1, 200};
  recorded.arm0_version = 0x01020003;
  const MakeWriter pcap = [](std::unique_ptr<recording::Sink> sink) { return recording::write_pcap(std::move(sink), {}); };
  for (const bool with_status : {false, true}) {
    if (with_status) messages.push_back({messages.back().at, Origin::device, Carrier::datagram, wire::bytes_of(recorded)});
    ReplayOptions options;
    options.status_to = {{address, listener.local_endpoint().port()}};
    Replay replay(file_of(pcap, messages), options);
    ASSERT_TRUE(readable(listener)) << "no status datagram for " << patience.count() << " ms; expected one per second";
    Bytes datagram(2000);
    datagram.resize(listener.receive(asio::buffer(datagram)));
    const auto status = oculus::decode_status(datagram);
    ASSERT_TRUE(status);
    EXPECT_THAT(oculus::status_violations(*status, datagram.size()), ::testing::IsEmpty());
    EXPECT_EQ(asio::ip::address_v4(status->ip_address), replay.at().address().to_v4());
    EXPECT_EQ(status->header.source, 7001);
    EXPECT_EQ(status->part_number, with_status ? 1032 : 1042);
    EXPECT_EQ(status->arm0_version, with_status ? 0x01020003u : 0u);
  }
}

/// A reader that throws, as a bug in the server would.
class BrokenReader final : public recording::RecordingReader {
 public:
  std::optional<RecordedMessage> next() override { throw std::runtime_error("out of order"); }
  std::optional<Error> damage() const override { return {}; }
  void rewind() override {}
};

TEST(Replay, AnInternalFaultIsReported) {
  LogOptions quiet;
  quiet.sink = [](LogLevel, const std::string&) {};
  Log log(quiet);
  asio::io_context io;
  BrokenReader reader;
  ReplayOptions options = as_fast_as_read();
  options.at = {address, 0};
  ReplayServer server(io, reader, {}, options, log);
  ASSERT_TRUE(server.open());
  server.start();
  tcp::socket driver(io);
  driver.connect({asio::ip::address_v4(server.at().ip), server.at().port});
  io.run_for(patience);
  EXPECT_TRUE(io.stopped());
  ASSERT_FALSE(server.outcome());
  EXPECT_EQ(server.outcome().error().kind, ErrorKind::bug);
  EXPECT_THAT(server.outcome().error().text, ::testing::HasSubstr("out of order"));
}

TEST(Replay, NeedsAMessageOfADevice) {
  auto opened = recording::open_recording(recording::source_from("f", file_of(&recording::write_oculus_log, {})));
  ASSERT_TRUE(opened);
  const auto device = find_replay_device(*opened->reader, "f", 1042);
  ASSERT_FALSE(device);
  EXPECT_EQ(device.error().text, "f holds no message of a sonar");
}

TEST(ReplayPace, GapsAreScaledAndBoundedAndLongDelaysAreNotMadeUpFor) {
  const auto start = Steady::now();
  const auto at = [](int ms) { return Time(milliseconds(ms)); };
  ReplayPace pace(2, {});
  EXPECT_EQ(pace.due(at(1000), start), start);
  EXPECT_EQ(pace.due(at(1100), start), start + milliseconds(50));
  EXPECT_EQ(pace.due(at(1050), start), start + milliseconds(50)) << "a recording whose time goes back has no gap";
  EXPECT_EQ(pace.due(at(61050), start), start + milliseconds(50 + 2500));
  pace.begin_again();
  EXPECT_EQ(pace.due(at(1000), start), start + milliseconds(50 + 2500 + 50));
  EXPECT_EQ(pace.due(at(1100), start + milliseconds(9000)), start + milliseconds(9000));
  EXPECT_EQ(pace.due(at(1200), start + milliseconds(9100)), start + milliseconds(9050)) << "a short delay is made up for";
  ReplayPace untimed(1, milliseconds(100));
  EXPECT_EQ(untimed.due({}, start), start);
  EXPECT_EQ(untimed.due({}, start), start + milliseconds(100));
}

}  // namespace
}  // namespace sonar
