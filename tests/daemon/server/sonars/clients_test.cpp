// Several clients, slow clients, dead clients, and the end of the daemon: no client disturbs another, and no ping is cut.
#include <gmock/gmock.h>

#include <algorithm>

#include "daemon/server/sonars/session.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/host.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Requests large pings (512 beams, 32 bit, about 1.4 MB), which fill the kernel's buffers within a second.
oculus::FireRequest large_fire(PingRate rate) {
  auto fire = fire_at(rate, 4);
  fire.version = 2;
  fire.settings.flags |= oculus::flag::beams_512 | oculus::flag::row_gains;
  fire.extension.flags = oculus::flag::extended_32_bit;
  return fire;
}

bool is_served(Daemon& daemon) {
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  return client.next_ping().has_value();  // the stream ends at once when the client is refused
}

TEST(Clients, ASlowClientLosesWholePingsAndAHealthyClientNone) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 2}\n    outbox: {depth: 3}\n";
  setup.more = "limits: {stall_s: 600, dead_peer_s: 600}\n";
  setup.gate = std::make_shared<PingGate>();
  Daemon daemon(setup);
  Client healthy(daemon.address());
  Client slow(daemon.address(), 52100, 16384);
  healthy.fire(large_fire(PingRate::hz10));
  oculus::PingSequence healthy_ids;
  std::uint32_t last = 0;
  for (int i = 0; i < 8; ++i) {  // more than the outbox and the kernels can store
    setup.gate->allow();
    const auto ping = healthy.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_THAT(ping->violations, IsEmpty());
    EXPECT_THAT(healthy_ids.add(*ping), IsEmpty());
    last = ping->head.fixed.ping_id;
  }
  EXPECT_EQ(healthy_ids.skipped_ids(), 0u) << "a stalled client costs the other no ping";
  // The slow client reads again: it gets old pings from the kernel's buffers, then a gap, then the newest. No ping is cut or
  // mixed with another.
  oculus::PingSequence slow_ids;
  for (std::uint32_t id = 0; id < last;) {
    const auto ping = slow.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_THAT(ping->violations, IsEmpty());
    EXPECT_THAT(slow_ids.add(*ping), IsEmpty());
    EXPECT_EQ(ping->sample(1, 1) & 0xffu, FakeEngine::sample(ping->head.fixed.ping_id, 1, 1));
    id = ping->head.fixed.ping_id;
  }
  EXPECT_GT(slow_ids.skipped_ids(), 0u);
  EXPECT_EQ(slow.decoder.skipped_bytes(), 0u);
  daemon.stop();
  EXPECT_GE(daemon.figures().dropped, slow_ids.skipped_ids());
}

/// Returns the requests for a dozen pings at 40 Hz, of which an engine computes one in 60 ms.
std::vector<PingRequest> overloaded(const std::string& sonar_lines) {
  DaemonSetup setup;
  setup.sonar_lines = sonar_lines;
  setup.engine_takes = milliseconds(60);
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  for (int i = 0; i < 12; ++i) EXPECT_TRUE(client.next_ping());
  daemon.stop();
  EXPECT_GT(daemon.figures().skipped.busy, 0u);
  return daemon.requests();
}

TEST(Clients, PingNumbersShowAnOverloadIfConfigured) {
  std::vector<PingRequest> slow = overloaded(""), counted = overloaded("    overload: count\n");
  ASSERT_GE(slow.size(), 12u);
  ASSERT_GE(counted.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(static_cast<std::uint32_t>(slow[i].number), i + 1);
    const auto ticks = (counted[i].fired_at - counted[0].fired_at) / milliseconds(25);
    EXPECT_EQ(static_cast<std::int64_t>(counted[i].number), ticks + 1) << "a number for every tick";
  }
  EXPECT_GT(static_cast<std::uint32_t>(counted[11].number), 24u);
}

TEST(Clients, AClientThatReadsNothingIsReset) {
  DaemonSetup setup;
  setup.more = "limits: {stall_s: 0.3}\n";
  Daemon daemon(setup);
  Client stalled(daemon.address(), 52100, 16384);
  stalled.fire(large_fire(PingRate::hz40));
  ASSERT_TRUE(eventually([&] { return daemon.log_text().find("read no byte for 300 ms") != std::string::npos; }));
  Client next(daemon.address());
  next.fire(fire_at(PingRate::hz10));
  EXPECT_TRUE(next.next_ping()) << "the slot of the client that read nothing is free again";
  EXPECT_FALSE(stalled.read_to_end());
  EXPECT_TRUE(stalled.was_reset);
}

