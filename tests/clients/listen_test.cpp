// Tests the commands with a small made-up device and a pose listener, on loopback and free ports.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <fstream>
#include <regex>
#include <thread>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/ping_stream.hpp"
#include "clients/sonarctl/record.hpp"
#include "clients/sonarctl/source.hpp"
#include "protocol/control/control.hpp"
#include "protocol/control/json_pose.hpp"
#include "protocol/oculus/encode_ping.hpp"
#include "tests/clients/made_up_ping.hpp"

namespace sonar::clients {
namespace {

using testing::HasSubstr;

/// Returns a socket at a free port of our own loopback address.
Socket bound(int type, std::uint16_t& port) {
  Socket socket(::socket(AF_INET, type | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  ::inet_pton(AF_INET, "127.0.0.2", &address.sin_addr);
  // The sockets interface requires these casts.
  EXPECT_EQ(::bind(socket.fd(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  socklen_t size = sizeof address;
  ::getsockname(socket.fd(), reinterpret_cast<sockaddr*>(&address), &size);
  port = ntohs(address.sin_port);
  return socket;
}

/// Accepts one client, waits for its fire message and sends the result of `answer`, then waits until the client leaves. Later
/// clients are connected, and receive nothing. With `visits` > 1 it closes the connection itself, for this many clients
/// one after another; then it closes its port.
class FakeDevice {
 public:
  using Answer = std::function<wire::Bytes(std::uint32_t number, const oculus::FireSettings& asked)>;
  explicit FakeDevice(std::uint32_t pings, Answer answer, int visits = 1) : listener_(bound(SOCK_STREAM, port_)) {
    ::listen(listener_.fd(), 16);
    thread_ = std::thread([this, pings, answer = std::move(answer), visits] {
      for (int i = 0; i < visits; ++i) serve(pings, answer, visits == 1);
      if (visits > 1) ::shutdown(listener_.fd(), SHUT_RDWR);
    });
  }
  ~FakeDevice() {
    ::shutdown(listener_.fd(), SHUT_RDWR);
    thread_.join();
  }
  Endpoint endpoint() const { return {"127.0.0.2", port_}; }

 private:
  void serve(std::uint32_t pings, const Answer& answer, bool stays) {
    const Socket client(::accept4(listener_.fd(), nullptr, nullptr, SOCK_CLOEXEC));
    if (client.fd() < 0) return;
    std::array<std::byte, 512> received;
    const Read read = read_some(client, received, std::chrono::seconds(10));
    const auto fire = oculus::parse_fire(std::span<const std::byte>(received).first(read.size));
    if (!fire) return;
    for (std::uint32_t i = 0; i < pings; ++i)
      if (!write_all(client, answer(i, fire->settings))) return;
    while (stays && read_some(client, received, std::chrono::seconds(10)).what == Wait::data)
      continue;  // until the client leaves
  }

  std::uint16_t port_ = 0;
  Socket listener_;
  std::thread thread_;
};

protocol::Wanted wanted() {
  protocol::Wanted all;
  all.settings.range_m = 2;
  all.more = {{"gain-assist", "on"}, {"speed-of-sound", "1500"}};
  return all;
}

ListenOptions quiet(const Endpoint& device, std::uint64_t pings) {
  ListenOptions options;
  options.source.device = device;
  options.source.make = find_make("oculus");
  options.source.wanted = wanted();
  options.pings = pings;
  options.seconds = 20;
  options.quiet = true;
  options.style = {200, *find_colour_map("gray"), true};
  return options;
}

TEST(Listen, AcceptsAGoodDeviceAndDrawsAPing) {
  FakeDevice device(5, [](std::uint32_t i, const oculus::FireSettings& echo) { return ping_bytes(i + 1, echo); });
  ListenOptions options = quiet(device.endpoint(), 5);
  options.png = std::filesystem::path(testing::TempDir()) / "listen_test.png";
  options.record = std::filesystem::path(testing::TempDir()) / "listen_test.raw";
  const Result<void> done = listen(options);
  EXPECT_TRUE(done) << done.error().text;
  EXPECT_TRUE(std::filesystem::remove(options.png));
  const auto first = read_ping(options.record, std::nullopt), last = read_ping(options.record, 4);
  ASSERT_TRUE(first && last);
  EXPECT_EQ(first->facts.number, 1u);
  EXPECT_EQ(last->facts.number, 5u);
  const auto none = read_ping(options.record, 5);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().text, HasSubstr("holds pings 0 to 4, not 5"));
  std::filesystem::remove(options.record);
}

TEST(Listen, ReportsThatTheRecordingCannotBeWritten) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP();
  FakeDevice device(5, [](std::uint32_t i, const oculus::FireSettings& echo) { return ping_bytes(i + 1, echo); });
  ListenOptions options = quiet(device.endpoint(), 5);
  options.record = "/dev/full";
  const Result<void> done = listen(options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().text, "cannot write more to /dev/full: No space left on device; make room");
  EXPECT_EQ(done.error().kind, ErrorKind::io);
}

TEST(Listen, AcceptsAnEchoThatIsOnePingLate) {
  FakeDevice device(4, [](std::uint32_t i, oculus::FireSettings echo) {
    if (i == 0) echo.range = 7;
    return ping_bytes(i + 1, echo);
  });
  const Result<void> done = listen(quiet(device.endpoint(), 4));
  EXPECT_TRUE(done) << done.error().text;
}

TEST(Listen, RefusesBrokenSizesJunkAndWrongEchoes) {
  FakeDevice broken(1, [](std::uint32_t, const oculus::FireSettings& echo) {
    wire::Bytes bytes = ping_bytes(1, echo);
    bytes[114] ^= std::byte{1};  // image_size
    return bytes;
  });
  EXPECT_THAT(listen(quiet(broken.endpoint(), 1)).error().text, HasSubstr("broken identities"));
  FakeDevice junk(2, [](std::uint32_t i, const oculus::FireSettings& echo) {
    wire::Bytes bytes = ping_bytes(i + 1, echo);
    bytes.insert(bytes.begin(), 3, std::byte{0});
    return bytes;
  });
  EXPECT_THAT(listen(quiet(junk.endpoint(), 2)).error().text, HasSubstr("6 bytes between messages"));
  FakeDevice deaf(3, [](std::uint32_t i, oculus::FireSettings echo) {
    echo.mode = 1;
    return ping_bytes(i + 1, echo);
  });
  const Result<void> done = listen(quiet(deaf.endpoint(), 3));
  EXPECT_EQ(done.error().kind, ErrorKind::bad_data);
  EXPECT_THAT(done.error().text, HasSubstr("never matched the request"));
}

TEST(Listen, ConnectsAgainInARunWithoutAnEnd) {
  for (const bool live : {false, true}) {
    SCOPED_TRACE(live ? "view --live" : "listen");
    FakeDevice device(
        3, [](std::uint32_t i, const oculus::FireSettings& echo) { return ping_bytes(i + 1, echo); }, 2);
    ListenOptions options = quiet(device.endpoint(), 0);
    options.seconds = 0;
    options.source.connect_patience_s = options.source.return_limit_s = 1;
    ViewOptions view_options;
    view_options.source = options.source;
    view_options.png = std::filesystem::path(testing::TempDir()) / "view_again_test.png";
    view_options.style = options.style;
    view_options.live = true;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const Result<void> done = live ? view(view_options) : listen(options);
    const std::string out = testing::internal::GetCapturedStdout(), err = testing::internal::GetCapturedStderr();
    std::filesystem::remove(view_options.png);
    ASSERT_FALSE(done) << "the device accepts no third connection";
    EXPECT_EQ(done.error().kind, ErrorKind::io);
    EXPECT_THAT(err, HasSubstr("; connecting again, for 1 s\nsonarctl: connected again to 127.0.0.2:"));
    if (!live) {
      EXPECT_THAT(out, HasSubstr("pings 6")) << "pings of both connections are counted";
    }
  }
}

TEST(Listen, EndsWhenTheDeviceConnectsAndStaysSilent) {
  for (const bool live : {false, true}) {
    SCOPED_TRACE(live ? "view --live" : "listen");
    FakeDevice device(3, [](std::uint32_t i, const oculus::FireSettings& echo) { return ping_bytes(i + 1, echo); });
    ListenOptions options = quiet(device.endpoint(), 0);
    options.seconds = 0;
    options.source.silence_limit_s = 1;
    options.source.return_limit_s = 1;
    ViewOptions view_options;
    view_options.source = options.source;
    view_options.png = std::filesystem::path(testing::TempDir()) / "view_silent_test.png";
    view_options.style = options.style;
    view_options.live = true;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const Result<void> done = live ? view(view_options) : listen(options);
    testing::internal::GetCapturedStdout();
    const std::string err = testing::internal::GetCapturedStderr();
    std::filesystem::remove(view_options.png);
    ASSERT_FALSE(done);
    EXPECT_THAT(done.error().text, HasSubstr("it did not come back within 1 s"));
    const std::regex again("connected again");
    const auto found = std::sregex_iterator(err.begin(), err.end(), again);
    EXPECT_LE(std::distance(found, std::sregex_iterator()), 3) << err;  // each takes a second of silence
  }
}

/// `--seconds` and the time of the first ping do not include the wait for a device that starts late.
TEST(Listen, CountsTimeFromTheConnection) {
  SourceOptions source;
  source.make = find_make("oculus");
  source.device.host = "127.0.0.2";
  const Socket device = bound(SOCK_STREAM, source.device.port);
  source.connect_patience_s = 20;
  const auto begin = std::chrono::steady_clock::now();
  std::thread starts_late([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    ::listen(device.fd(), 1);
  });
  const auto opened = open_stream(source, source.device);
  starts_late.join();
  ASSERT_TRUE(opened) << opened.error().text;
  EXPECT_GE(opened->connected_at - begin, std::chrono::milliseconds(500));
}

TEST(Listen, ReportsASilentOrMissingDevice) {
  FakeDevice silent(0, [](std::uint32_t, const oculus::FireSettings&) { return wire::Bytes{}; });
  ListenOptions options = quiet(silent.endpoint(), 1);
  options.source.silence_limit_s = 1;
  const Result<void> nothing = listen(options);
  EXPECT_EQ(nothing.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(nothing.error().text, HasSubstr("no message of an Oculus arrived from tcp " + text_from(silent.endpoint()) +
                                              " within 1 s: is it another sonar?"));

  std::uint16_t free_port = 0;
  { const Socket briefly = bound(SOCK_STREAM, free_port); }
  options.source.device.port = free_port;
  options.source.connect_patience_s = 0.1;
  const Result<void> absent = listen(options);
  EXPECT_EQ(absent.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(absent.error().text, HasSubstr("Is sonard running there?"));
}

TEST(Listen, ReportsThatTheDeviceFellSilent) {
  FakeDevice device(1, [](std::uint32_t, const oculus::FireSettings& echo) { return ping_bytes(1, echo); });
  ListenOptions options = quiet(device.endpoint(), 2);
  options.source.silence_limit_s = 1;
  const Result<void> done = listen(options);
  EXPECT_EQ(done.error().kind, ErrorKind::io);
  EXPECT_THAT(done.error().text, HasSubstr("nothing more arrived within 1 s: drivers give up"));
}

TEST(Listen, NamesTheSettingThatStopsPings) {
  for (const auto& [rate_hz, why] :
       {std::pair(0.0, "within 1 s: --rate standby requested that"),
        std::pair(0.5, "within 1 s: --rate 0.5 requested less than one ping in that time; --wait makes it longer")})
    for (const std::uint32_t pings : {0u, 1u}) {
      FakeDevice device(pings, [](std::uint32_t, const oculus::FireSettings& echo) { return ping_bytes(1, echo); });
      ListenOptions options = quiet(device.endpoint(), 2);
      options.source.silence_limit_s = 1;
      options.source.wanted.settings.rate_hz = rate_hz;
      EXPECT_THAT(listen(options).error().text, HasSubstr(why));
    }
}

TEST(View, PrintsMessagesBesidePings) {
  for (const bool live : {false, true}) {
    SCOPED_TRACE(live);
    FakeDevice device(1, [](std::uint32_t, const oculus::FireSettings& echo) {
      wire::Bytes bytes = oculus::make_log(7001, "water in the housing");
      const wire::Bytes ping = ping_bytes(1, echo);
      bytes.insert(bytes.end(), ping.begin(), ping.end());
      return bytes;
    });
    ViewOptions options;
    options.source = quiet(device.endpoint(), 1).source;
    options.png = std::filesystem::path(testing::TempDir()) / "view_notices_test.png";
    options.style = {200, *find_colour_map("gray"), true};
    options.live = live;
    options.pings = live ? 1 : 0;
    testing::internal::CaptureStderr();
    const Result<void> done = view(options);
    EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("sonarctl: message of the device: water in the housing"));
    EXPECT_TRUE(done) << done.error().text;
    std::filesystem::remove(options.png);
  }
}

TEST(Record, RefusedSettingsReplaceNoFile) {
  FakeDevice device(0, [](std::uint32_t, const oculus::FireSettings&) { return wire::Bytes{}; });
  RecordOptions options;
  options.source = quiet(device.endpoint(), 1).source;
  options.source.wanted.settings.mode = 2;
  options.status = false;
  options.raw = std::filesystem::path(testing::TempDir()) / "record_settings_test.raw";
  std::ofstream(options.raw) << "kept";
  const Result<void> done = record(options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::usage);
  EXPECT_THAT(done.error().text, HasSubstr("an Oculus has modes 1 and 2"));
  EXPECT_EQ(std::filesystem::file_size(options.raw), 4u);
  std::filesystem::remove(options.raw);
}

TEST(View, DistinguishesAnotherServiceFromASonarInStandby) {
  ViewOptions options;
  options.source.make = find_make("oculus");
  options.terminal = true;
  options.source.wanted = wanted();
  options.source.silence_limit_s = 1;
  for (const bool live : {false, true}) {
    SCOPED_TRACE(live);
    FakeDevice other(1, [](std::uint32_t, const oculus::FireSettings&) { return wire::Bytes(20, std::byte{'x'}); });
    options.source.device = other.endpoint();
    options.live = live;
    const Result<void> done = view(options);
    EXPECT_EQ(done.error().kind, ErrorKind::unavailable);
    EXPECT_THAT(done.error().text, HasSubstr("is it another sonar?"));
  }
  FakeDevice standby(1, [](std::uint32_t, const oculus::FireSettings&) { return oculus::make_dummy(7001); });
  options.source.device = standby.endpoint();
  options.live = false;
  const Result<void> done = view(options);
  EXPECT_EQ(done.error().kind, ErrorKind::io);
  EXPECT_THAT(done.error().text, HasSubstr("no ping arrived within 1 s: is the sonar in standby?"));
}

TEST(Endpoints, UseTheDefaultForMissingParts) {
  const Endpoint fallback{"127.0.0.2", 52100};
  EXPECT_EQ(text_from(*parse_endpoint("", fallback)), "127.0.0.2:52100");
  EXPECT_EQ(text_from(*parse_endpoint("10.0.0.7", fallback)), "10.0.0.7:52100");
  EXPECT_EQ(text_from(*parse_endpoint("10.0.0.7:99", fallback)), "10.0.0.7:99");
  EXPECT_EQ(text_from(*parse_endpoint(":99", fallback)), "127.0.0.2:99");
  for (const char* bad : {"host:", "host:0", "host:65536", "host:12x"}) EXPECT_FALSE(parse_endpoint(bad, fallback)) << bad;
}

/// Runs `send_poses` and returns its first datagram.
wire::Bytes first_datagram(PoseOptions options) {
  std::uint16_t port = 0;
  const Socket listener = bound(SOCK_DGRAM, port);
  options.to = "127.0.0.2:" + std::to_string(port);
  const Result<void> sent = send_poses(options);
  EXPECT_TRUE(sent) << sent.error().text;
  wire::Bytes datagram(2000);
  datagram.resize(read_some(listener, datagram, std::chrono::seconds(10)).size);
  return datagram;
}

void expect_at(const control::PoseSample& sample, Vec3d position, Vec3d ahead) {
  const Pose& pose = sample.pose;
  EXPECT_NEAR(length(pose.position_m - position), 0, 1e-9);
  EXPECT_NEAR(length(rotate(pose.orientation, Vec3d{1, 0, 0}) - ahead), 0, 1e-6);
}

TEST(Pose, ArrivesAsProtobufInTheFrameItWasGivenIn) {
  PoseOptions options;
  options.position_m = {1, 2, -3};
  options.rpy_deg = {0, 0, 90};  // east-north-up: facing north
  const auto enu = control::decode_pose_datagram(first_datagram(options));
  ASSERT_TRUE(enu) << enu.error().text;
  EXPECT_EQ(enu->sent_in, control::Frame::enu_flu);
  expect_at(*enu, {1, 2, -3}, {0, 1, 0});

  options.frame = control::Frame::ned_frd;  // north 1, east 2, up 3, facing east
  const auto ned = control::decode_pose_datagram(first_datagram(options));
  ASSERT_TRUE(ned) << ned.error().text;
  EXPECT_EQ(ned->sent_in, control::Frame::ned_frd);
  expect_at(*ned, {2, 1, 3}, {1, 0, 0});
}

TEST(Pose, ArrivesAsAJsonLineInEitherFrame) {
  for (const control::Frame frame : {control::Frame::enu_flu, control::Frame::ned_frd}) {
    PoseOptions options;
    options.json = true;
    options.frame = frame;
    options.path = PoseOptions::Path::line;
    options.from_m = {0, 0, -4};
    options.to_m = {0, 0.01, -4};
    const wire::Bytes datagram = first_datagram(options);
    std::string line;
    for (const std::byte b : datagram) line.push_back(static_cast<char>(b));
    const auto sample = control::parse_json_pose(line);
    ASSERT_TRUE(sample) << sample.error().text;
    EXPECT_EQ(sample->sent_in, frame);
    ASSERT_TRUE(sample->velocity_mps);
    EXPECT_NEAR(sample->velocity_mps->x, 0.5, 1e-9) << "ahead, in body axes";
    if (frame == control::Frame::enu_flu) {
      expect_at(*sample, {0, 0, -4}, {0, 1, 0});
    } else {
      expect_at(*sample, {0, 0, 4}, {1, 0, 0});
    }
  }
}

TEST(Pose, FailsWithoutAListenerOrWithContradictoryOptions) {
  std::uint16_t free_port = 0;
  { const Socket briefly = bound(SOCK_DGRAM, free_port); }
  PoseOptions options;
  options.to = "127.0.0.2:" + std::to_string(free_port);
  EXPECT_THAT(send_poses(options).error().text, HasSubstr("no program listens"));
  options.vehicle = "rov";
  options.object = "diver";
  EXPECT_EQ(send_poses(options).error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace sonar::clients
