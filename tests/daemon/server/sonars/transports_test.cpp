// Every kind of port, served end to end by a made-up make of sonar: TCP streams, a beacon, datagrams that are answered,
// pings as datagrams to receivers and to a multicast group, HTTP resources, and conversations across them.
#include <gmock/gmock.h>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>

#include "daemon/config/addresses.hpp"
#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"
#include "tests/daemon/server/sonars/made_up_vendor.hpp"

namespace sonar::testing_daemon::transports_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

DaemonSetup made_up(const std::string& more = {}) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 2}\n    status_to: ['127.0.0.1:0']\n" + more;
  setup.edit_config = [](Config& config) {
    config.sonars.front().profile = {&made_up_vendor(), made_up_vendor().models().front()};
    config.sonars.front().options.clear();
  };
  return setup;
}

std::string text_of(const std::vector<std::byte>& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

class UdpSocket {
 public:
  explicit UdpSocket(const std::string& address = "127.0.0.1", std::uint16_t port = 0) {
    fd_ = socket(AF_INET, SOCK_DGRAM, 0);
    const int on = 1, room = 1 << 20;
    setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
    sockaddr_in at = address_of(address, port);
    if (bind(fd_, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0) ADD_FAILURE() << "cannot bind " << address;
    socklen_t size = sizeof at;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
  }
  ~UdpSocket() { ::close(fd_); }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  bool sends_multicast_from(const std::string& interface) {
    const sockaddr_in from = address_of(interface, 0);
    return setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &from.sin_addr, sizeof from.sin_addr) == 0;
  }
  bool join(const std::string& group, const std::string& interface) {
    ip_mreq wanted{};
    inet_pton(AF_INET, group.c_str(), &wanted.imr_multiaddr);
    inet_pton(AF_INET, interface.c_str(), &wanted.imr_interface);
    return setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &wanted, sizeof wanted) == 0;
  }
  void send(const std::string& text, const std::string& address, std::uint16_t port) {
    const sockaddr_in to = address_of(address, port);
    sendto(fd_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  /// Returns the next datagram; empty at the deadline.
  std::string next(milliseconds timeout = patience) {
    pollfd p{fd_, POLLIN, 0};
    if (poll(&p, 1, static_cast<int>(timeout.count())) <= 0) return {};
    std::string bytes(65536, '\0');
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const auto n = recvfrom(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    std::array<char, INET_ADDRSTRLEN> ip{};
    inet_ntop(AF_INET, &from.sin_addr, ip.data(), ip.size());
    sender = std::string(ip.data()) + ":" + std::to_string(ntohs(from.sin_port));
    return bytes;
  }
  std::uint16_t port() const { return port_; }
  std::string at() const { return "127.0.0.1:" + std::to_string(port_); }
  std::string sender;  // sender of the last datagram

 private:
  static sockaddr_in address_of(const std::string& address, std::uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    inet_pton(AF_INET, address.c_str(), &at.sin_addr);
    return at;
  }
  int fd_ = -1;
  std::uint16_t port_ = 0;
};

struct Part {
  unsigned ping = 0, part = 0, parts = 0;
  std::string samples;
};
Part part_of(const std::string& datagram) {
  Part part;
  EXPECT_EQ(std::sscanf(datagram.c_str(), "PING %u %u %u", &part.ping, &part.part, &part.parts), 3) << datagram;
  part.samples = datagram.substr(datagram.find('\n') + 1);
  return part;
}

/// The samples of the next whole ping.
std::string next_ping(UdpSocket& from, unsigned* number = nullptr) {
  Part part = part_of(from.next());
  while (part.part != 0) part = part_of(from.next());
  const unsigned ping = part.ping;
  std::string samples = part.samples;
  while (part.part + 1 < part.parts) {
    const Part next = part_of(from.next());
    EXPECT_EQ(next.ping, ping) << "pings are not mixed";
    EXPECT_EQ(next.part, part.part + 1);
    if (next.ping != ping) return {};
    samples += next.samples;
    part = next;
  }
  if (number != nullptr) *number = ping;
  return samples;
}

std::string pattern(unsigned ping, std::size_t rows = 100, std::size_t beams = 32) {
  std::string samples;
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t b = 0; b < beams; ++b) samples += static_cast<char>(FakeEngine::sample(ping, r, b));
  return samples;
}

std::string ask(Client& client, const std::string& line) {
  client.send(line + "\n");
  return text_of(client.read_raw(3));
}

/// A ping that was being computed when the range changed still has the earlier range.
bool asked_for_range(Daemon& daemon, double metres) {
  return eventually([&] { return daemon.requests().back().settings.range_m == metres; });
}

TEST(Transports, ATcpCommandNamesAReceiverOfDatagramsUntilItsConnectionEnds) {
  Daemon daemon(made_up());
  UdpSocket receiver;
  auto client = std::make_unique<Client>(daemon.address(), command_port);
  EXPECT_EQ(ask(*client, "range 8"), "ok\n");
  EXPECT_EQ(ask(*client, "receivers 0.0.0.0:" + std::to_string(receiver.port())), "ok\n") << "the host's own address";
  unsigned ping = 0;
  for (int i = 0; i < 3; ++i) {
    const std::string samples = next_ping(receiver, &ping);
    EXPECT_EQ(samples, pattern(ping));
    EXPECT_EQ(receiver.sender, daemon.address() + ":" + std::to_string(udp_port));
  }
  EXPECT_TRUE(asked_for_range(daemon, 8));
  client.reset();
  EXPECT_TRUE(eventually([&] { return receiver.next(milliseconds(500)).empty(); })) << "its list of receivers ended with it";
  daemon.stop();
  const DeviceFigures f = daemon.figures();
  EXPECT_EQ(f.offered, f.sent + f.dropped);
  EXPECT_EQ(f.latency.count(), f.sent);
}

TEST(Transports, ReceiversOfSeveralConnectionsGetTheSameDatagrams) {
  Daemon daemon(made_up());
  UdpSocket one, other;
  Client first(daemon.address(), command_port), second(daemon.address(), command_port);
  EXPECT_EQ(ask(first, "receivers " + one.at()), "ok\n");
  EXPECT_EQ(ask(second, "receivers " + other.at() + " " + one.at()), "ok\n") << "each address once";
  unsigned ping = 0, same = 0;
  const std::string samples = next_ping(other, &ping);
  EXPECT_EQ(samples, pattern(ping));
  while (same < ping) next_ping(one, &same);
  EXPECT_EQ(same, ping);
  next_ping(one, &same);
  EXPECT_GT(same, ping) << "not twice";
}

TEST(Transports, TwoTcpPortsHaveConversationsOfTheirOwn) {
  Daemon daemon(made_up());
  Client data(daemon.address(), data_port), commands(daemon.address(), command_port);
  EXPECT_EQ(ask(commands, "jump"), "no: unknown command\n");
  const std::string head = "PING ";
  const std::string received = text_of(data.read_raw(2 * (3200 + 12)));
  ASSERT_THAT(received, StartsWith(head));
  unsigned ping = 0, size = 0;
  ASSERT_EQ(std::sscanf(received.c_str(), "PING %u %u", &ping, &size), 2);
  const std::size_t at = received.find('\n') + 1;
  EXPECT_EQ(received.substr(at, size), pattern(ping));
  EXPECT_THAT(received.substr(at + size), StartsWith(head + std::to_string(ping + 1)));
  EXPECT_EQ(ask(commands, "range 3"), "ok\n") << "no ping came between";
  EXPECT_EQ(daemon.status().sonars(0).listens(), daemon.address() + ":15000");
}

TEST(Transports, DatagramsAreAnsweredAndSetTheDevicesOwnReceivers) {
  Daemon daemon(made_up());
  UdpSocket host;
  host.send("who", daemon.address(), udp_port);
  EXPECT_EQ(host.next(), "front 5\n");
  EXPECT_EQ(host.sender, daemon.address() + ":" + std::to_string(udp_port));
  host.send("fault", daemon.address(), udp_port);
  host.send("range 7", daemon.address(), udp_port);
  EXPECT_EQ(host.next(), "ok\n") << "a mistake in the vendor's code costs one datagram";
  EXPECT_THAT(daemon.log_text(), HasSubstr("internal fault: a mistake in the vendor's code"));
  host.send("receivers " + host.at(), daemon.address(), udp_port);
  EXPECT_EQ(host.next(), "ok\n");
  unsigned ping = 0;
  const std::string samples = next_ping(host, &ping);
  EXPECT_EQ(samples, pattern(ping));
  host.send("receivers", daemon.address(), udp_port);
  EXPECT_TRUE(eventually([&] { return host.next(milliseconds(500)).empty(); }));
}

DaemonSetup limited(const std::string& limits) {
  DaemonSetup setup = made_up();
  setup.more = "limits: {" + limits + "}\n";
  return setup;
}

TEST(Transports, AFloodOfDatagramsIsDroppedAndAnotherHostIsAnswered) {
  Daemon daemon(limited("input_bytes_per_s: 65536"));
  UdpSocket flood, other("127.0.0.5");
  const auto began = Steady::now();
  int answers = 0;
  for (int i = 0; i < 3000; ++i) {
    flood.send("range 5", daemon.address(), udp_port);
    while (!flood.next(milliseconds(0)).empty()) ++answers;
  }
  EXPECT_TRUE(eventually([&] {
    other.send("who", daemon.address(), udp_port);
    return other.next(milliseconds(200)) == "front 5\n";
  })) << "other addresses do not wait for it";
  while (!flood.next(milliseconds(100)).empty()) ++answers;
  const double most_bytes = 65536 * (1 + std::chrono::duration<double>(Steady::now() - began).count());
  EXPECT_GT(answers, 50);
  EXPECT_LT(answers * 256, most_bytes) << "an answer counts as 256 bytes";
  EXPECT_THAT(daemon.log_text(), HasSubstr("datagrams dropped: their address sends too many requests"));
}

TEST(Transports, AnAddressThatConnectsTooOftenWaitsAndAnotherIsServed) {
  Daemon daemon(made_up());
  const auto refused = [&] { return daemon.status().sonars(0).figures().refused_clients(); };
  EXPECT_TRUE(eventually([&] {
    for (int i = 0; i < 300; ++i) Client(daemon.address(), command_port);
    return refused() > 0;
  })) << "few wait at a time";
  EXPECT_THAT(daemon.log_text(), HasSubstr("its address connects too often"));
  EXPECT_TRUE(eventually([&] {
    Client late(daemon.address(), command_port);
    late.send("range 7\n");
    return late.read_raw(3, std::chrono::seconds(5)).size() >= 3;
  })) << "served after the storm";
  asio::io_context io;
  tcp::socket other(io, {asio::ip::make_address("127.0.0.5"), 0});
  other.connect({asio::ip::make_address(daemon.address()), command_port});
  asio::write(other, asio::buffer(std::string("range 8\n")));
  std::string answer(3, ' ');
  asio::read(other, asio::buffer(answer));
  EXPECT_EQ(answer, "ok\n");
}

/// Hosts of a Ping360 search with a socket at port 30303 of all addresses, also if they run on sonard's own computer.
TEST(Transports, APortThatIsSearchedIsSharedWithHostsOfThisComputer) {
  auto before = std::make_unique<UdpSocket>("0.0.0.0", udp_port);
  Daemon daemon(made_up());
  before.reset();
  UdpSocket host("0.0.0.0", udp_port);
  host.send("who", daemon.address(), udp_port);
  EXPECT_EQ(host.next(), "front 5\n");
  EXPECT_EQ(host.sender, daemon.address() + ":" + std::to_string(udp_port));
}

TEST(Transports, ADialogueByDatagramsBelongsToTheHostThatAskedLast) {
  Daemon daemon(made_up());
  UdpSocket stranger, one, other;
  stranger.send("junk", daemon.address(), data_port);
  stranger.send("", daemon.address(), data_port);
  Client tcp(daemon.address(), data_port);  // the same port number with another transport
  one.send("range 6\n", daemon.address(), data_port);
  EXPECT_EQ(one.next(), "ok\n");
  EXPECT_EQ(one.sender, daemon.address() + ":" + std::to_string(data_port));
  unsigned ping = 0;
  const std::string samples = next_ping(one, &ping);
  EXPECT_EQ(samples, pattern(ping));
  EXPECT_TRUE(asked_for_range(daemon, 6));
  EXPECT_THAT(text_of(tcp.read_raw(20)), StartsWith("PING "));
  stranger.send("junk", daemon.address(), data_port);
  EXPECT_FALSE(one.next().empty()) << "junk does not take it over";
  other.send("nothing\n", daemon.address(), data_port);
  EXPECT_EQ(other.next(), "no: unknown command\n");
  const std::string taken_over = next_ping(other, &ping);
  EXPECT_EQ(taken_over, pattern(ping));
  EXPECT_TRUE(eventually([&] { return one.next(milliseconds(200)).empty(); }));
  EXPECT_EQ(daemon.status().sonars(0).clients_size(), 2);
  other.send("quit\n", daemon.address(), data_port);
  EXPECT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 1; }));
  EXPECT_TRUE(stranger.next(milliseconds(100)).empty()) << "it is sent nothing";
}