/// The connection ends when dummies stay unacknowledged for dead_peer_s. The kernel's own limit is a quarter of an hour.
TEST(Clients, AClientOnADeadComputerFreesItsSlotInStandby) {
  DaemonSetup setup;
  setup.more = "limits: {dead_peer_s: 3}\n";
  setup.sonar_lines = "    options: {dummy_period_ms: 200}\n";
  Daemon daemon(setup);
  Client dead(daemon.address());
  dead.fire(fire_at(PingRate::standby));
  ASSERT_TRUE(dead.next());
  dead.die();
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("client gone") != std::string::npos; })) << daemon.log_text();
  EXPECT_NE(daemon.log_text().find("stopped reading and answering"), std::string::npos) << daemon.log_text();
  Client next(daemon.address());
  next.fire(fire_at(PingRate::hz10));
  EXPECT_TRUE(next.next_ping()) << daemon.log_text();
}

/// The client gets no bytes, because dummies are rare, so only the kernel's probes can detect that it is dead.
TEST(Clients, AClientOnADeadComputerFreesItsSlot) {
  DaemonSetup setup;
  setup.more = "limits: {dead_peer_s: 3}\n";
  setup.sonar_lines = "    options: {dummy_period_ms: 60000}\n";
  Daemon daemon(setup);
  Client dead(daemon.address());
  ASSERT_TRUE(eventually([&] { return daemon.log_text().find("client connected") != std::string::npos; }));
  dead.die();
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("client gone") != std::string::npos; })) << daemon.log_text();
  EXPECT_NE(daemon.log_text().find("stopped reading and answering"), std::string::npos) << daemon.log_text();
}

TEST(Clients, DeadClientsFreeTheirSlots) {
  Daemon daemon;
  for (int i = 0; i < 10; ++i) {
    Client client(daemon.address());
    client.fire(fire_at(PingRate::hz40));
    ASSERT_TRUE(client.next_ping()) << "client " << i;
    i % 2 == 0 ? client.reset() : client.close();
    ASSERT_TRUE(eventually([&] { return is_served(daemon); })) << "client " << i;
  }
}

TEST(Clients, PingIdsContinueAcrossClientsAndSettingsDoNot) {
  DaemonSetup setup;
  setup.sonar_lines = "    options: {dummy_period_ms: 30}\n";
  Daemon daemon(setup);
  std::uint32_t last = 0;
  {
    Client first(daemon.address());
    first.fire(fire_at(PingRate::hz40));
    for (int i = 0; i < 3; ++i) last = first.next_ping()->head.fixed.ping_id;
  }
  ASSERT_TRUE(eventually([&] { return daemon.log_text().find("client gone") != std::string::npos; }));
  Client second(daemon.address());
  const auto message = second.next();
  ASSERT_TRUE(message);
  EXPECT_TRUE(std::holds_alternative<oculus::DummyMessage>(*message)) << "a client gets no pings before its own fire message";
  second.fire(fire_at(PingRate::hz10));
  EXPECT_GT(second.next_ping()->head.fixed.ping_id, last);
}

/// Expects that `heir`, which connected while a ping for the previous client was still being computed, does not get that ping.
void expect_only_its_own_pings(Daemon& daemon, Client& heir, PingGate& gate) {
  const std::size_t asked = daemon.requests().size();
  const auto connected = [&] {
    std::uint64_t all = 0;
    daemon.on_io_thread([&] { all = daemon.figures().clients; });
    return all;
  };
  ASSERT_TRUE(eventually([&] { return connected() == 2; }));
  gate.open();
  const auto first = heir.next();
  ASSERT_TRUE(first);
  EXPECT_TRUE(std::holds_alternative<oculus::DummyMessage>(*first)) << "the heir got a ping of the previous client";
  heir.fire(fire_at(PingRate::hz10, 3));
  const auto ping = heir.next_ping();
  ASSERT_TRUE(ping);
  EXPECT_EQ(ping->head.fixed.fire.range, 3);
  EXPECT_EQ(daemon.requests().at(asked - 1).settings.range_m, 2)
      << "no ping of the previous client was being computed, so the test shows nothing";
}

