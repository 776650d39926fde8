// Tests conversations in simulated time: timed messages are sent when they are due, between the pings, and silent hosts are
// detected in wall time.
#include <gmock/gmock.h>

#include <ctime>
#include <thread>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"
#include "tests/protocol/blueview/blueview_testing.hpp"

namespace sonar::testing_daemon {
namespace {

using blueview::FrameType;
using control::Step;
using oculus::PingRate;
using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Code = OperationResult::Code;
namespace bv = blueview::test;

DaemonSetup head(const std::string& clock) {
  DaemonSetup setup;
  setup.profile = "blueview-p900-90";
  setup.more = "clock: " + clock + "\n" + "control: {stream: '127.0.0.1:0', http: off}\n";
  return setup;
}

/// A host that greets, subscribes and then reads everything.
struct Host {
  explicit Host(const Daemon& daemon, std::uint32_t interval_ms = 0) : link(daemon.address(), blueview::tcp_port) {
    link.send(bv::hello());
    EXPECT_FALSE(link.read_raw(1).empty()) << "no greeting";
    if (interval_ms > 0) link.send(bv::two_numbers(FrameType::subscribe, 2, 0, interval_ms));
    reader = std::thread([this] { was_sent_away = link.read_to_end(); });
  }
  ~Host() { reader.join(); }  // the daemon closes first
  Client link;
  bool was_sent_away = false;  // the stream ended with a FIN, not with a reset
  std::thread reader;
};

std::vector<double> times_ms(Daemon& daemon) {
  std::vector<double> times;
  for (const PingRequest& r : daemon.requests()) times.push_back(1e3 * seconds(r.fired_at.time_since_epoch()));
  return times;
}

TEST(SteppedTalk, ASubscriptionGetsEveryPingOfAStep) {
  Daemon daemon(head("lockstep"));
  Host host(daemon, 100);
  EXPECT_TRUE(eventually([&] { return daemon.status().sonars().at(0).clients().at(0).bytes_written() > 60; }))
      << "the subscription is not confirmed";
  const v1::Stepped stepped = *daemon.ask(Step{0.5}).stepped;
  EXPECT_EQ(stepped.pings(), 5u);
  EXPECT_EQ(stepped.now_ns(), 500'000'000);
  EXPECT_THAT(times_ms(daemon), ElementsAre(0, 100, 200, 300, 400));
  EXPECT_EQ(daemon.ask(Step{0.25}).stepped->pings(), 3u) << "the ping at the end of a step belongs to the next step";
  EXPECT_EQ(daemon.status().sonars().at(0).clients().at(0).pings_written(), 8u);
  daemon.stop();
}

TEST(SteppedTalk, ASubscriptionMakesTimePassByItself) {
  DaemonSetup setup = head("stepped");
  setup.options.exit_after_pings = 4;
  Daemon daemon(setup);
  Host host(daemon, 200);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(times_ms(daemon), ElementsAre(0, 200, 400, 600));
}

TEST(SteppedTalk, TheSilenceOfAHostIsMeasuredInWallTime) {
  Daemon daemon(head("lockstep"));
  Host host(daemon);
  const auto began = Steady::now();
  EXPECT_EQ(daemon.ask(Step{300}).code, Code::done);
  const auto status = daemon.status().sonars().at(0);
  ASSERT_EQ(status.clients_size(), 1) << "five simulated minutes take some ms";
  EXPECT_GT(status.clients(0).bytes_written(), 149u * 16u) << "a keep-alive is sent every 2 s";
  EXPECT_TRUE(eventually([&] { return daemon.status().sonars().at(0).clients().empty(); }, patience + milliseconds(10000)));
  EXPECT_GT(Steady::now() - began, std::chrono::seconds(9));
  EXPECT_THAT(daemon.log_text(), HasSubstr("client gone: silent for 10 s"));
  daemon.stop();
  host.reader.join();
  host.reader = std::thread([] {});
  EXPECT_TRUE(host.was_sent_away) << "the connection was reset";
}

TEST(SteppedTalk, WhileNoTimeMayPassTheDaemonUsesNoProcessorTime) {
  Daemon daemon(head("lockstep"));
  Host host(daemon);
  EXPECT_EQ(daemon.ask(Step{1}).code, Code::done);
  EXPECT_TRUE(eventually([] {
    const std::clock_t before = std::clock();  // processor time of this process only
    std::this_thread::sleep_for(milliseconds(500));
    return std::clock() - before < CLOCKS_PER_SEC / 100;
  })) << "the event loop of the daemon does not wait";
  daemon.stop();
}

TEST(SteppedTalk, NoTimePassesBeforeTheFirstPose) {
  Daemon daemon(head("follow"));
  Host host(daemon, 100);
  EXPECT_TRUE(eventually([&] { return daemon.status().sonars().at(0).clients().at(0).bytes_written() > 60; }));
  EXPECT_EQ(daemon.status().now_ns(), 0);
  control::PoseSample pose;
  pose.stamp = {control::ClockDomain::sim, 5'000'000'000};
  EXPECT_EQ(daemon.ask(pose).code, Code::done);
  EXPECT_EQ(daemon.status().now_ns(), 5'000'000'000);
  EXPECT_EQ(daemon.status().sonars().at(0).figures().skipped_ticks(), 0u);
  daemon.stop();
}

TEST(SteppedTalk, TimeDoesNotPassForAHostWhosePingsWaitForAPose) {
  DaemonSetup setup = head("stepped");
  setup.more += "poses: {protobuf: '127.0.0.1:0', json: off, on_stale: stop}\n";
  Daemon daemon(setup);
  EXPECT_EQ(daemon.ask(control::PoseSample{}).code, Code::done);
  Host host(daemon, 200);
  EXPECT_TRUE(eventually([&] { return daemon.requests().size() == 6; })) << "pings end when the pose is older than stale_after_s";
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(daemon.requests().size(), 6u);
  EXPECT_LE(daemon.status().now_ns(), 1'200'000'000);
  daemon.stop();
}

TEST(SteppedTalk, OtherClientsGetPingsBesideASubscription) {
  DaemonSetup setup = head("stepped");
  setup.profile = "blueview-m900-2250-130";
  setup.sonar_lines = "    clients: {max: 2}\n";
  Daemon daemon(setup);
  Host subscriber(daemon, 10);
  Client other(daemon.address(), blueview::tcp_port);
  other.send(bv::hello());
  EXPECT_FALSE(other.read_raw(1).empty());
  other.send(bv::ping(3, 1, 20000));
  const auto answer = other.read_raw(16 + 100);
  EXPECT_GE(answer.size(), 116u) << "pings of the other head came in between";
  std::thread reader([&other] { other.read_to_end(); });  // simulated time waits for this client
  const auto pings = daemon.requests();
  EXPECT_TRUE(std::any_of(pings.begin(), pings.end(), [](const PingRequest& r) { return r.settings.mode == 1; }));
  EXPECT_TRUE(eventually([&] { return daemon.requests().size() > pings.size() + 5; })) << "the subscription continues";
  EXPECT_EQ(daemon.requests().back().settings.mode, 0u);
  daemon.stop();
  reader.join();
}

TEST(SteppedTalk, ThePingOfAHostThatLeftIsNotPending) {
  DaemonSetup setup = head("lockstep");
  setup.profile = "blueview-m900-2250-130";
  Daemon daemon(setup);
  const auto clients = [&] { return daemon.status().sonars().at(0).clients().size(); };
  {
    Client leaves(daemon.address(), blueview::tcp_port);
    leaves.send(bv::hello());
    leaves.send(bv::ping(3, 1, 20000));
    EXPECT_TRUE(eventually([&] { return clients() == 1 && daemon.log_text().find("settings: ") != std::string::npos; }));
  }
  EXPECT_TRUE(eventually([&] { return clients() == 0; }));
  Client subscriber(daemon.address(), blueview::tcp_port);
  subscriber.send(bv::hello());
  subscriber.send(bv::two_numbers(FrameType::subscribe, 2, 1, 100));
  std::thread reader([&] { subscriber.read_to_end(); });
  EXPECT_TRUE(eventually([&] { return clients() == 1 && daemon.status().sonars().at(0).clients().at(0).bytes_written() > 60; }));
  EXPECT_EQ(daemon.ask(Step{0.5}).stepped->pings(), 5u);
  daemon.stop();
  reader.join();
}

TEST(SteppedTalk, KeepAlivesOfAnotherClientAreBetweenThePings) {
  DaemonSetup setup;
  setup.more = "clock: stepped\n";
  setup.sonar_lines = "    options: {dummy_period_ms: 30}\n    clients: {max: 2}\n";
  Daemon daemon(setup);
  Client client(daemon.address()), silent(daemon.address());
  ASSERT_TRUE(eventually([&] { return daemon.status().sonars().at(0).clients().size() == 2; }));
  client.fire(fire_at(PingRate::hz10));
  std::thread reader([&] {  // a step waits for every client
    int dummies = 0;
    while (const auto message = silent.next()) dummies += std::holds_alternative<oculus::DummyMessage>(*message);
    EXPECT_GE(dummies, 9) << "30, 60 and 90 ms after each ping";
  });
  for (int pings = 0; pings < 4;) {
    const auto message = client.next();
    ASSERT_TRUE(message);
    EXPECT_TRUE(pings == 0 || std::holds_alternative<oculus::DecodedPing>(*message))
        << "a client that waits for pings gets no keep-alive";
    pings += std::holds_alternative<oculus::DecodedPing>(*message);
  }
  daemon.stop();
  reader.join();
}

}  // namespace
}  // namespace sonar::testing_daemon
