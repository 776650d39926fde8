// Emulated sonars without sockets, threads or a clock: two sonars, their clients, a slow reader and a reload, in virtual time.
#include "daemon/emulator/sonar/sonar.hpp"

#include <gmock/gmock.h>

#include "protocol/blueview/frames.hpp"
#include "tests/daemon/emulator/sonar/virtual_time.hpp"
#include "tests/daemon/server/sonars/made_up_vendor.hpp"
#include "tests/protocol/delegating_vendor.hpp"

namespace sonar {
namespace {

using namespace testing_emulator;
using std::chrono::milliseconds;
using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(SonarInVirtualTime, TwoSonarsServeThreeClientsOverAReload) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2", "    clients: {max: 2}\n") + head));
  const ConnectionId quick = time.connect("front"), slow = time.connect("front"), host = time.connect("head");
  time.clients[slow].reads = false;
  time.send(quick, fire(oculus::PingRate::hz40));

  protocol::Bytes hello;
  const blueview::Put put(hello);
  put("proto", blueview::protocol_version);
  put("abi", std::uint16_t{4});
  blueview::put_text(hello, "test");
  time.send(host, blueview::make_frame(blueview::FrameType::hello, 1, hello));
  protocol::Bytes subscribe;
  const blueview::Put subscription(subscribe);
  subscription("head", std::int32_t{0});
  subscription("interval_ms", std::uint32_t{100});
  time.send(host, blueview::make_frame(blueview::FrameType::subscribe, 2, subscribe));

  time.run(std::chrono::seconds(15));
  const std::uint64_t before = time.pings;
  time.reload(yaml_of(oculus_sonar("front", "127.0.0.2", "    clients: {max: 2}\n    mount: {frame: FLU, xyz_m: [1, 0, 0]}\n")));
  EXPECT_TRUE(time.clients[host].closed);
  EXPECT_EQ(time.clients[host].why, "the configuration changed");
  EXPECT_FALSE(time.clients[quick].closed) << "a sonar that only moved keeps its clients";
  EXPECT_EQ(time.sonar("front").config().mount.position_m.x, 1);
  time.run(std::chrono::seconds(15));

  EXPECT_GE(time.pings, 1000u);
  EXPECT_GT(time.pings, before);
  const auto numbers = ping_numbers(time.clients[quick].received);
  ASSERT_THAT(numbers, SizeIs(time.sonar("front").pings()));
  for (std::size_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(numbers[i], i + 1);

  const Connection& lagging = *time.sonar("front").connections().find(slow);
  EXPECT_EQ(lagging.outbox.pings_offered(), numbers.size());
  EXPECT_EQ(lagging.outbox.pings_waiting(), static_cast<std::size_t>(time.config.sonars[0].outbox.depth));
  EXPECT_EQ(lagging.outbox.pings_dropped() + lagging.outbox.pings_waiting(), lagging.outbox.pings_offered());
  EXPECT_GT(time.clients[host].received.size(), 100u * 1000);
}

TEST(SonarInVirtualTime, AFullSonarRefusesOrQueuesAClientOrDropsAnother) {
  VirtualTime time(yaml_of(oculus_sonar("close", "127.0.0.2") +
                           oculus_sonar("queue", "127.0.0.3", "    clients: {when_full: queue}\n") +
                           oculus_sonar("take", "127.0.0.4", "    clients: {when_full: take_over}\n")));
  const ConnectionId first = time.connect("close"), refused = time.connect("close");
  EXPECT_TRUE(time.clients[first].served);
  EXPECT_TRUE(time.clients[refused].closed);
  EXPECT_EQ(time.sonar("close").figures().refused_clients, 1u);

  const ConnectionId served = time.connect("queue"), waiting = time.connect("queue");
  EXPECT_TRUE(time.clients[waiting].waits);
  EXPECT_EQ(time.sonar("queue").figures().clients_queued, 1u);
  time.close(served);
  EXPECT_TRUE(time.clients[waiting].served);

  const ConnectionId old = time.connect("take"), taker = time.connect("take");
  EXPECT_TRUE(time.clients[old].finished);
  EXPECT_EQ(time.clients[old].why, "another client took over");
  EXPECT_TRUE(time.clients[taker].served);
  EXPECT_EQ(time.sonar("take").figures().clients_now, 1u);
}

TEST(SonarInVirtualTime, ObserversReceiveThePingsOfClientsAndChangeNothing) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  const ConnectionId observer = time.connect("front", Role::observer);
  time.send(observer, fire());
  time.run(milliseconds(500));
  EXPECT_EQ(time.pings, 0u) << "no ping is computed for an observer";
  EXPECT_THAT(time.log, ::testing::ElementsAre(HasSubstr("request of an observer ignored")));
  const ConnectionId client = time.connect("front");
  time.send(client, fire());
  time.run(milliseconds(950));
  EXPECT_THAT(ping_numbers(time.clients[client].received), SizeIs(::testing::Ge(5)));
  EXPECT_EQ(ping_numbers(time.clients[observer].received), ping_numbers(time.clients[client].received));
}

TEST(SonarInVirtualTime, APingWhoseClientLeftIsUnwanted) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  Sonar& sonar = time.sonar("front");
  const ConnectionId client = time.connect("front");
  Actions actions = sonar.on_bytes(client, fire(), time.now);
  actions = sonar.on_tick(*sonar.next_ping());
  ASSERT_TRUE(std::holds_alternative<ComputePing>(actions.back()));
  auto ping = std::make_shared<Ping>();
  ping->request = std::get<ComputePing>(actions.back()).request;
  time.close(client);
  const ConnectionId next = time.connect("front");
  sonar.on_ping({.ping = ping}, time.now);
  EXPECT_EQ(sonar.figures().unwanted, 1u);
  EXPECT_EQ(sonar.figures().offered, 0u);
  time.send(next, fire());
  time.run(milliseconds(500));
  EXPECT_EQ(sonar.figures().unwanted, 1u) << "the pings of the next client are wanted";
  EXPECT_GT(sonar.figures().offered, 1u);
}

