// Tests injected faults over real sockets: how kinds that act on connections and on the stream affect a driver's computer.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::HasSubstr;

DaemonSetup armed(DaemonSetup setup = {}) {
  setup.edit_config = [](Config& config) {
    config.faults.armed = true;
    config.limits.input_bytes_per_s = std::size_t{1} << 30;  // these tests connect a thousand times
  };
  return setup;
}
control::AddFault fault(const std::string& what, std::map<std::string, std::string> with = {}, double seconds = 0) {
  control::AddFault add;
  add.fault.what = what;
  add.fault.with = std::move(with);
  if (seconds > 0) add.fault.lasts.seconds = seconds;
  return add;
}
bool done(const OperationResult& result) { return result.code == OperationResult::Code::done; }

/// Returns true if a connection is accepted; a refusal comes at once.
bool accepts(const std::string& address) {
  asio::io_context io;
  tcp::socket socket(io);
  error_code ec;
  socket.connect({asio::ip::make_address(address), 52100}, ec);
  return !ec;
}

struct InjectedFaults : ::testing::Test {
  InjectedFaults() : daemon(armed()), client(daemon.address()) {
    client.fire(fire_at(oculus::PingRate::hz40));
    EXPECT_TRUE(client.next_ping());
  }
  std::shared_ptr<const v1::FaultReport> report() { return daemon.ask(control::GetFaults{}).faults; }

  Daemon daemon;
  Client client;
};

TEST(UnarmedFaults, AreRefusedWithAdvice) {
  Daemon daemon;
  const OperationResult result = daemon.ask(fault("L05"));
  EXPECT_EQ(result.code, OperationResult::Code::refused);
  EXPECT_THAT(result.text, HasSubstr("sonard run --faults"));
  EXPECT_FALSE(daemon.ask(control::GetFaults{}).faults->armed());
}

TEST_F(InjectedFaults, TheConnectionEndsAtTheByteInTheJournal) {
  for (const std::string how : {"fin", "reset"}) {
    SCOPED_TRACE(how);
    client.close();
    ASSERT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 0; }));
    Client driver(daemon.address());
    driver.fire(fire_at(oculus::PingRate::hz40));
    ASSERT_TRUE(driver.next_ping());
    ASSERT_TRUE(done(daemon.ask(fault("L03", {{"fraction", "0.5"}, {"how", how}}))));
    EXPECT_EQ(driver.read_to_end(), how == "fin");
    EXPECT_EQ(driver.was_reset, how == "reset");
    const auto entries = report()->journal();
    const auto injected = std::find_if(entries.rbegin(), entries.rend(), [](const auto& e) { return e.event() == "injected"; });
    ASSERT_NE(injected, entries.rend());
    EXPECT_EQ(injected->offset(), static_cast<std::int64_t>(driver.bytes_read));
  }
}

TEST_F(InjectedFaults, AClosedPortRefusesAndOpensAgain) {
  ASSERT_TRUE(done(daemon.ask(fault("port-closed", {}, 600))));
  EXPECT_TRUE(client.read_to_end());
  EXPECT_FALSE(accepts(daemon.address()));
  ASSERT_TRUE(done(daemon.ask(control::EndFaults{})));
  EXPECT_TRUE(eventually([&] { return accepts(daemon.address()); })) << "the port does not open again";
}

TEST_F(InjectedFaults, SilenceEndsWhenTheFaultIsCleared) {
  ASSERT_TRUE(done(daemon.ask(fault("silent-open", {}, 600))));
  while (client.next_ping(milliseconds(200))) {
  }
  EXPECT_FALSE(client.ended);
  ASSERT_TRUE(done(daemon.ask(control::EndFaults{"L05"})));
  EXPECT_TRUE(client.next_ping());
  EXPECT_EQ(daemon.ask(control::EndFaults{"L05"}).code, OperationResult::Code::refused);
}

TEST_F(InjectedFaults, APauseInsideAPingEndsWhenTheFaultIsCleared) {
  ASSERT_TRUE(done(daemon.ask(fault("pause-inside", {{"seconds", "100"}}))));
  EXPECT_TRUE(eventually([&] { return !client.next_ping(milliseconds(200)) && client.decoder.buffered_bytes() > 0; }))
      << "half a ping has arrived";
  ASSERT_TRUE(done(daemon.ask(control::EndFaults{})));
  EXPECT_TRUE(client.next_ping());
  EXPECT_EQ(client.decoder.skipped_bytes(), 0u);
}

