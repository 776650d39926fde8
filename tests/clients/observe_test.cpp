// Tests sonarctl as an observer of a made-up sonard, which has a control stream and a port for observers.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <thread>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/record.hpp"
#include "clients/sonarctl/source.hpp"
#include "protocol/control/control.hpp"
#include "protocol/oculus/encode_ping.hpp"
#include "tests/clients/bound_socket.hpp"
#include "tests/clients/made_up_ping.hpp"
#include "tests/protocol/control/message_from.hpp"

namespace sonar::clients::observe_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// Serves each connection to a free port of 127.0.0.2 in turn.
class Server : public SocketServer {
 public:
  explicit Server(Serve serve) : SocketServer("127.0.0.2", 0, std::move(serve)) {}
};

/// Reads until the client leaves.
void drain(const Socket& client) {
  std::array<std::byte, 512> received;
  while (read_some(client, received, 20s).what == Wait::data) continue;
}

/// Sends one message without a ping, and nothing more.
void send_a_dummy(const Socket& client) {
  static_cast<void>(write_all(client, oculus::make_dummy(7001)));
  drain(client);
}

/// Answers requests for the status with that of an Oculus. After `answers` of them, connections are closed.
class Control {
 public:
  Control(const std::string& observers, int answers, const std::string& listens)
      : Control(R"(sonars { name: "front" profile: "oculus-m1200d" observing: 1 listens: ")" + listens + R"(" observers: ")" +
                    observers + R"(" })",
                answers) {}
  Control(const std::string& status, int answers)
      : status_(control::message_from<v1::DaemonStatus>(status)),
        answers_(answers),
        server_([this](const Socket& client) { serve(client); }) {}
  int asked() const { return asked_; }
  std::string at() const { return server_.at(); }

 private:
  void serve(const Socket& client) {
    control::DelimitedParser parser;
    std::array<std::byte, 4096> chunk;
    while (asked_ < answers_) {
      const Read read = read_some(client, chunk, 20s);
      if (read.what != Wait::data) return;
      parser.feed(std::span<const std::byte>(chunk).first(read.size));
      while (const auto message = parser.next()) {
        if (!*message) break;
        const auto request = control::decode_request(**message);
        if (!request) return;
        v1::Response response = control::response_of(request->id, control::StatusCode::ok);
        if (std::holds_alternative<control::GetStatus>(request->op)) *response.mutable_daemon() = status_, ++asked_;
        static_cast<void>(write_all(client, control::delimited(control::encode_response(std::move(response)))));
      }
    }
  }

  v1::DaemonStatus status_;
  int answers_;
  std::atomic<int> asked_ = 0;
  Server server_;
};

SourceOptions observing(const Control& control) {
  SourceOptions source;
  source.device = {"127.0.0.2", 52100};
  source.observe = true;
  source.control = control.at();
  source.silence_limit_s = 0.5;
  return source;
}

TEST(Observe, WaitsWithoutPingsAsLongAsSonardAnswers) {
  const std::string folder = testing::TempDir();
  const std::vector<std::pair<const char*, std::function<Result<void>(const SourceOptions&)>>> commands{
      {"listen",
       [](const SourceOptions& source) {
         ListenOptions options;
         options.source = source;
         options.seconds = 30;
         return listen(options);
       }},
      {"view --live",
       [&](const SourceOptions& source) {
         ViewOptions options;
         options.source = source;
         options.live = true;
         options.png = folder + "/observe_test.png";
         return view(options);
       }},
      {"record", [&](const SourceOptions& source) {
         RecordOptions options;
         options.source = source;
         options.seconds = 30;
         options.status = false;
         options.raw = folder + "/observe_test.raw";
         const Result<void> done = record(options);
         std::filesystem::remove(options.raw);
         return done;
       }}};
  for (const auto& [name, command] : commands) {
    SCOPED_TRACE(name);
    const Server observers(send_a_dummy);
    const Control control(observers.at(), 4, "127.0.0.2:52100");  // before the connection, and after each of three silences
    const auto begin = std::chrono::steady_clock::now();
    const Result<void> done = command(observing(control));
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().kind, ErrorKind::io);
    EXPECT_THAT(done.error().text, testing::AnyOf(HasSubstr("nothing more arrived"), HasSubstr("not a byte from the device")));
    EXPECT_EQ(control.asked(), 4);
    EXPECT_GE(std::chrono::steady_clock::now() - begin, 4 * 500ms);
  }
}

TEST(Observe, ASinglePictureReportsTheTimeOfWaiting) {
  const Server observers(send_a_dummy);
  const Control control(observers.at(), 1, "127.0.0.2:52100");
  ViewOptions options;
  options.source = observing(control);
  options.source.silence_limit_s = 1;
  options.png = testing::TempDir() + "/observe_test.png";
  testing::internal::CaptureStderr();
  EXPECT_FALSE(view(options));
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("; nothing requested; waiting for the first one, at most 1 s\n"));
}

