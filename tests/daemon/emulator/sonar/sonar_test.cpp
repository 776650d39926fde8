// Emulated sonars without sockets, threads or a clock: two sonars, their clients, a slow reader and a reload, in virtual time.
#include "daemon/emulator/sonar/sonar.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <list>
#include <map>

#include "daemon/emulator/reload_plan.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/fire.hpp"
#include "tests/daemon/server/sonars/made_up_vendor.hpp"
#include "tests/protocol/delegating_vendor.hpp"

namespace sonar {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr Time start = Time{} + std::chrono::hours(24 * 365 * 50);

Config parsed(const std::string& yaml) {
  std::ofstream(::testing::TempDir() + "/empty.yaml") << "name: empty\n";
  const auto config = parse_config(yaml, "test.yaml", ::testing::TempDir());
  if (!config) throw std::runtime_error(config.error().text);
  return *config;
}

/// The caller of all sonars of a configuration: time passes from one event to the next, pings take no time, and clients read as
/// much as their test lets them.
class VirtualTime {
 public:
  explicit VirtualTime(const std::string& yaml)
      : config(parsed(yaml)), world(pose_rules(config), vehicles_of(config), {}, start) {
    for (const SonarConfig& s : config.sonars) sonars.emplace_back(Sonar::Surroundings{config, world}, s, ++last_index, now);
  }

  struct Client {
    Sonar* sonar = nullptr;
    bool served = false, finished = false, closed = false, waits = false;
    std::string why;
    bool reads = true;
    protocol::Bytes received;
  };
  Sonar& sonar(const std::string& name) {
    return *std::find_if(sonars.begin(), sonars.end(), [&](const Sonar& s) { return s.config().name == name; });
  }
  ConnectionId connect(const std::string& name, Role role = Role::client) {
    const ConnectionId id = ++last_id;
    clients[id].sonar = &sonar(name);
    perform(sonar(name), sonar(name).on_connect(id, role, {"client " + std::to_string(id), {127, 0, 0, 1}}, now));
    return id;
  }
  void send(ConnectionId id, const protocol::Bytes& bytes) {
    Sonar& to = *clients[id].sonar;
    perform(to, to.on_bytes(id, bytes, now));
  }
  void close(ConnectionId id, const std::string& why = "closed by the client") {
    Client& client = clients[id];
    client.closed = true;
    perform(*client.sonar, client.sonar->on_closed(id, why, now));
  }
  void run(std::chrono::nanoseconds time) {
    const Time until = now + time;
    while (Sonar* const sonar = first_due(until)) {
      now = std::max(now, *sonar->next_tick());
      perform(*sonar, sonar->on_tick(now));
    }
    now = until;
  }
  /// As Fleet does it, but for the listeners.
  void reload(const std::string& yaml) {
    const Config next = parsed(yaml);
    for (auto it = sonars.begin(); it != sonars.end();) {
      const auto s = it++;
      const Fate fate = fate_of(s->config(), config, next);
      if (fate == Fate::removed || fate == Fate::changed) {
        perform(*s, s->stop("the configuration changed"));
        retired.splice(retired.end(), sonars, s);
      } else {
        s->move(*sonar_named(next.sonars, s->config().name), now);
      }
    }
    config = next;
    for (const SonarConfig& s : config.sonars)
      if (std::none_of(sonars.begin(), sonars.end(), [&](const Sonar& old) { return old.config().name == s.name; }))
        sonars.emplace_back(Sonar::Surroundings{config, world}, s, ++last_index, now);
  }

  Config config;
  World world;
  Time now = start;
  std::list<Sonar> sonars, retired;
  std::map<ConnectionId, Client> clients;
  std::vector<std::string> log;
  std::uint64_t pings = 0;

