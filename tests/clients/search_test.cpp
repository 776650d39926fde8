// PingStream searches for a sonar if no port is given. Small test servers stand in for some makes.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <memory>
#include <thread>

#include "clients/sonarctl/doctor/probes.hpp"
#include "clients/sonarctl/ping_stream.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/oculus/messages.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/ping/messages.hpp"
#include "tests/clients/bound_socket.hpp"

namespace sonar::clients::search_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const std::string address = "127.0.0.9";

Socket bound(int type, std::uint16_t port) { return bound_socket(address, type, port); }

/// Answers like a web server that refuses. Returns false if the client disconnected without a request.
bool refuse_as_a_web_server(const Socket& client) {
  std::array<std::byte, 1024> request;
  if (read_some(client, request, 60s).what != Wait::data) return false;
  const std::string reply = "HTTP/1.0 404 Not Found\r\nContent-Type: text/html\r\n\r\n<h1>no such page</h1>";
  return write_all(client, std::as_bytes(std::span(reply.data(), reply.size()))).has_value();
}

/// A stand-in for a Ping360, which answers if `answers` is set; it stores the ids of received messages.
class Ping360 {
 public:
  explicit Ping360(bool answers) : socket_(bound(SOCK_DGRAM, 12345)) {
    thread_ = std::thread([this, answers] { serve(answers); });
  }
  /// Stops the server, and returns the ids of all received messages.
  std::vector<ping::Id> received() {
    if (thread_.joinable()) {
      const auto last = connect_udp({address, 12345});
      static_cast<void>(write_all(*last, ping::framed(ping::Id::reset, 0, {})));  // after the others
      thread_.join();
    }
    return ids_;
  }
  ~Ping360() { received(); }

 private:
  void serve(bool answers) {
    for (;;) {
      std::array<std::byte, 2048> datagram;
      sockaddr_in from{};
      socklen_t length = sizeof from;
      const ssize_t size =
          ::recvfrom(socket_.fd(), datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
      if (size < 0) return;
      ping::Framer framer{65535};
      framer.append(std::span<const std::byte>(datagram).first(static_cast<std::size_t>(size)));
      const auto frame = framer.next();
      if (!frame) continue;
      if (frame->header.id == ping::Id::reset) return;
      ids_.push_back(frame->header.id);
      if (!answers || frame->header.id != ping::Id::general_request) continue;
      const wire::Bytes version = ping::framed(ping::Id::protocol_version, 1, std::array<std::byte, 4>{std::byte{1}});
      ::sendto(socket_.fd(), version.data(), version.size(), 0, reinterpret_cast<const sockaddr*>(&from), length);
    }
  }

  Socket socket_;
  std::vector<ping::Id> ids_;
  std::thread thread_;
};

Wanted with_rate() {
  Wanted wanted;
  wanted.settings.rate_hz = 5;
  return wanted;
}

TEST(Search, ReportsAnUnknownHostAndAMissingRoute) {
  for (const Make& make : protocol::makes()) {
    const auto unnamed = PingStream::open({"no-such-host.invalid", 0}, &make, {}, 100ms);
    ASSERT_FALSE(unnamed);
    EXPECT_EQ(unnamed.error().kind, ErrorKind::usage) << unnamed.error().text;
  }
  const auto far = PingStream::open({"10.1.1.1", 0}, nullptr, {}, 100ms);
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().kind, ErrorKind::unavailable) << far.error().text;
}

TEST(Search, RefusesSettingsOnlyIfASonarAnswers) {
  for (const std::uint32_t mode : {0u, 1u}) {
    Wanted wanted = with_rate();
    wanted.settings.mode = mode;
    const auto nothing = PingStream::open({address, 0}, nullptr, wanted, 100ms);
    ASSERT_FALSE(nothing);
    EXPECT_EQ(nothing.error().kind, ErrorKind::unavailable) << nothing.error().text;
    EXPECT_THAT(nothing.error().text, HasSubstr("cannot connect to tcp " + address + ":52100"));
    EXPECT_THAT(nothing.error().text, HasSubstr(". No sonar answered at "));
    EXPECT_THAT(nothing.error().text, HasSubstr("udp " + address + ":12345"));
    EXPECT_THAT(nothing.error().text, HasSubstr(" either; on a busy computer, name the make (--make)"));
  }
  Ping360 sonar(true);
  const auto refused = PingStream::open({address, 0}, nullptr, with_rate(), 60s);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
  EXPECT_THAT(refused.error().text, HasSubstr("--rate does not apply to a Ping360"));
  EXPECT_THAT(sonar.received(), testing::Each(ping::Id::general_request)) << "its scan continues";
}

TEST(Search, StopsOnlyScansThatItStarted) {
  Ping360 of_another_driver(false);
  EXPECT_FALSE(PingStream::open({address, 0}, find_make("ping360"), {}, 100ms));
  EXPECT_THAT(of_another_driver.received(), testing::ElementsAre(ping::Id::general_request));
  for (const bool as_it_is : {true, false}) {
    SCOPED_TRACE(as_it_is);
    Ping360 sonar(true);
    Wanted wanted;
    wanted.as_it_is = as_it_is;
    EXPECT_TRUE(PingStream::open({address, 0}, find_make("ping360"), wanted, 60s));
    if (as_it_is)
      EXPECT_THAT(sonar.received(), testing::ElementsAre(ping::Id::general_request));
    else
      EXPECT_THAT(sonar.received(),
                  testing::ElementsAre(ping::Id::general_request, ping::Id::auto_transmit, ping::Id::motor_off));
  }
}

