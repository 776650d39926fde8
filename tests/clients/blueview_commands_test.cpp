// Tests listen, view and stats with a small made-up BlueView head, written from docs/protocols/blueview-link.md. The commands
// find the head, request every ping, and draw each sample at its position.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <functional>
#include <thread>

#include "clients/bvtsdk/core/description.hpp"
#include "clients/bvtsdk/core/polar_ping.hpp"
#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/source.hpp"
#include "protocol/blueview/frames.hpp"
#include "tests/clients/bound_socket.hpp"

namespace sonar::clients::blueview_commands_test {
namespace {

using blueview::FrameType;
using testing::HasSubstr;

const std::string address = "127.0.0.2";

Socket listening(std::uint16_t port) {
  Socket socket = bound_socket(address, SOCK_STREAM, port);
  ::listen(socket.fd(), 4);
  return socket;
}

wire::Bytes as_bytes(const bvt::Bytes& bytes) {
  wire::Bytes out;
  for (const std::uint8_t b : bytes) out.push_back(static_cast<std::byte>(b));
  return out;
}

bvt::SonarDescription description() {
  bvt::SonarDescription sonar;
  sonar.model = "BlueView P900-90";
  sonar.serial = "7001";
  bvt::HeadDescription head;
  head.id = 3;
  head.min_range_m = 0.5f, head.max_range_m = 100, head.start_m = 2, head.stop_m = 10;
  head.centre_hz = 900000;
  head.beams = 8;
  sonar.heads.push_back(head);
  return sonar;
}

/// Returns 8 beams from -40 to 40 degrees, 20 bins from 2 to 4 m; beam 6 (to starboard) is bright at 3.05 m.
bvt::PolarPing ping_of(std::uint32_t number) {
  bvt::PolarPing ping;
  ping.head = 3, ping.number = number;
  ping.start_m = 2, ping.stop_m = 4, ping.bin_m = 0.1f;
  ping.fov_min_deg = -40, ping.fov_max_deg = 40;
  ping.beams = 8, ping.bins = 20;
  ping.samples.assign(160, 100);
  ping.samples[6 * 20 + 10] = 65535;
  return ping;
}

/// Serves one host after another; stores the settings of a host and the number of its requests for pings.
class FakeHead {
 public:
  explicit FakeHead(bool closes = false) : listener_(listening(blueview::tcp_port)), closes_(closes) {
    thread_ = std::thread([this] { serve(); });
  }
  ~FakeHead() {
    stopping_ = true;
    ::shutdown(listener_.fd(), SHUT_RDWR);
    thread_.join();
  }
  std::atomic<int> pings{0}, settings{0};
  std::atomic<float> stop_m{0}, gain_db{0};
  std::atomic<bool> closes_at_settings{false};

 private:
  void serve() {
    while (!stopping_) {
      const Socket host(::accept4(listener_.fd(), nullptr, nullptr, SOCK_CLOEXEC));
      if (host.fd() < 0) return;
      if (!closes_) talk(host);
    }
  }
  void talk(const Socket& host) {
    blueview::Framer framer;
    std::array<std::byte, 4096> received;
    for (;;) {
      const Read read = read_some(host, received, std::chrono::seconds(10));
      if (read.what != Wait::data) return;
      framer.append(std::span<const std::byte>(received).first(read.size));
      while (const auto frame = framer.next()) {
        if (closes_at_settings && frame->header.type == FrameType::set) return;
        answer(host, *frame);
      }
    }
  }
  void answer(const Socket& host, const blueview::Frame& frame) {
    wire::Reader reader(frame.payload);
    wire::Bytes payload;
    std::int32_t head = 0;
    if (frame.header.type == FrameType::hello) {
      payload = as_bytes(bvt::encode_description(description()));
    } else if (frame.header.type == FrameType::keep_alive) {
      return;
    } else {
      reader("head", head);
      EXPECT_EQ(head, 3) << "the number that the greeting gave";
    }
    if (frame.header.type == FrameType::set) {
      blueview::Key key{};
      reader("key", key);
      const auto value = blueview::read_value(reader, key);
      ASSERT_TRUE(value);
      ++settings;
      if (key == blueview::Key::stop_range) stop_m = std::get<float>(*value);
      if (key == blueview::Key::gain) gain_db = std::get<float>(*value);
      blueview::put_value(payload, *value);
    }
    if (frame.header.type == FrameType::ping) payload = as_bytes(bvt::encode_ping(ping_of(static_cast<std::uint32_t>(++pings))));
    (void)write_all(host, blueview::make_frame(blueview::reply_to(frame.header.type), frame.header.request_id, payload));
  }

