// Hostile clients of a replay: the memory and log lines that they cause, and the addresses to which they can direct its
// datagrams.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <future>

#include "daemon/commands/replay/replay_server.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping_log.hpp"
#include "protocol/waterlinked/messages.hpp"

namespace sonar::replay_strangers_test {
namespace {

using recording::Bytes;
using std::chrono::milliseconds;
constexpr milliseconds patience{20000};

std::unique_ptr<recording::RecordingReader> reader_of(Bytes file) {
  auto opened = recording::open_recording(recording::source_from("recording", std::move(file)));
  if (!opened) throw std::runtime_error(opened.error().text);
  return std::move(opened->reader);
}

/// A replay server in a thread of its own; it counts the lines of its log.
struct Replay {
  explicit Replay(Bytes file, ReplayOptions options = {}) : Replay(reader_of(std::move(file)), std::move(options)) {}
  explicit Replay(std::unique_ptr<recording::RecordingReader> from, ReplayOptions options = {})
      : log(counted()), reader(std::move(from)) {
    auto device = find_replay_device(*reader, "recording", 1042);
    if (!device) throw std::runtime_error(device.error().text);
    options.at = {{127, 0, 0, 2}, 0};
    options.loop = true;
    server = std::make_unique<ReplayServer>(io, *reader, *device, options, log);
    if (const auto listening = server->open(); !listening) throw std::runtime_error(listening.error().text);
    server->start();
    done = std::async(std::launch::async, [this] { io.run(); });
  }
  ~Replay() { stop(); }
  void stop() {
    asio::post(io, [this] { server->stop(); });
    done.wait();
  }
  tcp::endpoint at() const { return {asio::ip::address_v4(server->at().ip), server->at().port}; }
  LogOptions counted() {
    LogOptions options;
    options.sink = [this](LogLevel, const std::string&) { ++lines; };
    return options;
  }

  std::atomic<int> lines{0};
  Log log;
  asio::io_context io;
  std::unique_ptr<recording::RecordingReader> reader;
  std::unique_ptr<ReplayServer> server;
  std::future<void> done;
};

Bytes ping_log() {
  Bytes file;
  const auto writer = recording::write_ping_log(recording::sink_into(file));
  EXPECT_TRUE(writer->write({{},
                             recording::Origin::device,
                             recording::Carrier::stream,
                             ping::framed_message(ping::Id::atof_point_data, 0, ping::AtofPointData{})}));
  EXPECT_TRUE(writer->close());
  return file;
}

TEST(ReplayBesideStrangers, AHostThatReadsNoAnswersIsClosedAndFillsNoLog) {
  Replay replay(ping_log());
  asio::io_context io;
  tcp::socket host(io);
  host.open(tcp::v4());
  host.set_option(asio::socket_base::receive_buffer_size(2048));  // so that the kernel can store few answers
  host.connect(replay.at());
  Bytes refused;  // each is refused, with an answer and a line for the log
  for (int i = 0; i < 200; ++i) {
    const Bytes frame = ping::framed(static_cast<ping::Id>(9999), 0, {});
    refused.insert(refused.end(), frame.begin(), frame.end());
  }
  error_code ec;
  for (int i = 0; i < 1000 && !ec; ++i) asio::write(host, asio::buffer(refused), ec);
  pollfd closed{host.native_handle(), POLLRDHUP, 0};
  EXPECT_GT(::poll(&closed, 1, static_cast<int>(patience.count())), 0) << "the replay accepts all requests and keeps the answers";
  replay.stop();
  EXPECT_EQ(replay.server->figures().greedy, 1u);
  EXPECT_LT(replay.lines, 100) << "of 200,000 messages that were refused";
}

/// An endless recording of Oculus pings of 64 kB. With `goes_on`, its disk blocks until that has a value.
class SlowDisk final : public recording::RecordingReader {
 public:
  explicit SlowDisk(std::shared_future<void> goes_on = {}) : goes_on_(std::move(goes_on)) {}
  std::optional<recording::RecordedMessage> next() override {
    if (rewound_ && goes_on_.valid()) goes_on_.wait();  // the search for the sonar, before rewind(), does not block
    recording::RecordedMessage message;
    oculus::MessageHeader header;
    header.type = oculus::MessageType::ping_result;
    header.payload_size = static_cast<std::uint32_t>(64000);
    message.bytes = wire::bytes_of(header);
    message.bytes.resize(message.bytes.size() + header.payload_size);
    message.at = Time(milliseconds(count_++));
    return message;
  }
  std::optional<Error> damage() const override { return std::nullopt; }
  void rewind() override { rewound_ = true; }