TEST(SonarInVirtualTime, ATickThatWaitedForThePreviousPingFollowsAtOnce) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  Sonar& sonar = time.sonar("front");
  const ConnectionId client = time.connect("front");
  time.clients[client].reads = false;
  sonar.on_bytes(client, fire(), time.now);
  const auto asked = [](const Actions& actions) {
    const ComputePing* ping = actions.empty() ? nullptr : std::get_if<ComputePing>(&actions.back());
    return ping == nullptr ? std::nullopt : std::optional(ping->request);
  };
  const auto first = asked(sonar.on_tick(*sonar.next_ping()));
  ASSERT_TRUE(first);
  const Time tick = *sonar.next_ping();
  EXPECT_FALSE(asked(sonar.on_tick(tick))) << "the engine is busy";
  const auto second = asked(sonar.on_ping({.ping = VirtualTime::computed(*first)}, tick + milliseconds(20)));
  ASSERT_TRUE(second);
  EXPECT_EQ(second->fired_at, tick);
  EXPECT_EQ(static_cast<std::uint32_t>(second->number), 2u);
  EXPECT_EQ(sonar.figures().skipped_ticks, 0u);
  EXPECT_GT(*sonar.next_ping(), tick + milliseconds(20));
}

TEST(SonarInVirtualTime, ReceiversAreTheDevicesOwnAndThoseOfItsClients) {
  using testing_daemon::made_up_vendor;
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2", "    clients: {max: 2}\n")));
  SonarConfig config = time.config.sonars[0];
  config.profile = {&made_up_vendor(), made_up_vendor().models().front()};
  Sonar sonar({time.config, time.world}, config, 0, start);
  std::vector<const protocol::Port*> streams;
  for (const protocol::Port& port : made_up_vendor().ports())
    if (port.kind == protocol::Port::Kind::udp_stream) streams.push_back(&port);
  ASSERT_THAT(streams, SizeIs(2));
  sonar.open_stream(10, *streams[0], start);
  EXPECT_FALSE(sonar.next_ping()) << "no ping without a receiver";
  sonar.open_stream(11, *streams[1], start);
  EXPECT_THAT(sonar.receivers(11), ::testing::ElementsAre(streams[1]->group));
  EXPECT_TRUE(sonar.next_ping()) << "the multicast group is a receiver";

  const auto line = [](const std::string& text) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    return protocol::Bytes(bytes.begin(), bytes.end());
  };
  const protocol::Endpoint own{{127, 0, 0, 9}, 7}, other{{10, 0, 0, 1}, 8};
  sonar.on_connect(1, Role::client, {"client", own.ip}, start);
  sonar.on_bytes(1, line("receivers 0.0.0.0:7 10.0.0.1:8 10.0.0.1:8\n"), start);
  EXPECT_THAT(sonar.receivers(10), ::testing::ElementsAre(own, other));
  sonar.on_datagram(made_up_vendor().ports()[3], {own.ip, 99}, line("receivers 127.0.0.9:7 10.0.0.2:9"), start);
  EXPECT_THAT(sonar.receivers(10), ::testing::UnorderedElementsAre(own, other, protocol::Endpoint{{10, 0, 0, 2}, 9}));
  sonar.on_closed(1, "closed by the client", start);
  EXPECT_THAT(sonar.receivers(10), ::testing::ElementsAre(own, protocol::Endpoint{{10, 0, 0, 2}, 9}));
  std::string many = "receivers";
  for (int i = 1; i <= 100; ++i) many += " 10.0.1." + std::to_string(i) + ":1";
  sonar.on_datagram(made_up_vendor().ports()[3], {own.ip, 99}, line(many), start);
  EXPECT_THAT(sonar.receivers(10), SizeIs(16)) << "the receivers that a host can set are limited";
}

