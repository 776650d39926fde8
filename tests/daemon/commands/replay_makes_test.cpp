// Replay on loopback, with files of makes other than Oculus. Their hosts must send requests before they get pings.
#include <gmock/gmock.h>

#include "protocol/aris/aris_file.hpp"
#include "protocol/aris/encode_frame.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping_log.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "tests/daemon/commands/replay_on_loopback.hpp"

namespace sonar {
namespace {

// ---- .aris files

Bytes aris_picture(std::int32_t frame) {
  Bytes picture(std::size_t{48} * 300);
  for (std::size_t i = 0; i < picture.size(); ++i)
    picture[i] = static_cast<std::byte>((i + 7 * static_cast<std::size_t>(frame)) % 253);
  return picture;
}

Bytes aris_file(std::int32_t frames, milliseconds period) {
  Bytes file;
  const auto writer = recording::write_aris_file(recording::sink_into(file));
  for (std::int32_t i = 0; i < frames; ++i) {
    aris::FrameHeader header;
    header.frame_time_us = 1'400'000'000'000'000 + static_cast<std::uint64_t>(i * std::chrono::microseconds(period).count());
    header.ping_mode = 1;
    header.samples_per_beam = 300;
    header.system = static_cast<std::uint32_t>(aris::SystemType::aris_1200);
    header.serial = 70001;
    header.applied_cookie = 42;
    for (const Bytes& part : aris::parts_of(i + 1, wire::bytes_of(header), aris::raw_from_picture(aris_picture(i), 300, 3)))
      EXPECT_TRUE(writer->write({{}, Origin::device, Carrier::datagram, part}));
  }
  EXPECT_TRUE(writer->close());
  return file;
}

/// A controller that requests frames at a port of its own.
class Controller {
 public:
  explicit Controller(const Replay& replay) : frames_(io_, udp::endpoint(asio::ip::address_v4::loopback(), 0)), commands_(io_) {
    frames_.set_option(asio::socket_base::receive_buffer_size(1 << 20));
    commands_.connect(replay.at());
    aris::Command command;
    command.type = aris::CommandType::set_receiver;
    command.receiver = aris::Receiver{frames_.local_endpoint().port(), ""};
    asio::write(commands_, asio::buffer(aris::framed(command)));
  }
  void set_acoustics() {
    aris::Command command;
    command.type = aris::CommandType::set_acoustics;
    command.acoustics = {1, 5, 300, 2000, 20000, 4, 6, 1, true, aris::Frequency::high, true, 12};
    asio::write(commands_, asio::buffer(aris::framed(command)));
  }
  /// Returns the next frame; nullopt if no datagram comes within `wait`.
  std::optional<aris::DecodedFrame> next(milliseconds wait = patience) {
    Bytes datagram(2000);
    while (true) {
      pollfd waited{frames_.native_handle(), POLLIN, 0};
      if (::poll(&waited, 1, static_cast<int>(wait.count())) <= 0) return std::nullopt;
      datagram.resize(2000);
      datagram.resize(frames_.receive(asio::buffer(datagram)));
      EXPECT_LE(datagram.size(), aris::longest_datagram);
      if (auto frame = assembler_.add(datagram)) return frame;
    }
  }

