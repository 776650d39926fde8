// Tests HTTP resources of a made-up make of sonar, end to end, and receivers of datagrams that clients set over HTTP.
#include <gmock/gmock.h>

#include <thread>

#include "tests/daemon/server/sonars/transports_testing.hpp"

namespace sonar::testing_daemon::transports_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string http(const std::string& address, const std::string& method, const std::string& path, const std::string& body = {},
                 const std::string& host = {}, const std::string& more = {}) {
  Client client(address, http_port);
  client.send(method + " " + path + " HTTP/1.1\r\nHost: " + (host.empty() ? address : host) + "\r\n" + more +
              "Connection: close\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  return text_of(client.read_raw(std::size_t{1} << 20));
}
std::string body_of(const std::string& answer) { return answer.substr(std::min(answer.find("\r\n\r\n") + 4, answer.size())); }

TEST(Transports, HttpReadsAndChangesTheDevice) {
  Daemon daemon(made_up());
  const std::string& at = daemon.address();
  EXPECT_EQ(body_of(http(at, "GET", "/range")), "5");
  const std::string changed = http(at, "PUT", "/range", "7");
  EXPECT_THAT(changed, StartsWith("HTTP/1.1 204 "));
  EXPECT_EQ(body_of(changed), "");
  EXPECT_THAT(changed, ::testing::Not(HasSubstr("Content-Length")));
  EXPECT_EQ(body_of(http(at, "GET", "/range?unit=m")), "7");
  EXPECT_THAT(http(at, "PUT", "/range", "-1"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(http(at, "GET", "/none"), StartsWith("HTTP/1.1 404 "));
  const std::string wrong = http(at, "DELETE", "/range");
  EXPECT_THAT(wrong, StartsWith("HTTP/1.1 405 "));
  EXPECT_THAT(wrong, HasSubstr("Allow: GET, HEAD, PUT"));
  EXPECT_THAT(http(at, "PUT", "/range", std::string(2u << 20, 'x')), StartsWith("HTTP/1.1 413 "));

  UdpSocket receiver;
  EXPECT_THAT(http(at, "PUT", "/receivers", receiver.at()), StartsWith("HTTP/1.1 204 "));
  unsigned ping = 0;
  const std::string samples = next_ping(receiver, &ping);
  EXPECT_EQ(samples, pattern(ping));
  EXPECT_TRUE(asked_for_range(daemon, 7));
}

TEST(Transports, WebPagesReadAndChangeNothingOverHttp) {
  DaemonSetup setup = made_up();
  setup.edit_config = [edit = setup.edit_config](Config& config) {
    edit(config);
    config.control.hosts = {"sonar.lab"};
  };
  Daemon daemon(setup);
  const std::string& at = daemon.address();
  EXPECT_THAT(http(at, "GET", "/range", "", "evil.example"), StartsWith("HTTP/1.1 403 "))
      << "a foreign host name that resolves to this address";
  EXPECT_THAT(http(at, "PUT", "/range", "9", "", "Origin: http://evil.example\r\n"), StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(http(at, "PUT", "/range", "9", "", "Origin: null\r\n"), StartsWith("HTTP/1.1 403 "));
  EXPECT_EQ(body_of(http(at, "GET", "/range")), "5") << "refused requests change nothing";
  EXPECT_THAT(daemon.log_text(), HasSubstr("a page of Origin http://evil.example"));
  for (const std::string& host : {std::string("sonar.lab"), std::string("localhost:15080"), at + ":15080"})
    EXPECT_EQ(body_of(http(at, "GET", "/range", "", host)), "5") << host;
}

/// This holds for the ports of all makes: a request that a web page makes a browser send must have no effect and occupy no
/// driver's slot.
TEST(Transports, ARequestOfHttpEndsAClientsConnection) {
  Daemon daemon(made_up());
  for (const std::string method : {"GET", "POST", "HEAD", "PUT", "DELETE", "OPTIONS", "CONNECT", "TRACE", "PATCH"})
    for (const bool in_pieces : {false, true}) {
      Client page(daemon.address(), command_port);
      const std::string request = method + " / HTTP/1.1\r\nHost: x\r\n\r\nrange 9\n";
      page.send(request.substr(0, in_pieces ? 2 : request.size()));
      if (in_pieces) {
        std::this_thread::sleep_for(milliseconds(5));
        page.send(request.substr(2));
      }
      page.read_to_end();
      EXPECT_TRUE(page.ended || page.was_reset) << method;
      EXPECT_EQ(page.bytes_read, 0u) << method;
    }
  EXPECT_THAT(daemon.log_text(), HasSubstr("it speaks HTTP"));
  Client driver(daemon.address(), command_port);
  EXPECT_EQ(ask(driver, "who"), "front 5\n") << "the HTTP request set no range";
  EXPECT_EQ(ask(driver, "range 6"), "ok\n");
}

TEST(Transports, AReceiverWithAClosedPortGetsNothingUntilThePortOpens) {
  Daemon daemon(made_up());
  std::uint16_t port = 0;
  {
    UdpSocket receiver;
    port = receiver.port();
    EXPECT_THAT(http(daemon.address(), "PUT", "/receivers", receiver.at()), StartsWith("HTTP/1.1 204 "));
    next_ping(receiver);
  }
  const auto sent = [&] {
    std::uint64_t bytes = 0;
    daemon.on_io_thread([&] { bytes = daemon.app().devices().front().figures().bytes_written; });
    return bytes;
  };
  std::this_thread::sleep_for(milliseconds(200));  // the last ping is still being sent
  const auto before = sent();
  std::this_thread::sleep_for(milliseconds(1000));
  EXPECT_LT(sent() - before, 4u * 4000u) << "with an open port, 20 pings of 3200 bytes are sent";
  UdpSocket again("127.0.0.1", port);
  next_ping(again);
}

TEST(Transports, ClientsMaySetOnlyConfiguredBroadcastAddressesAndGroups) {
  for (const bool named : {false, true}) {
    Daemon daemon(made_up(named ? "    groups: [127.255.255.255]\n" : ""));
    UdpSocket everybody("127.255.255.255"), receiver;
    const auto port = std::to_string(everybody.port());
    EXPECT_THAT(http(daemon.address(), "PUT", "/receivers", receiver.at() + " 127.255.255.255:" + port + " 239.1.2.3:9999"),
                StartsWith("HTTP/1.1 204 "));
    next_ping(receiver);
    next_ping(receiver);
    EXPECT_EQ(everybody.next(named ? patience : milliseconds(200)).empty(), !named);
    EXPECT_THAT(daemon.log_text(), HasSubstr("sonars.groups"));
  }
}

}  // namespace
}  // namespace sonar::testing_daemon::transports_test