/// A make that throws an exception instead of returning the datagrams of ping 1.
class FaultyDatagrams final : public protocol::DelegatingVendor {
 public:
  using DelegatingVendor::DelegatingVendor;
  std::vector<protocol::Bytes> datagrams(const protocol::Port& port, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    const bool is_stream = port.kind == protocol::Port::Kind::udp_stream;
    if (is_stream && static_cast<std::uint32_t>(ping.request.number) == 1) throw std::runtime_error("no such luck");
    return DelegatingVendor::datagrams(port, ping, device);
  }
};

TEST(SonarInVirtualTime, AnExceptionInThePingsOfAStreamCostsThatPing) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  const FaultyDatagrams vendor(testing_daemon::made_up_vendor());
  SonarConfig config = time.config.sonars[0];
  config.profile = {&vendor, vendor.models().front()};
  Sonar sonar({time.config, time.world}, config, 0, start);
  sonar.open_stream(10, vendor.ports()[5], start);  // to the group
  Time now = start;
  const auto ping = [&] {
    now = *sonar.next_tick();
    for (Action& action : sonar.on_tick(now))
      if (auto* compute = std::get_if<ComputePing>(&action)) {
        auto made = std::make_shared<Ping>();
        made->request = std::move(compute->request);
        return sonar.on_ping({.ping = made}, now);
      }
    return Actions{};
  };
  const Actions faulty = ping();
  ASSERT_TRUE(std::holds_alternative<Report>(faulty.front()));
  EXPECT_EQ(std::get<Report>(faulty.front()).line.phrase, "internal fault: no such luck");
  EXPECT_THAT(faulty, ::testing::Not(::testing::Contains(::testing::VariantWith<Reset>(::testing::_))));
  EXPECT_FALSE(sonar.next_message(10, start));
  ping();
  EXPECT_TRUE(sonar.next_message(10, start)) << "the stream continues";
  sonar.on_not_sent(10);
  const DeviceFigures f = sonar.figures();
  EXPECT_EQ(f.offered, 1u);
  EXPECT_EQ(f.dropped, 1u);
}

/// Counts how often a ping is framed, as a message and as the datagrams of each port.
class CountingVendor final : public protocol::DelegatingVendor {
 public:
  using DelegatingVendor::DelegatingVendor;
  std::vector<protocol::Bytes> datagrams(const protocol::Port& port, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    ++datagrams_of[&port];
    return DelegatingVendor::datagrams(port, ping, device);
  }
  std::shared_ptr<const protocol::Bytes> frame(const Ping& ping, const protocol::DeviceState& device) const override {
    ++messages;
    return frames ? DelegatingVendor::frame(ping, device) : nullptr;
  }
  bool is_request(const protocol::Port&, protocol::BytesView) const override { return true; }
  bool frames = true;  // false: a ping consists of the parts of its TCP ports
  mutable int messages = 0;
  mutable std::map<const protocol::Port*, int> datagrams_of;
};