 private:
  asio::io_context io_;
  udp::socket frames_;
  tcp::socket commands_;
  aris::FrameAssembler assembler_;
};

TEST(ReplayOfAris, FramesComeInOrderAndPaceAfterSettings) {
  ReplayOptions options;
  options.speed = 2;
  Replay replay(aris_file(5, milliseconds(200)), options);
  Controller controller(replay);
  EXPECT_FALSE(controller.next(milliseconds(150))) << "no acoustic settings, no frames";
  const auto begin = Steady::now();
  controller.set_acoustics();
  for (std::int32_t i = 0; i < 5; ++i) {
    const auto frame = controller.next();
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(frame->index, i + 1);
    EXPECT_EQ(frame->header.frame_index, static_cast<std::uint32_t>(i));
    EXPECT_EQ(frame->header.serial, 70001u);
    EXPECT_EQ(frame->header.applied_cookie, 42u) << "the cookie of the recording";
    EXPECT_EQ(frame->picture, aris_picture(i));
  }
  EXPECT_GE(Steady::now() - begin, milliseconds(390));
  EXPECT_TRUE(replay.ends());
  EXPECT_EQ(replay.figures().messages, 5u);
}

TEST(ReplayOfAris, FrameNumbersContinueInALoopAndRestartForTheNextController) {
  ReplayOptions options;
  options.loop = true;
  Replay replay(aris_file(2, milliseconds(1)), options);
  for (int controllers = 0; controllers < 2; ++controllers) {
    std::optional<Controller> controller;
    std::optional<aris::DecodedFrame> frame;
    for (const auto give_up = Steady::now() + patience; !frame && Steady::now() < give_up;) try {
        controller.emplace(replay);
        controller->set_acoustics();
        frame = controller->next(milliseconds(500));
      } catch (const std::exception&) {  // the previous host is still connected
      }
    for (std::int32_t i = 0; i < 5; ++i, frame = controller->next()) {
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->index, i + 1);
      EXPECT_EQ(frame->picture, aris_picture(i % 2));
    }
  }
}

TEST(ReplayOfAris, ABeaconLeadsControllersHere) {
  asio::io_context io;
  udp::socket listener(io, udp::endpoint(asio::ip::address_v4(address), 0));
  ReplayOptions options;
  options.status_to = {{address, listener.local_endpoint().port()}};
  Replay replay(aris_file(2, milliseconds(1)), options);
  std::optional<Controller> controller;
  for (const bool busy : {false, true}) {
    if (busy) controller.emplace(replay);
    aris::Availability beacon;
    for (int i = 0; i < 3 && (i == 0 || (beacon.busy != 0) != busy); ++i) {
      ASSERT_TRUE(readable(listener));
      Bytes datagram(500);
      udp::endpoint from;
      datagram.resize(listener.receive_from(asio::buffer(datagram), from));
      ASSERT_TRUE(aris::protobuf::read(datagram, beacon));
      EXPECT_EQ(from.address(), replay.at().address());
    }
    EXPECT_EQ(beacon.serial, 70001u);
    EXPECT_EQ(beacon.system, aris::SystemType::aris_1200);
    EXPECT_EQ(beacon.busy != 0, busy);
  }
}

// ---- logs of the ping protocol

TEST(ReplayOfPingLogs, AFileOfNoKnownSonarIsRefused) {
  Bytes file;
  const auto writer = recording::write_ping_log(recording::sink_into(file));
  const Bytes frame = ping::framed_message(ping::Id::water_stats, 0, ping::WaterStats{});
  ASSERT_TRUE(writer->write({{}, Origin::device, Carrier::stream, frame}));
  file.resize(file.size() - 1);
  auto opened = recording::open_recording(recording::source_from("f", file));
  ASSERT_TRUE(opened);
  const auto device = find_replay_device(*opened->reader, "f", 1042);
  ASSERT_FALSE(device);
  EXPECT_THAT(device.error().text, ::testing::HasSubstr("f holds no message of a sonar: f: bytes 1"));
}

// ---- .sonar files

Bytes sonar_file(std::uint32_t shots, milliseconds period) {
  Bytes file;
  for (std::uint32_t i = 0; i < shots; ++i) {
    waterlinked::Shot shot;
    shot.at = Time(std::chrono::seconds(1'700'000'000)) + i * period;
    shot.sequence = i + 1;
    for (const Bytes& content : {waterlinked::packet_of(waterlinked::RangeMessage{shot, 0.001f, {1, 2, 3}}),
                                 waterlinked::packet_of(waterlinked::StrengthMessage{shot, {4, 5, 6}})}) {
      const Bytes packet = waterlinked::rip_packet(content);
      file.insert(file.end(), packet.begin(), packet.end());
    }
  }
  return file;
}

/// A host that receives images at a port of its own.
class Host {
 public:
  explicit Host(const Replay& replay) : at_(replay.at()), images_(io_, udp::endpoint(asio::ip::address_v4::loopback(), 0)) {}
  /// Returns the begin of the answer: HTTP version and status.
  std::string post(const std::string& path, const std::string& body) {
    tcp::socket socket(io_);
    socket.connect(at_);
    const std::string request = "POST /api/v1/integration" + path + " HTTP/1.1\r\nHost: " + at_.address().to_string() +
                                "\r\nContent-Type: application/json\r\n" + "Content-Length: " + std::to_string(body.size()) +
                                "\r\n\r\n" + body;
    asio::write(socket, asio::buffer(request));
    std::string answer(12, '\0');
    return readable(socket) ? (asio::read(socket, asio::buffer(answer)), answer) : "no answer";
  }
  void want_images() {
    EXPECT_EQ(post("/udp", R"({"mode":"unicast","unicast_destination_ip":"127.0.0.1","unicast_destination_port":)" +
                               std::to_string(images_.local_endpoint().port()) + "}"),
              "HTTP/1.1 204");
    EXPECT_EQ(post("/acoustics/enabled", "true"), "HTTP/1.1 204");
  }
  bool silent(milliseconds wait) {
    pollfd waited{images_.native_handle(), POLLIN, 0};
    return ::poll(&waited, 1, static_cast<int>(wait.count())) == 0;
  }
  Bytes next() {
    Bytes datagram(2000);
    if (!readable(images_)) return {};
    datagram.resize(images_.receive_from(asio::buffer(datagram), from));
    return datagram;
  }
  udp::endpoint from;  // sender of the last datagram

 private:
  asio::io_context io_;
  tcp::endpoint at_;
  udp::socket images_;
};

TEST(ReplayOf3d15, ImagesComeAtTheirPaceToTheReceiverSetOverHttp) {
  const Bytes file = sonar_file(4, milliseconds(200));
  ReplayOptions options;
  options.speed = 2;
  Replay replay(file, options);
  Host host(replay);
  EXPECT_TRUE(host.silent(milliseconds(150))) << "acoustics are off and no output is set";
  const auto begin = Steady::now();
  host.want_images();
  Bytes received;
  for (int i = 0; i < 8; ++i) {
    const Bytes datagram = host.next();
    ASSERT_TRUE(waterlinked::rip_content(datagram));
    EXPECT_EQ(host.from.address(), replay.at().address()) << "hosts drop images from other addresses";
    received.insert(received.end(), datagram.begin(), datagram.end());
  }
  EXPECT_EQ(received, file);
  EXPECT_GE(Steady::now() - begin, milliseconds(290));
  EXPECT_TRUE(replay.ends());
  EXPECT_EQ(replay.figures().messages, 8u);
}

TEST(ReplayOf3d15, PausesWhileAcousticsAreOff) {
  ReplayOptions options;
  options.loop = true;
  Replay replay(sonar_file(2, milliseconds(20)), options);
  Host host(replay);
  host.want_images();
  for (int i = 0; i < 10; ++i) ASSERT_FALSE(host.next().empty());
  EXPECT_EQ(host.post("/acoustics/enabled", "false"), "HTTP/1.1 204");
  EXPECT_EQ(host.post("/acoustics/mode", "3"), "HTTP/1.1 400");
  while (!host.silent(milliseconds(500))) host.next();
  EXPECT_EQ(host.post("/acoustics/enabled", "true"), "HTTP/1.1 204");
  EXPECT_FALSE(host.next().empty());
}

}  // namespace
}  // namespace sonar