TEST(Transports, AHostByDatagramsWhosePortIsClosedIsGivenUpAndAnotherLosesNothing) {
  Daemon daemon(made_up());
  {
    UdpSocket gone;
    gone.send("range 6\n", daemon.address(), data_port);
    EXPECT_EQ(gone.next(), "ok\n");
    next_ping(gone);
    EXPECT_EQ(daemon.status().sonars(0).clients_size(), 1);
  }
  EXPECT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 0; }));
  UdpSocket host;
  host.send("range 6\n", daemon.address(), data_port);
  EXPECT_EQ(host.next(), "ok\n");
  unsigned first = 0, second = 0;
  next_ping(host, &first);
  next_ping(host, &second);
  EXPECT_EQ(second, first + 1);
  // The report of another sender's closed port arrives between the host's datagrams.
  for (int i = 0; i < 20; ++i) {
    UdpSocket().send("nothing\n", daemon.address(), data_port);
    host.send("range 6\n", daemon.address(), data_port);
    EXPECT_TRUE(eventually([&] { return host.next() == "ok\n"; }));
  }
  EXPECT_EQ(daemon.status().sonars(0).clients_size(), 1);
}

TEST(Transports, TheBeaconSaysAtOnceThatAClientCameOrWent) {
  Daemon daemon(made_up());
  UdpSocket host("127.0.0.1", beacon_port);
  auto client = std::make_unique<Client>(daemon.address(), command_port);
  constexpr milliseconds at_once{5000};  // its period is 10 s
  std::string status = host.next(at_once);
  for (int waiting = 0; waiting < 3 && status == "front free"; ++waiting)  // from the start
    status = host.next(at_once);
  EXPECT_EQ(status, "front busy");
  client.reset();
  EXPECT_EQ(host.next(at_once), "front free");
}

