// Tests every kind of port except HTTP, end to end with a made-up make of sonar: TCP streams, a beacon, datagrams with answers,
// pings as datagrams to receivers and to a multicast group, and conversations across them.
#include <gmock/gmock.h>

#include <memory>

#include "tests/daemon/server/sonars/transports_testing.hpp"

namespace sonar::testing_daemon::transports_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

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
  EXPECT_TRUE(eventually([&] { return receiver.next(milliseconds(500)).empty(); }))
      << "the receivers of a connection end with it";
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
  EXPECT_EQ(ask(second, "receivers " + other.at() + " " + one.at()), "ok\n") << "an address may be set by several connections";
  unsigned ping = 0, same = 0;
  const std::string samples = next_ping(other, &ping);
  EXPECT_EQ(samples, pattern(ping));
  while (same < ping) next_ping(one, &same);
  EXPECT_EQ(same, ping);
  next_ping(one, &same);
  EXPECT_GT(same, ping) << "no ping is sent twice";
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
  EXPECT_EQ(ask(commands, "range 3"), "ok\n") << "no ping came before the reply";
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
  EXPECT_EQ(host.next(), "ok\n") << "an exception in the vendor's code loses one datagram";
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
  })) << "other addresses do not wait for the flood";
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
  })) << "only few connections wait at a time";
  EXPECT_THAT(daemon.log_text(), HasSubstr("its address connects too often"));
  EXPECT_TRUE(eventually([&] {
    Client late(daemon.address(), command_port);
    late.send("range 7\n");
    return late.read_raw(3, std::chrono::seconds(5)).size() >= 3;
  })) << "the address is served again later";
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

TEST(Transports, AUdpDialogueBelongsToTheHostOfTheLastRequest) {
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
  EXPECT_FALSE(one.next().empty()) << "invalid bytes do not take the stream over";
  other.send("nothing\n", daemon.address(), data_port);
  EXPECT_EQ(other.next(), "no: unknown command\n");
  const std::string taken_over = next_ping(other, &ping);
  EXPECT_EQ(taken_over, pattern(ping));
  EXPECT_TRUE(eventually([&] { return one.next(milliseconds(200)).empty(); }));
  EXPECT_EQ(daemon.status().sonars(0).clients_size(), 2);
  other.send("quit\n", daemon.address(), data_port);
  EXPECT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 1; }));
  EXPECT_TRUE(stranger.next(milliseconds(100)).empty()) << "a host without a request gets nothing";
}

TEST(Transports, AUdpHostWhosePortIsClosedIsGivenUpAndAnotherLosesNothing) {
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

TEST(Transports, TheBeaconReportsClientsAtOnce) {
  Daemon daemon(made_up());
  UdpSocket host("127.0.0.1", beacon_port);
  auto client = std::make_unique<Client>(daemon.address(), command_port);
  constexpr milliseconds at_once{5000};  // half the period of the beacon
  std::string status = host.next(at_once);
  for (int waiting = 0; waiting < 3 && status == "front free"; ++waiting)  // beacons from before the connection
    status = host.next(at_once);
  EXPECT_EQ(status, "front busy");
  client.reset();
  EXPECT_EQ(host.next(at_once), "front free");
}

TEST(Transports, AMulticastGroupReceivesWithoutARequest) {
  UdpSocket member("0.0.0.0", group_port);
  const std::string interface = "127.0.0.2";
  if (!member.join(text::format_ipv4(group_ip), interface)) GTEST_SKIP() << "no multicast on the loopback interface here";
  UdpSocket sender(interface);
  if (!sender.sends_multicast_from(interface)) GTEST_SKIP() << "no multicast from the loopback interface here";
  sender.send("received", text::format_ipv4(group_ip), group_port);
  if (member.next(milliseconds(1000)) != "received")
    GTEST_SKIP() << "multicast does not come back from the loopback interface here";

  Daemon daemon(made_up());
  const std::string first = member.next();
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(std::stoul(member.next()), std::stoul(first) + 1);
}

TEST(Transports, TheStatusHasTheSilenceOfAUdpHost) {
  Daemon daemon(made_up());
  UdpSocket host;
  host.send("silence 600\n", daemon.address(), data_port);
  EXPECT_EQ(host.next(), "ok\n");
  const auto client = [&] { return daemon.status().sonars(0).clients(0); };
  EXPECT_TRUE(eventually([&] { return client().silent_s() > 0.2; }));
  EXPECT_GE(client().connected_s(), 0.2);
}

TEST(Transports, ASilentUdpHostIsGivenUpUnlessItsComputerAnswers) {
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
  EXPECT_EQ(daemon.status().sonars(0).clients_size(), 1) << "the host is still connected after 10 s";
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
    std::string received;
    eventually([&] {
      io.restart();
      io.run_for(milliseconds(1));
      return !(received = host.next(milliseconds(1))).empty();
    });
    return received;
  };
  for (const char* const expected : {"first 1", "second 1", "first 3", "second 3"}) EXPECT_EQ(next(), expected);
  beacon.stop();
  io.restart();
  io.run_for(milliseconds(200));
}

}  // namespace
}  // namespace sonar::testing_daemon::transports_test