  Socket listener_;
  bool closes_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

SourceOptions anything_there() {
  SourceOptions source;
  source.device = {address, 0};
  source.silence_limit_s = 10;
  return source;
}

std::string captured(const std::function<Result<void>()>& command) {
  testing::internal::CaptureStdout();
  const Result<void> done = command();
  std::fflush(stdout);
  std::string text = testing::internal::GetCapturedStdout();
  EXPECT_TRUE(done) << done.error().text;
  return text;
}

TEST(BlueViewCommands, ListenFindsTheHeadAndRequestsEachPing) {
  FakeHead head;
  ListenOptions options;
  options.source = anything_there();
  options.pings = 5;
  const std::string text = captured([&] { return listen(options); });
  EXPECT_THAT(text, HasSubstr("connected to " + address + ":14750, BlueView P900-90, serial 7001"));
  EXPECT_THAT(text, HasSubstr("ping 5  20 x 8  16 bit  4.00 m  0.9000 MHz"));
  EXPECT_THAT(text, HasSubstr("pings 5\n"));
  for (const char* not_judged : {"missing ids", "identity errors", "echoed"})
    EXPECT_THAT(text, testing::Not(HasSubstr(not_judged))) << "figures that are not judged are not printed";
  EXPECT_EQ(head.pings, 5) << "no more pings than requested";
  EXPECT_EQ(head.settings, 0) << "no settings were requested";
}

TEST(BlueViewCommands, NoFileIsWrittenThatCouldNotBeRead) {
  FakeHead head;
  ListenOptions options;
  options.source = anything_there();
  options.pings = 2;
  options.record = std::filesystem::path(testing::TempDir()) / "blueview_commands.raw";
  const Result<void> done = listen(options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::usage);
  EXPECT_THAT(done.error().text, HasSubstr("only sonars that send pings without a request are recorded"));
  EXPECT_FALSE(std::filesystem::exists(options.record));
}

TEST(BlueViewCommands, SamplesHaveTheirRangeAndBearing) {
  FakeHead head;
  const auto ping = fetch_ping(anything_there(), 0);
  ASSERT_TRUE(ping) << ping.error().text;
  const auto image = ping->picture();
  ASSERT_TRUE(image) << image.error().text;
  EXPECT_EQ(image->rows, 20u);
  EXPECT_EQ(image->beams, 8u);
  EXPECT_NEAR(image->start_m, 2, 1e-6);
  EXPECT_NEAR(image->range_m(), 4, 1e-5);
  EXPECT_NEAR(deg_from_rad(image->azimuth_rad[6]), -25, 1e-4) << "to starboard";
  EXPECT_EQ(image->at(10, 6), 65535);
  EXPECT_EQ(image->at(6, 5), 100);

  ViewOptions view_options;
  view_options.source = anything_there();
  view_options.png = std::filesystem::path(testing::TempDir()) / "blueview_commands.png";
  view_options.style = {200, *find_colour_map("gray"), true};
  const std::string text = captured([&] { return view(view_options); });
  EXPECT_THAT(text, HasSubstr("20 rows x 8 beams, 4.00 m"));
  EXPECT_TRUE(std::filesystem::remove(view_options.png));
}

TEST(BlueViewCommands, StatsMeasureTheSamplesAsSent) {
  FakeHead head;
  StatsOptions options;
  options.source = anything_there();
  options.window = "10:11";  // the row of the bright sample
  options.json = true;
  const std::string text = captured([&] { return stats(options); });
  EXPECT_THAT(text, HasSubstr("\"mean\":8279.375"));
  EXPECT_THAT(text, HasSubstr("\"saturated_share\":0.125"));
}

TEST(BlueViewCommands, RequestedSettingsAreSent) {
  FakeHead head;
  SourceOptions source = anything_there();
  source.wanted.settings.range_m = 20;
  source.wanted.settings.gain_percent = 75;
  ASSERT_TRUE(fetch_ping(source, 0));
  EXPECT_EQ(head.stop_m, 20);
  EXPECT_EQ(head.gain_db, 24);
  source.wanted.settings.range_m = 101;
  EXPECT_THAT(fetch_ping(source, 0).error().text, HasSubstr("BlueView P900-90 has a range of 2 to 100 m"));
  source.wanted = {};
  source.wanted.settings.mode = 1;
  EXPECT_THAT(fetch_ping(source, 0).error().text, HasSubstr("has 1 head(s), no mode 2"));
  source.wanted = {};
  source.wanted.settings.beams = 256;
  const Error refused = fetch_ping(source, 0).error();
  EXPECT_EQ(refused.kind, ErrorKind::usage);
  EXPECT_THAT(refused.text, HasSubstr("--beams does not apply to a BlueView sonar, which has --range, --rate, --gain, --mode"));
}

TEST(BlueViewCommands, AServiceThatIsNotAHeadIsReported) {
  SourceOptions source = anything_there();
  source.connect_patience_s = 0.1;
  const std::string refused = fetch_ping(source, 0).error().text;
  EXPECT_THAT(refused,
              HasSubstr("cannot connect to tcp " + address + ":52100 or " + address + ":14750 or " + address + ":56888 or "));
  EXPECT_THAT(refused, HasSubstr(": Connection refused"));
  {
    FakeHead full(true);
    const Error closed = fetch_ping(source, 0).error();
    EXPECT_EQ(closed.kind, ErrorKind::io);
    EXPECT_THAT(closed.text, HasSubstr("all its client slots are taken (clients.max)"));
  }
  {
    FakeHead stops;
    stops.closes_at_settings = true;
    SourceOptions with_range = source;
    with_range.wanted.settings.range_m = 20;
    const Error closed = fetch_ping(with_range, 0).error();
    EXPECT_EQ(closed.kind, ErrorKind::io);
    EXPECT_THAT(closed.text, HasSubstr("closed the connection before it took the settings: the daemon stopped, or closed it"));
  }
  const Socket listener = listening(blueview::tcp_port);
  std::thread other([&listener] {
    const Socket client(::accept4(listener.fd(), nullptr, nullptr, SOCK_CLOEXEC));
    const std::string greeting = "220 mail.example ESMTP ready";
    (void)write_all(client, std::as_bytes(std::span(greeting.data(), greeting.size())));
    std::array<std::byte, 512> received;
    while (read_some(client, received, std::chrono::seconds(10)).what == Wait::data) continue;
  });
  const Error other_service = fetch_ping(source, 0).error();
  other.join();
  EXPECT_EQ(other_service.kind, ErrorKind::bad_data);
  EXPECT_THAT(other_service.text, HasSubstr("tcp " + address + ":14750 is not a BVE1 link"));
}

}  // namespace
}  // namespace sonar::clients::blueview_commands_test