TEST(Search, NoticesWithoutARequestThatAUdpSonarIsGone) {
  auto sonar = std::make_unique<Ping360>(true);
  auto stream = PingStream::open({address, 0}, find_make("ping360"), {}, 60s);
  ASSERT_TRUE(stream) << stream.error().text;
  EXPECT_EQ(stream->next(1200ms).what, Wait::timed_out);
  EXPECT_THAT(sonar->received(), testing::ElementsAre(ping::Id::general_request, ping::Id::auto_transmit))
      << "a request would take the sonar from another driver";
  sonar.reset();
  const PingStream::Item end = stream->next(60s);
  EXPECT_EQ(end.what, Wait::closed);
  EXPECT_THAT(end.error, HasSubstr("refused"));
}

TEST(Search, ContinuesBesideAWebServer) {
  std::atomic<int> requests = 0;
  Socket sonar = bound(SOCK_STREAM, oculus::tcp_port);
  const SocketServer web(address, 80, [&](const Socket& client) {
    if (refuse_as_a_web_server(client) && ++requests == 1) ::listen(sonar.fd(), 4);
  });
  const auto found = PingStream::open({address, 0}, nullptr, {}, 60s);
  ASSERT_TRUE(found) << found.error().text;
  EXPECT_EQ(found->make().name(), "oculus");
  EXPECT_EQ(requests, 1);
}

TEST(Search, DoesNotMistakeAWebServerForASonar) {
  const SocketServer web(address, 80, refuse_as_a_web_server);
  const auto nothing = PingStream::open({address, 0}, nullptr, {}, 100ms);
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(nothing.error().text, HasSubstr("cannot connect to tcp " + address + ":52100"));
  const auto named = PingStream::open({address, 0}, find_make("waterlinked"), {}, 100ms);
  ASSERT_FALSE(named);
  EXPECT_THAT(named.error().text, HasSubstr("is not a Sonar 3D-15"));
}

/// If a sonar closes without an answer, the client may ask sonard where observers connect.
TEST(Search, NamesASonarThatClosesTheConnectionWithoutAnAnswer) {
  for (const bool answers : {false, true}) {
    SCOPED_TRACE(answers);
    const SocketServer full(address, find_make("omniscan450")->ports.front().number, [answers](const Socket& client) {
      std::array<std::byte, 1024> request;
      const std::array first{std::byte{'B'}};  // the first byte of a message, without the rest
      if (!answers) return;
      static_cast<void>(read_some(client, request, 60s));
      static_cast<void>(write_all(client, first));
    });
    for (const Make* const make : {static_cast<const Make*>(nullptr), find_make("omniscan450")}) {
      Rejection rejection;
      const auto closed = PingStream::open({address, 0}, make, {}, 60s, false, &rejection);
      ASSERT_FALSE(closed);
      EXPECT_EQ(closed.error().kind, ErrorKind::io) << closed.error().text;
      EXPECT_EQ(rejection.make != nullptr, !answers) << closed.error().text;
      if (rejection.make == nullptr) continue;
      EXPECT_EQ(rejection.make->name(), "omniscan450");
      EXPECT_EQ(text_from(rejection.at), address + ":51200");
    }
  }
}

/// With the limit of 1 h, the test ends in time only if the call does not wait.
TEST(PingStream, AByteAtAnotherPortShowsThatTheSonarDoesNotReject) {
  std::array<int, 2> first{}, other{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, first.data()), 0);
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_DGRAM, 0, other.data()), 0);
  std::optional<Socket> first_far(first[1]);
  const Socket first_near(first[0]), other_far(other[1]), other_near(other[0]);
  const std::array<int, 1> others{other_near.fd()};
  EXPECT_FALSE(ends_without_a_byte(first_near, others, 1ms)) << "silence";
  first_far.reset();
  EXPECT_TRUE(ends_without_a_byte(first_near, others, 1h));
  std::array<int, 2> silent{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, silent.data()), 0);
  const Socket silent_near(silent[0]), silent_far(silent[1]);
  ASSERT_EQ(::send(other_far.fd(), "x", 1, 0), 1);
  EXPECT_FALSE(ends_without_a_byte(silent_near, others, 1h));
}

TEST(WatchPings, KeepsTheReasonOfARefusal) {
  const SocketServer surveyor(address, 62312, [](const Socket& client) {
    std::array<std::byte, 1024> request;
    if (read_some(client, request, 60s).what != Wait::data) return;
    wire::Bytes why{std::byte{0}, std::byte{0}};
    for (const char c : std::string("wrong range")) why.push_back(static_cast<std::byte>(c));
    static_cast<void>(write_all(client, ping::framed(ping::Id::nack, 0, why)));
    while (read_some(client, request, 60s).what == Wait::data) continue;
  });
  doctor::SonarFacts sonar;
  sonar.at = {address, 62312};
  sonar.make = make_at(62312);
  doctor::ControlFacts clocks;
  doctor::watch_pings(sonar, nullptr, doctor::Steady::now() + 60s, clocks);
  EXPECT_EQ(sonar.stream.outcome, doctor::StreamFacts::Outcome::no_ping);
  EXPECT_TRUE(sonar.stream.refuses);
  EXPECT_EQ(sonar.stream.error, "a Surveyor refuses a request: wrong range");
  EXPECT_THAT(sonar.stream.own, testing::StartsWith("127.0.0.1:"));
}

}  // namespace
}  // namespace sonar::clients::search_test