/// A sonar of the made-up make with four clients: two at a port for datagrams and two at a TCP port.
struct FramedPings : ::testing::Test {
  FramedPings() {
    config.profile = {&vendor, vendor.models().front()};
    for (const protocol::Port& port : vendor.ports()) {
      if (port.number != testing_daemon::data_port) continue;
      (port.kind == protocol::Port::Kind::udp_dialogue ? udp : tcp) = &port;
    }
    sonar.emplace(Sonar::Surroundings{time.config, time.world, nullptr}, config, 0, start);
    for (const ConnectionId id : {1u, 2u, 3u, 4u})
      sonar->on_connect(id, Role::client, {"client", {10, 0, 0, static_cast<std::uint8_t>(id)}, 9}, now, id < 3 ? udp : tcp);
  }
  /// Returns the message of the next ping to each client.
  std::vector<Outbox::Message> ping() {
    for (bool made = false; !made;) {
      now = *sonar->next_tick();
      for (Action& action : sonar->on_tick(now))
        if (auto* compute = std::get_if<ComputePing>(&action)) {
          auto result = std::make_shared<Ping>();
          result->request = std::move(compute->request);
          result->samples.resize(3200);
          sonar->on_ping({.ping = result}, now);
          made = true;
        }
    }
    std::vector<Outbox::Message> all;
    for (const ConnectionId id : {1u, 2u, 3u, 4u}) {
      all.push_back(sonar->next_message(id, now));
      sonar->on_written(id, all.back(), now);
    }
    return all;
  }
  void add_fault(const std::string& what) {
    FaultRecord record;
    record.what = what;
    const auto faults = check_fault(record, true);
    ASSERT_TRUE(faults);
    ASSERT_FALSE(sonar->why_no_faults(*faults));
    sonar->add_faults(*faults, true, now);
  }

  VirtualTime time{yaml_of(oculus_sonar("front", "127.0.0.2", "    clients: {max: 4}\n"))};
  CountingVendor vendor{testing_daemon::made_up_vendor()};
  SonarConfig config = time.config.sonars[0];
  const protocol::Port *udp = nullptr, *tcp = nullptr;
  std::optional<Sonar> sonar;
  Time now = start;
};

TEST_F(FramedPings, AreFramedOncePerPort) {
  const auto messages = ping();
  EXPECT_EQ(vendor.messages, 1);
  EXPECT_EQ(vendor.datagrams_of[tcp], 1);
  EXPECT_EQ(vendor.datagrams_of[udp], 1);
  ASSERT_TRUE(messages[0].datagrams && messages[2].bytes);
  EXPECT_EQ(messages[0].datagrams, messages[1].datagrams) << "the datagrams are shared, not copied";
  EXPECT_EQ(messages[2].bytes, messages[3].bytes);
}

TEST_F(FramedPings, ArePartsOfTheTcpPortsWithoutAFrame) {
  vendor.frames = false;
  const auto messages = ping();
  EXPECT_EQ(vendor.datagrams_of[tcp], 1) << "the whole message is made of the same parts";
  ASSERT_TRUE(messages[2].bytes);
  EXPECT_EQ(messages[2].bytes, messages[3].bytes);
}

TEST_F(FramedPings, AreSharedAgainAfterAFault) {
  add_fault("part-lost");
  const auto during = ping();
  EXPECT_NE(during[0].datagrams, during[1].datagrams) << "during a fault each client has bytes of its own";
  const auto after = ping();
  ASSERT_TRUE(after[0].datagrams);
  EXPECT_EQ(after[0].datagrams, after[1].datagrams) << "the fault has ended";
}