TEST(Clients, APingInProgressIsNotSentToTheNextClient) {
  DaemonSetup setup;
  setup.sonar_lines = "    options: {dummy_period_ms: 600}\n";
  setup.gate = std::make_shared<PingGate>();
  setup.gate->allow();
  Daemon daemon(setup);
  auto first = std::make_unique<Client>(daemon.address());
  first->fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(eventually([&] { return daemon.requests().size() == 2; }));
  first.reset();
  ASSERT_TRUE(eventually([&] { return daemon.log_text().find("client gone") != std::string::npos; }));
  Client second(daemon.address());
  expect_only_its_own_pings(daemon, second, *setup.gate);
}

TEST(Admission, ATakeOverDuringAPingDoesNotGetThatPing) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 1, when_full: take_over}\n    options: {dummy_period_ms: 600}\n";
  setup.gate = std::make_shared<PingGate>();
  setup.gate->allow();
  Daemon daemon(setup);
  Client old(daemon.address());
  old.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(eventually([&] { return daemon.requests().size() == 2; }));
  Client heir(daemon.address());
  expect_only_its_own_pings(daemon, heir, *setup.gate);
}

TEST(Admission, CloseNewSendsTheSecondAFinAndNoByte) {
  DaemonSetup setup;
  setup.gate = std::make_shared<PingGate>();
  Daemon daemon(setup);
  Client first(daemon.address());
  first.fire(fire_at(PingRate::hz40));
  setup.gate->allow();
  ASSERT_TRUE(first.next_ping());
  Client second(daemon.address());
  second.fire(fire_at(PingRate::standby));  // bytes that still arrive must not turn the FIN into a reset
  EXPECT_TRUE(second.read_to_end());
  EXPECT_EQ(second.bytes_read, 0u);
  oculus::PingSequence ids;
  for (int i = 0; i < 5; ++i) {
    setup.gate->allow();
    const auto ping = first.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_THAT(ids.add(*ping), IsEmpty());
  }
  EXPECT_EQ(ids.skipped_ids(), 0u) << "the first client loses no ping";
  daemon.stop();
  EXPECT_EQ(daemon.figures().refused_clients, 1u);
}

TEST(Admission, TakeOverEndsTheOldOneAtAMessageBoundary) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 1, when_full: take_over}\n";
  Daemon daemon(setup);
  Client old(daemon.address());
  old.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(old.next_ping());
  bool whole = false;
  std::thread reader([&] { whole = old.read_to_end(); });
  Client heir(daemon.address());
  heir.fire(fire_at(PingRate::hz10));
  EXPECT_TRUE(heir.next_ping());
  reader.join();
  EXPECT_TRUE(whole) << "FIN";
  EXPECT_EQ(old.decoder.buffered_bytes(), 0u);
  ASSERT_TRUE(eventually([&] { return daemon.status().sonars(0).has_gone(); }));
  const auto status = daemon.status();
  EXPECT_GT(status.sonars(0).gone().connected_s(), status.sonars(0).clients(0).connected_s()) << "the old client connected first";
}

/// A port for commands never has pings.
TEST(Admission, AConnectionForCommandsWithoutPingsIsNoError) {
  DaemonSetup setup;
  setup.profile = "norbit-wbms";
  Daemon daemon(setup);
  const auto gone_from = [&](const protocol::Port& port) {
    auto client = std::make_unique<Client>(daemon.address(), port.number);
    EXPECT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 1; }));
    const v1::ClientStatus served = daemon.status().sonars(0).clients(0);
    EXPECT_EQ(served.commands_only(), !port.has_pings);
    client.reset();
    EXPECT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 0; }));
    const v1::Visit gone = daemon.status().sonars(0).gone();
    EXPECT_EQ(gone.address(), served.address());
    return gone;
  };
  for (const protocol::Port& port : protocol::find_make("norbit")->device->ports())
    if (port.kind == protocol::Port::Kind::tcp_stream) {
      EXPECT_EQ(gone_from(port).without_ping(), port.has_pings) << port.number;
    }
}

TEST(Admission, QueueServesTheNextWhenASlotIsFree) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 1, when_full: queue}\n";
  Daemon daemon(setup);
  auto first = std::make_unique<Client>(daemon.address());
  first->fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(first->next_ping());
  Client second(daemon.address());
  second.fire(fire_at(PingRate::hz10));
  EXPECT_FALSE(second.next(milliseconds(200)));
  EXPECT_FALSE(second.ended);
  first.reset();
  EXPECT_TRUE(second.next_ping()) << "the waiting client's fire message was kept";
}