 private:
  std::shared_future<void> goes_on_;
  bool rewound_ = false;
  int count_ = 0;
};

bool ends(tcp::socket& socket) {
  pollfd closed{socket.native_handle(), POLLRDHUP, 0};
  return ::poll(&closed, 1, static_cast<int>(patience.count())) > 0;
}

TEST(ReplayBesideStrangers, AClientThatReadsNothingIsDisconnected) {
  ReplayOptions options;
  options.stall = milliseconds(200);
  Replay replay(std::make_unique<SlowDisk>(), options);
  asio::io_context io;
  tcp::socket stalled(io);
  stalled.open(tcp::v4());
  stalled.set_option(asio::socket_base::receive_buffer_size(2048));
  stalled.connect(replay.at());
  EXPECT_TRUE(ends(stalled)) << "a client that reads nothing stays connected";
  tcp::socket next(io);
  next.connect(replay.at());
  std::array<char, 16> header{};
  EXPECT_EQ(asio::read(next, asio::buffer(header)), header.size());
  next.close();
  replay.stop();
  EXPECT_EQ(replay.server->figures().stalled, 1u);
}

TEST(ReplayBesideStrangers, ADiskThatBlocksDelaysNoOtherClient) {
  std::promise<void> goes_on;
  Replay replay(std::make_unique<SlowDisk>(goes_on.get_future().share()));
  asio::io_context io;
  tcp::socket served(io), refused(io);
  served.connect(replay.at());
  refused.connect(replay.at());
  EXPECT_TRUE(ends(refused)) << "the event loop waits for the disk";
  goes_on.set_value();
  std::array<char, 16> header{};
  EXPECT_EQ(asio::read(served, asio::buffer(header)), header.size());
  served.close();
  replay.stop();
}

Bytes sonar_file() {
  Bytes file;
  waterlinked::Shot shot;
  shot.at = Time(std::chrono::seconds(1'700'000'000));
  shot.sequence = 1;
  for (const Bytes& content : {waterlinked::packet_of(waterlinked::RangeMessage{shot, 0.001f, {1, 2, 3}}),
                               waterlinked::packet_of(waterlinked::StrengthMessage{shot, {4, 5, 6}})}) {
    const Bytes packet = waterlinked::rip_packet(content);
    file.insert(file.end(), packet.begin(), packet.end());
  }
  return file;
}

TEST(ReplayBesideStrangers, NoFramesGoToABroadcastAddress) {
  Replay replay(sonar_file());
  asio::io_context io;
  udp::socket images(io, udp::endpoint(asio::ip::address_v4::any(), 0));
  const auto post = [&](const std::string& path, const std::string& body) {
    tcp::socket socket(io);
    socket.connect(replay.at());
    const std::string request =
        "POST /api/v1/integration" + path +
        " HTTP/1.1\r\nHost: 127.0.0.2\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
        "\r\n\r\n" + body;
    asio::write(socket, asio::buffer(request));
    std::string answer(12, '\0');
    asio::read(socket, asio::buffer(answer));
    return answer;
  };
  const auto receive_at = [&](const std::string& ip) {
    const std::string port = std::to_string(images.local_endpoint().port());
    return post("/udp", R"({"mode":"unicast","unicast_destination_ip":")" + ip + R"(","unicast_destination_port":)" + port + "}");
  };
  ASSERT_EQ(receive_at("127.255.255.255"), "HTTP/1.1 204");
  ASSERT_EQ(post("/acoustics/enabled", "true"), "HTTP/1.1 204");
  std::array<char, 2000> datagram;
  std::atomic<bool> any{false};
  images.async_receive(asio::buffer(datagram), [&](const error_code& ec, std::size_t) { any = !ec; });
  io.run_for(milliseconds(500));  // if a shot is sent, it is sent at once
  EXPECT_FALSE(any) << "a frame was broadcast";
  ASSERT_EQ(receive_at("127.0.0.1"), "HTTP/1.1 204");
  io.restart();
  io.run_for(patience);
  EXPECT_TRUE(any) << "no frame at the address of a computer";
}

}  // namespace
}  // namespace sonar::replay_strangers_test