TEST_F(InjectedFaults, NewConnectionsWaitInSilenceOrAreReset) {
  client.close();
  ASSERT_TRUE(done(daemon.ask(fault("accepted-not-served", {}, 600))));
  Client waits(daemon.address());
  waits.fire(fire_at(oculus::PingRate::hz40));
  EXPECT_FALSE(waits.next(milliseconds(200)));
  EXPECT_FALSE(waits.ended);
  ASSERT_TRUE(done(daemon.ask(control::EndFaults{})));
  EXPECT_TRUE(waits.next_ping()) << "the waiting client is served after the fault";
  waits.close();
  ASSERT_TRUE(done(daemon.ask(fault("no-free-slot", {}, 600))));
  Client refused(daemon.address());
  EXPECT_FALSE(refused.read_to_end());
  EXPECT_TRUE(refused.was_reset);
}

TEST_F(InjectedFaults, AreInStatusMetricsEventsAndTheJournalFile) {
  ASSERT_TRUE(done(daemon.ask(fault("stuck", {}, 600))));
  EXPECT_TRUE(client.next_ping());
  EXPECT_TRUE(client.next_ping());
  const v1::DaemonStatus status = daemon.status();
  EXPECT_TRUE(status.faults_armed());
  ASSERT_EQ(status.faults_size(), 1);
  EXPECT_EQ(status.faults(0).code(), "P01");
  EXPECT_EQ(status.faults(0).state(), "active");
  std::string metrics;
  daemon.on_io_thread([&] { metrics = daemon.app().operations().metrics(); });
  EXPECT_THAT(metrics, HasSubstr("sonard_faults_active{sonar=\"front\"} 1\n"));
  EXPECT_THAT(metrics, HasSubstr("sonard_fault_injections_total{kind=\"P01\"} "));
  EXPECT_THAT(daemon.log_text(), HasSubstr("fault stuck: The image repeats while numbers advance.  sonar=front  kind=P01"));
}

TEST(PlannedFaults, BeginWithTheDaemonAndFillTheJournal) {
  const std::string journal = ::testing::TempDir() + "/journal.jsonl";
  std::filesystem::remove(journal);
  DaemonSetup setup;
  setup.more = "faults: {armed: true, journal: " + journal +
               ", plan: [{do: F16, at: {every: 3}}, {name: late, do: L05, at: {time_s: 900}}]}\n";
  setup.gate = std::make_shared<PingGate>();
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(oculus::PingRate::hz40));
  std::vector<std::uint32_t> numbers;
  while (numbers.size() < 4) {
    setup.gate->allow(numbers.size() == 2 ? 2 : 1);  // every third ping is lost
    const auto ping = client.next_ping();
    ASSERT_TRUE(ping);
    numbers.push_back(ping->head.fixed.ping_id);
  }
  EXPECT_THAT(numbers, ::testing::ElementsAre(1, 2, 4, 5));
  std::string line;
  ASSERT_TRUE(eventually([&] { return static_cast<bool>(std::getline(std::ifstream(journal), line)); }));
  EXPECT_THAT(line, HasSubstr(R"("event":"began","fault":"plan-1","do":"F16","kind":"F16")"));
  ASSERT_EQ(daemon.status().faults_size(), 2);
  EXPECT_EQ(daemon.status().faults(1).state(), "waiting");
}

std::size_t open_descriptors() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}
std::size_t threads() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/task"), {}));
}

TEST_F(InjectedFaults, AThousandFaultsLeaveNothingOpen) {
  client.close();
  ASSERT_TRUE(eventually([&] { return daemon.status().sonars(0).clients_size() == 0; }));
  const std::size_t descriptors = open_descriptors(), running = threads();
  for (int i = 0; i < 1000; ++i) {
    Client driver(daemon.address());
    control::AddFault end = fault(i % 2 == 0 ? "M09" : "M08", {{"how", "reset"}});
    ASSERT_TRUE(done(daemon.ask(end))) << i;
    driver.fire(fire_at(oculus::PingRate::hz40));
    if (i % 2 == 0) {
      ASSERT_FALSE(driver.read_to_end());
    }
    ASSERT_TRUE(done(daemon.ask(control::EndFaults{})));
  }
  EXPECT_TRUE(eventually([&] { return open_descriptors() == descriptors; }))
      << open_descriptors() << " descriptors are open, not " << descriptors;
  EXPECT_EQ(threads(), running);
}

}  // namespace
}  // namespace sonar::testing_daemon