TEST(Transports, AMulticastGroupReceivesWithoutAskingForIt) {
  UdpSocket member("0.0.0.0", group_port);
  const std::string interface = "127.0.0.2";
  if (!member.join(text::format_ipv4(group_ip), interface)) GTEST_SKIP() << "no multicast on the loopback interface here";
  UdpSocket sender(interface);
  if (!sender.sends_multicast_from(interface)) GTEST_SKIP() << "no multicast from the loopback interface here";
  sender.send("heard", text::format_ipv4(group_ip), group_port);
  if (member.next(milliseconds(1000)) != "heard") GTEST_SKIP() << "multicast does not come back from the loopback interface here";

  Daemon daemon(made_up());
  const std::string first = member.next();
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(std::stoul(member.next()), std::stoul(first) + 1);
}

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

TEST(Transports, PagesOfTheWebReadAndChangeNothingByHttp) {
  DaemonSetup setup = made_up();
  setup.edit_config = [edit = setup.edit_config](Config& config) {
    edit(config);
    config.control.hosts = {"sonar.lab"};
  };
  Daemon daemon(setup);
  const std::string& at = daemon.address();
  EXPECT_THAT(http(at, "GET", "/range", "", "evil.example"), StartsWith("HTTP/1.1 403 ")) << "a name that was rebound";
  EXPECT_THAT(http(at, "PUT", "/range", "9", "", "Origin: http://evil.example\r\n"), StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(http(at, "PUT", "/range", "9", "", "Origin: null\r\n"), StartsWith("HTTP/1.1 403 "));
  EXPECT_EQ(body_of(http(at, "GET", "/range")), "5") << "unchanged";
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
  EXPECT_EQ(ask(driver, "who"), "front 5\n") << "no range was set";
  EXPECT_EQ(ask(driver, "range 6"), "ok\n");
}

TEST(Transports, AReceiverWhosePortIsClosedGetsNothingUntilItOpens) {
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
  std::this_thread::sleep_for(milliseconds(200));  // the last one is still being sent
  const auto before = sent();
  std::this_thread::sleep_for(milliseconds(1000));
  EXPECT_LT(sent() - before, 4u * 4000u) << "20 pings of 3200 bytes while it was open";
  UdpSocket again("127.0.0.1", port);
  next_ping(again);
}

TEST(Transports, NoClientNamesABroadcastOrGroupThatTheConfigurationDoesNot) {
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

TEST(Transports, TheStatusTellsHowLongAHostByDatagramsIsSilent) {
  Daemon daemon(made_up());
  UdpSocket host;
  host.send("silence 600\n", daemon.address(), data_port);
  EXPECT_EQ(host.next(), "ok\n");
  const auto client = [&] { return daemon.status().sonars(0).clients(0); };
  EXPECT_TRUE(eventually([&] { return client().silent_s() > 0.2; }));
  EXPECT_GE(client().connected_s(), 0.2);
}

TEST(Transports, AHostByDatagramsThatIsSilentIsGivenUpUnlessItsComputerAnswersForIt) {
  Daemon daemon(made_up());
  UdpSocket host;
  host.send("silence 1\n", daemon.address(), data_port);
  EXPECT_EQ(host.next(), "ok\n");
  next_ping(host);
  EXPECT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 0; }));
  EXPECT_THAT(daemon.log_text(), HasSubstr("client gone: silent for 1 s"));
  UdpSocket listens;  // on this computer, so that the kernel answers for a closed port
  listens.send("listens 4\n", daemon.address(), data_port);
  EXPECT_EQ(listens.next(), "ok\n");
  unsigned first = 0, last = 0;
  next_ping(listens, &first);
  do next_ping(listens, &last);
  while (last < first + 200 && last != 0);
  EXPECT_EQ(daemon.status().sonars(0).clients_size(), 1) << "10 s and more later";
}