 private:
  Sonar* first_due(Time before) {
    Sonar* first = nullptr;
    for (Sonar& s : sonars)
      if (const auto t = s.next_tick(); t && *t < before && (first == nullptr || *t < *first->next_tick())) first = &s;
    return first;
  }
  void perform(Sonar& sonar, Actions actions) {
    for (Action& action : actions) {
      if (auto* compute = std::get_if<ComputePing>(&action)) {
        ++pings;
        perform(sonar, sonar.on_ping({.ping = computed(std::move(compute->request)), .seconds = 1e-3}, now));
      } else if (const auto* serve = std::get_if<Serve>(&action)) {
        clients[serve->connection].served = true;
        clients[serve->connection].waits = false;
      } else if (const auto* wait = std::get_if<KeepWaiting>(&action)) {
        clients[wait->connection].waits = true;
      } else if (const auto* away = std::get_if<TurnAway>(&action)) {
        clients[away->connection].closed = true;
      } else if (const auto* finish = std::get_if<Finish>(&action)) {
        clients[finish->connection].finished = true;
        clients[finish->connection].why = finish->why;
      } else if (const auto* report = std::get_if<Report>(&action)) {
        log.push_back(report->line.phrase);
      }
    }
    for (auto& [id, client] : clients) read(id, client);
  }
  void read(ConnectionId id, Client& client) {
    if (!client.reads || !client.served || client.closed) return;
    while (const Outbox::Message message = client.sonar->next_message(id)) {
      for (std::size_t copy = 0; copy < std::max<std::size_t>(1, message.prefixes.size()); ++copy) {
        if (!message.prefixes.empty())
          client.received.insert(client.received.end(), message.prefixes[copy].begin(), message.prefixes[copy].end());
        client.received.insert(client.received.end(), message.bytes->begin(), message.bytes->end());
      }
      client.sonar->on_written(id, message, now);
    }
    if (client.finished) close(id, client.why);
  }
  static std::shared_ptr<const Ping> computed(PingRequest request) {
    auto ping = std::make_shared<Ping>();
    PingSettings& s = request.settings;
    if (request.model->profile.starts_with("oculus")) s.range_bin_count = std::min(s.range_bin_count, 4);
    const auto beams = static_cast<std::size_t>(s.beam_count), rows = static_cast<std::size_t>(s.range_bin_count);
    ping->samples.resize(beams * rows * static_cast<std::size_t>(s.format.bits) / 8);
    for (std::size_t b = 0; b < beams; ++b)
      ping->beam_azimuth_rad.push_back(0.5f - static_cast<float>(b) / static_cast<float>(beams));
    if (s.format.row_gains) ping->row_gain.assign(rows, 1);
    ping->request = std::move(request);
    return ping;
  }