TEST(Observe, TheSonarsOrTheObserversPortCanBeGiven) {
  const Server observers(send_a_dummy);
  for (const std::string& named : {std::string("127.0.0.2:52100"), observers.at()}) {
    const Control control(observers.at(), 1, "127.0.0.2:52100");
    SourceOptions source = observing(control);
    source.device = *parse_endpoint(named, {});
    const auto opened = open_stream(source, source.device);
    ASSERT_TRUE(opened) << opened.error().text;
    EXPECT_EQ(text_from(opened->again), "127.0.0.2:52100");
    EXPECT_EQ(text_from(opened->stream.device()), observers.at());
  }
}

/// Sends a ping, then ends the connection.
void send_a_ping(const Socket& client) {
  static_cast<void>(write_all(client, ping_bytes(1, {})));
  ::shutdown(client.fd(), SHUT_WR);
  drain(client);
}

/// Runs `listen`, which is a client if the sonar has a free slot, and connects again. Returns the result, and the error output.
std::pair<Result<void>, std::string> listen_beside_a_driver(const Server& sonar, const Control& control) {
  ListenOptions options;
  options.source = observing(control);
  options.source.observe = false;
  options.source.device = *parse_endpoint(sonar.at(), {});
  options.source.make = find_make("oculus");
  options.source.return_limit_s = 10;
  options.source.connect_patience_s = 0.5;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const Result<void> done = listen(options);
  testing::internal::GetCapturedStdout();
  return {done, testing::internal::GetCapturedStderr()};
}

std::size_t times(const std::string& words, const std::string& text) {
  std::size_t found = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++found;
  return found;
}

TEST(Observe, AClientThatReturnsAsAnObserverWaits) {
  const Server observers(send_a_dummy);
  std::atomic<int> visits = 0;
  const Server sonar([&](const Socket& client) {
    if (visits++ == 0) send_a_ping(client);  // later the slot is taken
  });
  const Control control(observers.at(), 4, sonar.at());
  const auto [done, said] = listen_beside_a_driver(sonar, control);
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().text, HasSubstr("it did not come back within 10 s"));
  EXPECT_EQ(times("connected again", said), 1u) << said;
  EXPECT_EQ(control.asked(), 4);
}

TEST(Observe, AnObserverThatReturnsAsAClientDoesNotWait) {
  const Server observers(send_a_ping);
  std::atomic<int> visits = 0;
  const Server sonar([&](const Socket& client) {
    if (visits++ == 1) send_a_dummy(client);
  });
  const Control control(observers.at(), 1, sonar.at());
  const auto [done, said] = listen_beside_a_driver(sonar, control);
  ASSERT_FALSE(done);
  EXPECT_THAT(said, HasSubstr("connected again to " + sonar.at()));
  EXPECT_THAT(done.error().text, HasSubstr("nothing more arrived within 0.5 s")) << said;
}

/// Observes the sonar at this address, one of three; returns the error.
Error error_at(const Endpoint& device, const char* make = nullptr) {
  const Control control(
      R"(sonars { name: "front" profile: "oculus-m1200d" listens: "127.0.0.2:52100"
           addresses { protocol: "tcp" address: "127.0.0.2:52100" } addresses { protocol: "status" address: "127.0.0.3:52102" }
           addresses { protocol: "multicast" address: "127.0.0.4:4747" } }
         sonars { name: "scan" profile: "ping360" addresses { protocol: "udp" address: "127.0.0.3:12345" } }
         sonars { name: "side" profile: "omniscan-450" listens: "127.0.0.3:51200"
           addresses { protocol: "tcp" address: "127.0.0.3:51200" } })",
      1);
  SourceOptions source = observing(control);
  if (make != nullptr) source.make = find_make(make);
  const auto opened = open_stream(source, device);
  return opened ? Error{} : opened.error();
}

TEST(Observe, TheAddressIsTheSonarsNotTheReceivers) {
  const Error several = error_at({"127.0.0.3", 0});
  EXPECT_EQ(several.kind, ErrorKind::usage);
  EXPECT_THAT(several.text, testing::EndsWith("with its port: 127.0.0.3:12345 (scan), 127.0.0.3:51200 (side)"));
  EXPECT_THAT(error_at({"127.0.0.4", 0}).text, HasSubstr(" serves no sonar at 127.0.0.4;"));
}

TEST(Observe, AMakeSelectsOneOfSeveralSonarsAtAnAddress) {
  EXPECT_THAT(error_at({"127.0.0.3", 0}, "omniscan450").text, HasSubstr("side, an Omniscan, accepts no observers"));
  EXPECT_THAT(error_at({"127.0.0.3", 0}, "ping360").text, HasSubstr("scan, a Ping360, accepts no observers"));
  EXPECT_THAT(error_at({"127.0.0.3", 51200}, "ping360").text,
              HasSubstr(" serves no sonar of the make ping360 at 127.0.0.3:51200;"));
}

}  // namespace
}  // namespace sonar::clients::observe_test