TEST(Transports, AStopFreesEveryPort) {
  DaemonSetup setup = made_up();
  Daemon daemon(setup);
  UdpSocket receiver;
  Client client(daemon.address(), command_port);
  EXPECT_EQ(ask(client, "receivers " + receiver.at()), "ok\n");
  next_ping(receiver);
  EXPECT_EQ(daemon.stop(), 0);
  setup.address = daemon.address();
  Daemon again(setup);
  UdpSocket host;
  host.send("who", again.address(), udp_port);
  EXPECT_EQ(host.next(), "front 5\n");
}

TEST(Beacon, SendsItsDatagramsInOrder) {
  asio::io_context io;
  Log log{LogOptions{}};
  UdpSocket host;
  SonarConfig sonar;
  sonar.bind_ip = {127, 0, 0, 1};
  sonar.status_to = {{{127, 0, 0, 1}, host.port()}};
  int rounds = 0;
  const auto make = [&]() -> std::vector<protocol::Bytes> {
    ++rounds;
    if (rounds == 2) return {};
    return {bytes_of("first " + std::to_string(rounds)), bytes_of("second " + std::to_string(rounds))};
  };
  Beacon beacon(io, log, "front", make, [](const std::string& fault) { ADD_FAILURE() << fault; });
  protocol::Port port;
  port.number = beacon_port;
  port.period = milliseconds(100);
  ASSERT_TRUE(beacon.open(sonar, port));
  beacon.start();
  const auto next = [&] {
    std::string heard;
    eventually([&] {
      io.restart();
      io.run_for(milliseconds(1));
      return !(heard = host.next(milliseconds(1))).empty();
    });
    return heard;
  };
  for (const char* const expected : {"first 1", "second 1", "first 3", "second 3"}) EXPECT_EQ(next(), expected);
  beacon.stop();
  io.restart();
  io.run_for(milliseconds(200));
}

}  // namespace
}  // namespace sonar::testing_daemon::transports_test