  ConnectionId last_id = 0;
  std::uint32_t last_index = 0;
};

std::string yaml_of(const std::string& sonars) {
  return "world: {scene: empty.yaml}\nclock: stepped\nvehicles:\n  - {name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, "
         "-3]}}\nsonars:\n" +
         sonars;
}
std::string oculus(const std::string& name, const std::string& address, const std::string& more = {}) {
  return "  - name: " + name + "\n    profile: oculus-m1200d\n    bind_ip: " + address + "\n" + more;
}
const std::string head = "  - name: head\n    profile: blueview-p900-90\n    bind_ip: 127.0.0.3\n";

protocol::Bytes fire(oculus::PingRate rate = oculus::PingRate::hz10) {
  sonar::oculus::FireRequest request = sonar::oculus::stored_fire();
  request.settings.ping_rate = rate;
  request.settings.range = 10;
  return sonar::oculus::make_fire(request);
}

std::vector<std::uint32_t> ping_numbers(const protocol::Bytes& received) {
  sonar::oculus::Decoder decoder;
  decoder.append(received);
  std::vector<std::uint32_t> numbers;
  while (const auto message = decoder.next())
    if (const auto* ping = std::get_if<sonar::oculus::DecodedPing>(&*message)) numbers.push_back(ping->head.fixed.ping_id);
  EXPECT_EQ(decoder.skipped_bytes(), 0u);
  EXPECT_EQ(decoder.buffered_bytes(), 0u);
  return numbers;
}

TEST(SonarInVirtualTime, TwoSonarsThreeClientsASlowReaderAReloadAndAThousandPings) {
  VirtualTime time(yaml_of(oculus("front", "127.0.0.2", "    clients: {max: 2}\n") + head));
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
  time.reload(yaml_of(oculus("front", "127.0.0.2", "    clients: {max: 2}\n    mount: {frame: FLU, xyz_m: [1, 0, 0]}\n")));
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

TEST(SonarInVirtualTime, AFullSonarTurnsAwayQueuesOrIsTakenOver) {
  VirtualTime time(yaml_of(oculus("close", "127.0.0.2") + oculus("queue", "127.0.0.3", "    clients: {when_full: queue}\n") +
                           oculus("take", "127.0.0.4", "    clients: {when_full: take_over}\n")));
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
  VirtualTime time(yaml_of(oculus("front", "127.0.0.2")));
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
  VirtualTime time(yaml_of(oculus("front", "127.0.0.2")));
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

TEST(SonarInVirtualTime, ReceiversAreTheDevicesOwnAndThoseOfItsClients) {
  using testing_daemon::made_up_vendor;
  VirtualTime time(yaml_of(oculus("front", "127.0.0.2", "    clients: {max: 2}\n")));
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
  EXPECT_TRUE(sonar.next_ping()) << "the group is one";

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
  EXPECT_THAT(sonar.receivers(10), SizeIs(16)) << "a host cannot have the world sent to";
}

/// Makes nothing of its first ping but an exception.
class FaultyDatagrams final : public protocol::DelegatingVendor {
 public:
  using DelegatingVendor::DelegatingVendor;
  std::vector<protocol::Bytes> datagrams(const protocol::Port& port, const Ping& ping,
                                         const protocol::DeviceState& device) const override {
    if (static_cast<std::uint32_t>(ping.request.number) == 1) throw std::runtime_error("no such luck");
    return DelegatingVendor::datagrams(port, ping, device);
  }
};

TEST(SonarInVirtualTime, AnExceptionInThePingsOfAStreamCostsThatPing) {
  VirtualTime time(yaml_of(oculus("front", "127.0.0.2")));
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
  EXPECT_FALSE(sonar.next_message(10));
  ping();
  EXPECT_TRUE(sonar.next_message(10)) << "the stream goes on";
  sonar.on_not_sent(10);
  const DeviceFigures f = sonar.figures();
  EXPECT_EQ(f.offered, 1u);
  EXPECT_EQ(f.dropped, 1u);
}

/// A mistake in the code of one conversation.
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
  VirtualTime time(yaml_of(oculus("front", "127.0.0.2", "    clients: {max: 3}\n")));
  const FaultyVendor vendor(*time.config.sonars[0].profile.vendor);
  SonarConfig config = time.config.sonars[0];
  config.profile.vendor = &vendor;
  Sonar sonar({time.config, time.world}, config, 0, start);
  for (const ConnectionId id : {1, 2}) sonar.on_connect(id, Role::client, {"client", {}}, start);
  const Actions of_bytes = sonar.on_bytes(1, fire(), start);
  ASSERT_THAT(of_bytes, SizeIs(2));
  EXPECT_EQ(std::get<Report>(of_bytes[0]).line.phrase, "internal fault: no such luck");
  EXPECT_EQ(std::get<Reset>(of_bytes[1]).connection, 1u);
  const Actions of_tick = sonar.on_tick(start + milliseconds(100));
  ASSERT_THAT(of_tick, SizeIs(2)) << "the other one only";
  EXPECT_EQ(std::get<Reset>(of_tick[1]).connection, 2u);
  EXPECT_THAT(sonar.on_tick(start + milliseconds(200)), SizeIs(0)) << "and once";
}

}  // namespace
}  // namespace sonar
