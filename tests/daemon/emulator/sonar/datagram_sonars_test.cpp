// A Sonar 3D-15, a Surveyor and a Ping1D over UDP in virtual time: the datagrams to their receivers, also during faults.
#include <gmock/gmock.h>

#include "protocol/ping/messages.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "tests/daemon/emulator/sonar/virtual_time.hpp"

namespace sonar::datagram_sonars_test {
namespace {

using namespace testing_emulator;
using protocol::Bytes;
using protocol::Endpoint;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr ConnectionId stream = 99;

/// A sonar in virtual time; pings() returns the datagrams of each ping.
struct Talk {
  explicit Talk(const std::string& profile, const std::string& options = {})
      : time(yaml_of("  - name: front\n    profile: " + profile + "\n    bind_ip: 127.0.0.2\n" + options)) {}
  Sonar& sonar() { return time.sonar("front"); }
  std::vector<std::vector<Bytes>> pings(milliseconds length) {
    std::vector<std::vector<Bytes>> all;
    for (const Time end = time.now + length; time.now < end;) {
      time.run(milliseconds(10));
      while (const Outbox::Message message = sonar().next_message(stream, time.now)) {
        if (message.datagrams) all.push_back(*message.datagrams);
        sonar().on_written(stream, message, time.now);
      }
    }
    return all;
  }
  void add_fault(const std::string& what, std::map<std::string, std::string> with = {}, const std::string& client = {}) {
    FaultRecord record;
    record.what = what;
    record.with = std::move(with);
    record.client = client;
    time.add_fault("front", record);
  }
  VirtualTime time;
};

// ---- Sonar 3D-15

struct Imager : Talk {
  explicit Imager(const std::string& more = {})
      : Talk("waterlinked-3d15", "    options: {acoustics_at_start: enabled, udp_at_start: multicast" + more + "}\n") {
    sonar().open_stream(stream, *sonar().vendor().port(protocol::Port::Kind::udp_stream), time.now);
  }
  void post(const std::string& path, const std::string& body) {
    const protocol::Port& http = *sonar().vendor().port(protocol::Port::Kind::http);
    const protocol::ResourceRequest request{"POST", "/api/v1/integration" + path, "", "application/json", body, {127, 0, 0, 1}};
    EXPECT_EQ(sonar().on_http(http, request, time.now).reply.status, 204u) << path;
  }
  void send_to(const std::string& ip) {
    post("/udp", R"({"mode":"unicast","unicast_destination_ip":")" + ip + R"(","unicast_destination_port":4747})");
  }
  static waterlinked::Decoded read(const Bytes& datagram) {
    const auto content = waterlinked::rip_content(datagram);
    EXPECT_TRUE(content);
    return content ? waterlinked::decode(*content) : waterlinked::Decoded{};
  }
};
constexpr Endpoint group{{224, 0, 0, 96}, 4747}, host{{10, 0, 0, 5}, 4747};

TEST(Sonar3d15InVirtualTime, TheReceiverIsASetting) {
  Imager imager;
  imager.send_to("10.0.0.5");
  EXPECT_THAT(imager.sonar().receivers(stream), ElementsAre(host));
  imager.add_fault("D01");
  imager.send_to("10.0.0.6");
  EXPECT_THAT(imager.sonar().receivers(stream), ElementsAre(host)) << "the device ignores this setting as all others";
  imager.time.end_faults("front");
  imager.post("/udp", R"({"mode":"disabled"})");
  EXPECT_THAT(imager.sonar().receivers(stream), IsEmpty());
  EXPECT_THAT(imager.pings(seconds(1)), IsEmpty());
  imager.send_to("10.0.0.5");
  imager.add_fault("D05");
  EXPECT_THAT(imager.sonar().receivers(stream), ElementsAre(group)) << "the device forgets this setting as all others";
  EXPECT_EQ(imager.pings(seconds(1)).size(), 5u);
}

TEST(Sonar3d15InVirtualTime, SendsAHundredImuSamplesPerSecondAtAnyRate) {
  Imager imager;
  imager.post("/output/imu-batch/enabled", "true");
  imager.pings(seconds(1));
  protocol::SettingsOverride slower;
  slower.rate_hz = 3;
  EXPECT_TRUE(imager.sonar().change(slower, "test", imager.time.now));
  imager.pings(seconds(1));
  std::vector<Time> at;
  for (const auto& shot : imager.pings(seconds(10))) {
    const auto batch = imager.read(shot.at(2)).imu;
    ASSERT_TRUE(batch);
    for (const auto& sample : batch->samples) at.push_back(sample.at);
  }
  EXPECT_NEAR(static_cast<double>(at.size()), 1000, 34) << "at either end, the samples of a shot may be missing or too many";
  for (std::size_t i = 1; i < at.size(); ++i) ASSERT_EQ(at[i] - at[i - 1], milliseconds(10)) << i;
}

TEST(Sonar3d15InVirtualTime, TheSpeedOfSoundFollowsItsDepth) {
  Imager imager;
  const auto speed = [&] { return imager.read(imager.pings(milliseconds(400)).back().front()).ranges->shot.speed_of_sound_mps; };
  const float above = speed();
  imager.sonar().move_mount({{0, 0, -500}, {}}, imager.time.now);
  EXPECT_NEAR(static_cast<double>(speed() - above), 8.2, 1);
  imager.post("/acoustics/speed_of_sound", "1491");
  EXPECT_FLOAT_EQ(speed(), 1491);
}

// ---- Surveyor

struct Sounder : Talk {
  explicit Sounder(protocol::Port::Kind kind = protocol::Port::Kind::udp_dialogue) : Talk("surveyor-240") {
    time.clients[stream].sonar = &sonar();
    time.clients[stream].reads = false;  // pings() does
    const protocol::Port& port = *sonar().vendor().port(kind);
    sonar().on_connect(stream, Role::client, {"host", {10, 0, 0, 5}, 5000}, time.now, &port);
    ping::PingParameters parameters;
    parameters.end_mm = 10000;
    parameters.period_ms = 100;
    parameters.enable = parameters.atof = parameters.yz = 1;
    send(ping::framed_message(ping::Id::set_ping_parameters, 0, parameters));
  }
  void send(const Bytes& frame) { time.send(stream, frame); }
  /// Returns the next ping that is sent over TCP.
  Outbox::Message ping_by_tcp() {
    for (const Time end = time.now + seconds(2); time.now < end; time.run(milliseconds(10)))
      while (Outbox::Message message = sonar().next_message(stream, time.now)) {
        sonar().on_written(stream, message, time.now);
        if (message.ping != 0) return message;
      }
    throw std::runtime_error("no ping");
  }
  /// Returns the frames of the next ping. Checks that each datagram is a frame with the right sum.
  std::vector<ping::Frame> frames() {
    std::vector<ping::Frame> all;
    const auto sent = pings(milliseconds(150));
    for (const Bytes& datagram : sent.at(0)) {
      ping::Framer framer(65535, true);
      framer.append(datagram);
      const auto frame = framer.next();
      EXPECT_TRUE(frame && frame->sum_is_right);
      if (frame) all.push_back(*frame);
    }
    return all;
  }
  ping::AtofPointData atof() {
    ping::AtofPointData data;
    for (const ping::Frame& frame : frames()) {
      wire::Reader reader(frame.payload);
      if (frame.header.id == ping::Id::atof_point_data) fields(reader, data);
    }
    return data;
  }
};

TEST(SurveyorInVirtualTime, AFrameWithAFaultyFieldHasTheRightSum) {
  Sounder sounder;
  const std::uint32_t before = sounder.atof().ping;
  ASSERT_GT(before, 0u);
  sounder.add_fault("D09", {{"by", "1000"}}, "2");
  EXPECT_LT(sounder.atof().ping, 1000u) << "the fault is for another client";
  sounder.time.end_faults("front");
  sounder.add_fault("D09", {{"by", "1000"}});
  EXPECT_GT(sounder.atof().ping, 1000u);
}

/// ping-python reads one message of each packet: several in one packet would accumulate in the host.
TEST(SurveyorInVirtualTime, MessagesAreWrittenOneByOneOverTcp) {
  Sounder sounder(protocol::Port::Kind::tcp_stream);
  const Outbox::Message message = sounder.ping_by_tcp();
  ASSERT_TRUE(message.shape);
  std::size_t begin = 0;
  std::vector<std::size_t> ends;
  for (const Outbox::Shape::Pause& pause : message.shape->pauses) {
    EXPECT_GE(pause.length, milliseconds(1));
    ends.push_back(pause.before);
  }
  ends.push_back(message.bytes->size());
  EXPECT_GE(ends.size(), 3u) << "attitude, points, point data, and a request for the time until the host has sent it";
  for (const std::size_t end : ends) {
    ping::Framer framer(65535, true);
    framer.append(protocol::BytesView(*message.bytes).subspan(begin, end - begin));
    const auto frame = framer.next();
    EXPECT_TRUE(frame && frame->sum_is_right) << begin;
    EXPECT_FALSE(framer.next()) << "a part has one frame";
    begin = end;
  }
  // If a fault adds bytes, the messages end at other places.
  const std::size_t usual = sounder.ping_by_tcp().bytes->size();
  sounder.add_fault("F01");
  const Outbox::Message longer = sounder.ping_by_tcp();
  EXPECT_GT(longer.bytes->size(), usual);
  EXPECT_FALSE(longer.shape);
}

TEST(SurveyorInVirtualTime, HasTheTimeOfTheHostAfterSkippedTime) {
  constexpr std::uint64_t utc_ms = 1'700'000'000'000;
  Sounder sounder;
  EXPECT_EQ(sounder.atof().utc_ms, 0u);
  sounder.sonar().skip(seconds(1000));
  sounder.time.now += seconds(1000);
  sounder.send(ping::framed_message(ping::Id::utc_response, 0, ping::UtcResponse{.utc_ms = utc_ms}));
  EXPECT_NEAR(static_cast<double>(sounder.atof().utc_ms - utc_ms), 100, 100);
}

// ---- hosts of any make

/// The port of the previous host is closed, and a request of the next host arrives before on_closed() is called.
TEST(HostByDatagrams, DoesNotGetTheSettingsOfThePreviousHost) {
  for (const protocol::Vendor* const vendor : protocol::vendors()) {
    const protocol::Port* const port = vendor->port(protocol::Port::Kind::udp_dialogue);
    if (port == nullptr) continue;
    SCOPED_TRACE(vendor->name());
    Talk talk(vendor->models().front()->profile, "    clients: {max: 2, when_full: take_over}\n");
    Sonar& sonar = talk.sonar();
    const auto connect = [&](ConnectionId id) {
      sonar.on_connect(id, Role::client, {"host", {10, 0, 0, static_cast<std::uint8_t>(id)}, 5000}, talk.time.now, port);
    };
    const double range_m = sonar.settings().range_m;
    connect(1);
    protocol::SettingsOverride wanted;
    wanted.range_m = 7;
    ASSERT_TRUE(sonar.change(wanted, "host", talk.time.now));
    sonar.finish(1, talk.time.now);
    EXPECT_EQ(sonar.connections().clients(), 0u);
    connect(2);
    EXPECT_EQ(sonar.settings().range_m, range_m) << "the setting of the previous host is still in use";
    EXPECT_EQ(sonar.state().connected_client, (protocol::Ipv4{10, 0, 0, 2}));
    connect(3);
    sonar.finish(2, talk.time.now);
    connect(4);
    EXPECT_EQ(sonar.connections().find(3)->state, Connection::State::served) << "a slot was free";
    connect(5);
    EXPECT_EQ(sonar.connections().clients(), 2u);
    EXPECT_EQ(sonar.connections().find(3)->state, Connection::State::leaving) << "the oldest host that has not left must leave";
    for (const ConnectionId id : {1ul, 2ul, 3ul}) sonar.on_closed(id, "it has left", talk.time.now);
    EXPECT_EQ(sonar.connections().clients(), 2u);
  }
}

/// Carries out the actions in the daemon's order: the UDP host leaves, and then the other clients are reset.
TEST(HostByDatagrams, AFaultEndsItTogetherWithTheClientsThatWait) {
  Talk talk("surveyor-240", "    clients: {max: 1, when_full: queue}\n");
  Sonar& sonar = talk.sonar();
  const auto connect = [&](ConnectionId id, protocol::Port::Kind by) {
    sonar.on_connect(id, Role::client, {"host", {10, 0, 0, 5}, 5000}, talk.time.now, sonar.vendor().port(by));
  };
  connect(1, protocol::Port::Kind::udp_dialogue);
  connect(2, protocol::Port::Kind::tcp_stream);
  ASSERT_EQ(sonar.connections().find(2)->state, Connection::State::waiting);
  FaultRecord record;
  record.what = "L01";
  const auto faults = check_fault(record, true);
  ASSERT_TRUE(faults) << faults.error().text;
  std::vector<ConnectionId> finished, reset;
  for (const Action& action : sonar.add_faults(*faults, true, talk.time.now)) {
    if (const auto* finish = std::get_if<Finish>(&action)) {
      finished.push_back(finish->connection);
      for (const Action& next : sonar.finish(finish->connection, talk.time.now))
        EXPECT_FALSE(std::holds_alternative<Serve>(next)) << "a client is served and then reset";
    } else if (const auto* end = std::get_if<Reset>(&action)) {
      reset.push_back(end->connection);
      sonar.on_closed(end->connection, end->why, talk.time.now);
    }
  }
  EXPECT_THAT(finished, ElementsAre(1));
  EXPECT_THAT(reset, ElementsAre(2));
}

// ---- Ping1D

struct Altimeter : Talk {
  Altimeter() : Talk("ping1d") {
    time.clients[stream].sonar = &sonar();
    time.clients[stream].reads = false;  // pings() does
    const protocol::Port& port = *sonar().vendor().port(protocol::Port::Kind::udp_dialogue);
    sonar().on_connect(stream, Role::client, {"host", {10, 0, 0, 5}, 5000}, time.now, &port);
  }
  template <class T>
  void send(ping::Id id, T value) {
    Bytes payload;
    wire::Writer write(payload);
    write("value", value);
    time.send(stream, ping::framed(id, 0, payload));
  }
  /// Returns the distances of the profiles that arrive during this time.
  std::vector<ping::Distance> profiles(milliseconds length) {
    std::vector<ping::Distance> all;
    for (const auto& datagrams : pings(length))
      for (const Bytes& datagram : datagrams) {
        ping::Framer framer(65535, true);
        framer.append(datagram);
        const auto frame = framer.next();
        if (!frame || frame->header.id != ping::Id::ping1d_profile) continue;
        wire::Reader reader(frame->payload);
        fields(reader, all.emplace_back());
      }
    return all;
  }
};

TEST(Ping1DInVirtualTime, PingsComeAtTheIntervalUntilTheStreamIsStopped) {
  Altimeter altimeter;
  EXPECT_THAT(altimeter.profiles(seconds(1)), IsEmpty());
  altimeter.send<std::uint8_t>(ping::Id::ping1d_set_mode_auto, 0);
  altimeter.send(ping::Id::ping1d_continuous_start, ping::Id::ping1d_profile);
  EXPECT_NEAR(static_cast<double>(altimeter.profiles(seconds(10)).size()), 100, 1);
  altimeter.send<std::uint16_t>(ping::Id::ping1d_set_interval, 20);
  EXPECT_NEAR(static_cast<double>(altimeter.profiles(seconds(10)).size()), 500, 5);
  altimeter.send<std::uint8_t>(ping::Id::ping1d_set_enable, 0);
  EXPECT_THAT(altimeter.profiles(seconds(1)), IsEmpty());
  altimeter.send<std::uint8_t>(ping::Id::ping1d_set_enable, 1);
  EXPECT_FALSE(altimeter.profiles(seconds(1)).empty());
  altimeter.send(ping::Id::ping1d_continuous_stop, ping::Id::ping1d_profile);
  EXPECT_THAT(altimeter.profiles(seconds(1)), IsEmpty());
}

/// Pings in virtual time contain only zeros.
TEST(Ping1DInVirtualTime, AutomaticModeSearchesWithoutAnEcho) {
  Altimeter altimeter;
  altimeter.send(ping::Id::ping1d_continuous_start, ping::Id::ping1d_profile);
  const auto seen = altimeter.profiles(seconds(2));
  ASSERT_GT(seen.size(), 7u);
  std::vector<std::uint32_t> lengths;
  for (std::size_t i = 0; i < 7; ++i) lengths.push_back(seen[i].length_mm);
  EXPECT_THAT(lengths, ElementsAre(5000, 10000, 20000, 40000, 80000, 100000, 5000));
  EXPECT_EQ(seen.back().gain, 6u);
  EXPECT_THAT(altimeter.sonar().asked_by(), ::testing::StartsWith("host"))
      << "the settings are those of the host, not of the sonar itself";
  altimeter.send<std::uint8_t>(ping::Id::ping1d_set_mode_auto, 0);
  altimeter.profiles(milliseconds(300));
  const auto manual = altimeter.profiles(seconds(2));
  ASSERT_GT(manual.size(), 5u);
  for (const ping::Distance& one : manual) EXPECT_EQ(one.length_mm, manual.front().length_mm);
}

}  // namespace
}  // namespace sonar::datagram_sonars_test