TEST(Admission, AClientThatLeavesWhileWaitingLosesItsPlaceInTheQueue) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 1, when_full: queue}\n";
  Daemon daemon(setup);
  auto first = std::make_unique<Client>(daemon.address());
  first->fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(first->next_ping());
  for (int i = 0; i < 40; ++i) {  // more than can wait; their bytes come before the end of their streams
    Client leaves(daemon.address());
    leaves.fire(fire_at(PingRate::hz40, 2));
  }
  Client stays(daemon.address());
  stays.fire(fire_at(PingRate::hz40, 3));
  EXPECT_FALSE(stays.next(milliseconds(200)));
  EXPECT_FALSE(stays.ended);
  EXPECT_TRUE(eventually([&] {
    std::uint64_t queued = 0;
    daemon.on_io_thread([&] { queued = daemon.figures().clients_queued; });
    return queued == 1;
  }));
  first.reset();
  const auto ping = stays.next_ping();
  ASSERT_TRUE(ping);
  EXPECT_EQ(ping->head.fixed.fire.range, 3) << "the range is that of the client that stays";
}

TEST(Admission, TheLastFireMessageOfSeveralClientsIsUsed) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 3}\n";
  Daemon daemon(setup);
  Client a(daemon.address()), b(daemon.address());
  a.fire(fire_at(PingRate::hz40, 2));
  ASSERT_TRUE(a.next_ping());
  ASSERT_TRUE(b.next_ping()) << "all clients get pings";
  b.fire(fire_at(PingRate::hz40, 3));
  ASSERT_TRUE(eventually([&] { return a.next_ping()->head.fixed.fire.range == 3; }));
  a.fire(fire_at(PingRate::hz40, 2));  // the same bytes as a's last request, but no longer the device's settings
  EXPECT_TRUE(eventually([&] { return b.next_ping()->head.fixed.fire.range == 2; }));
}

TEST(Clients, ManyReconnectsLeaveNoState) {
  const auto begin = Steady::now();
  Daemon daemon;
  for (int i = 0; i < 100; ++i) {
    Client client(daemon.address());
    if (i % 3 == 0) client.fire(fire_at(PingRate::hz40));
    if (i % 2 == 0) client.reset();
  }
  EXPECT_TRUE(eventually([&] { return is_served(daemon); }));
  const auto took = Steady::now() - begin;
  const std::string log = daemon.log_text();
  const auto lines = std::count(log.begin(), log.end(), '\n');
  EXPECT_GE(lines, 5);
  EXPECT_LE(lines, 20 + 3 * (took / std::chrono::seconds(1))) << "many connections make few log lines";
}

TEST(GracefulStop, ReadingClientsGetAWholeLastMessageAndStalledOnesAReset) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 2}\n";
  Daemon daemon(setup);
  Client healthy(daemon.address());
  Client stalled(daemon.address(), 52100, 16384);
  healthy.fire(fire_at(PingRate::hz15, 10));  // small enough for a client that reads to receive in time
  for (int i = 0; i < 12; ++i) ASSERT_TRUE(healthy.next_ping());
  bool whole = false;
  std::thread reader([&] { whole = healthy.read_to_end(); });
  const auto begin = Steady::now();
  EXPECT_EQ(daemon.stop(), 0);
  const auto took = Steady::now() - begin;
  reader.join();
  EXPECT_TRUE(whole) << "FIN";
  EXPECT_EQ(healthy.decoder.buffered_bytes(), 0u) << "no message was cut off";
  EXPECT_GE(took, Session::finish_limit) << "the stalled client had the full time";
  EXPECT_LT(took, patience) << "docs promise 2 s; a busy machine may need more";
  EXPECT_THAT(daemon.log_text(), HasSubstr("did not receive its last message in time"));
}

TEST(GracefulStop, WithoutClientsTheStopIsImmediate) {
  Daemon daemon;
  const auto begin = Steady::now();
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_LT(Steady::now() - begin, patience);
}

TEST(GracefulStop, ClientsThatCloseOnFinDoNotDelayTheStop) {
  Daemon daemon;
  auto client = std::make_unique<Client>(daemon.address());
  client->fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client->next_ping());
  std::thread reader([&] {
    EXPECT_TRUE(client->read_to_end());
    client.reset();
  });
  EXPECT_EQ(daemon.stop(), 0);
  reader.join();
  EXPECT_THAT(daemon.log_text(), HasSubstr("client gone: sonard stops"));
}

}  // namespace
}  // namespace sonar::testing_daemon