/// Returns the warnings of a sonar for which computing a ping takes three ping periods.
std::vector<std::string> warnings_of_slow_pings(bool recorded) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  Sonar& sonar = time.sonar("front");
  std::vector<std::string> warnings;
  constexpr Time never = Time::max();
  Time done = never;  // when the ping that is being computed is done
  const auto carry_out = [&](const Actions& actions) {
    for (const Action& action : actions) {
      const auto* const report = std::get_if<Report>(&action);
      if (report != nullptr && report->line.level == LogLevel::warning) warnings.push_back(report->line.phrase);
      if (std::holds_alternative<ComputePing>(action)) done = time.now + milliseconds(300);
    }
  };
  const ConnectionId client = time.connect("front");
  carry_out(sonar.on_bytes(client, fire(oculus::PingRate::hz10), time.now));
  for (const Time end = time.now + std::chrono::seconds(30); time.now < end;) {
    time.now = std::max(time.now, sonar.next_tick().value_or(end));
    carry_out(sonar.on_tick(time.now));
    if (time.now < done) continue;
    done = never;
    PingOutcome outcome{.failure = "not needed here", .refused = true, .seconds = 0.3};
    if (recorded) outcome.recorded = std::make_shared<const PartsByPort>();
    carry_out(sonar.on_ping(outcome, time.now));
  }
  return warnings;
}

TEST(SonarInVirtualTime, PingsOfARecordingAreNotTooSlow) {
  EXPECT_THAT(warnings_of_slow_pings(false), ::testing::Contains(HasSubstr("computing takes 300 ms per ping")));
  EXPECT_THAT(warnings_of_slow_pings(true), ::testing::Not(::testing::Contains(HasSubstr("computing takes"))));
}

/// Latency is measured with this computer's clock, not with the device's.
TEST(SonarInVirtualTime, LatencyIsMeasuredFromTheTrueTimeOfAPing) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2")));
  const ConnectionId client = time.connect("front");
  FaultRecord record;
  record.what = "T02";
  record.with = {{"seconds", "-3600"}};
  time.add_fault("front", record);
  time.send(client, fire());
  time.run(milliseconds(250));
  const DeviceFigures f = time.sonar("front").figures();
  ASSERT_GE(f.latency.count(), 2u);
  EXPECT_EQ(f.latency.count(), f.sent);
  EXPECT_LT(f.latency.sum_s(), 1) << "the latency includes the error of the device's clock, an hour";
}

/// Stands for a bug in the code of one conversation.
class FaultyDialogue final : public protocol::Dialogue {
 public:
  explicit FaultyDialogue(Time now) : next_(now + milliseconds(100)) {}
  protocol::Reaction on_bytes(protocol::BytesView, Time) override { throw std::runtime_error("no such luck"); }
  protocol::Reaction on_tick(Time, bool) override { throw std::runtime_error("bad tick"); }
  Time next_tick() const override { return next_; }
  void on_ping_queued(Time) override {}

 private:
  Time next_;
};
class FaultyVendor final : public protocol::DelegatingVendor {
 public:
  using DelegatingVendor::DelegatingVendor;
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port&, const protocol::DeviceState&, Time now) const override {
    return std::make_unique<FaultyDialogue>(now);
  }
  bool pings_before_first_request(const protocol::DeviceState&) const override { return false; }
};

TEST(SonarInVirtualTime, AnExceptionEndsTheConnectionItHappensIn) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2", "    clients: {max: 3}\n")));
  const FaultyVendor vendor(*time.config.sonars[0].profile.vendor);
  SonarConfig config = time.config.sonars[0];
  config.profile.vendor = &vendor;
  Sonar sonar({time.config, time.world}, config, 0, start);
  for (const ConnectionId id : {1u, 2u}) sonar.on_connect(id, Role::client, {"client", {}}, start);
  const Actions of_bytes = sonar.on_bytes(1, fire(), start);
  ASSERT_THAT(of_bytes, SizeIs(2));
  EXPECT_EQ(std::get<Report>(of_bytes[0]).line.phrase, "internal fault: no such luck");
  EXPECT_EQ(std::get<Reset>(of_bytes[1]).connection, 1u);
  const Actions of_tick = sonar.on_tick(start + milliseconds(100));
  ASSERT_THAT(of_tick, SizeIs(2)) << "only the other connection";
  EXPECT_EQ(std::get<Reset>(of_tick[1]).connection, 2u);
  EXPECT_THAT(sonar.on_tick(start + milliseconds(200)), SizeIs(0)) << "each connection is ended once";
}

}  // namespace
}  // namespace sonar
