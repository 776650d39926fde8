// Replay of sonars whose drivers decide which pings they get. Tests which scan line answers a request, which port sends which
// messages, and that a driver's sockets receive the recorded pings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <future>

#include "daemon/commands/replay/requested_replay.hpp"
#include "protocol/norbit/host.hpp"
#include "protocol/ping/host.hpp"
#include "protocol/ping/messages.hpp"
#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/ping/ping_log.hpp"
#include "protocol/ping/s500_messages.hpp"
#include "protocol/recorded/raw_dump.hpp"
#include "protocol/recording/recording.hpp"
#include "tests/protocol/micron/micron_testing.hpp"
#include "tests/protocol/norbit/norbit_testing.hpp"

namespace sonar::requested_replay_test {
namespace {

using recording::Bytes;
using recording::Carrier;
using recording::Origin;
using recording::RecordedMessage;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
constexpr milliseconds patience{20000};

// ---- which ping

class Messages final : public recording::RecordingReader {
 public:
  explicit Messages(std::vector<RecordedMessage> all) : all_(std::move(all)) {}
  std::optional<RecordedMessage> next() override { return at_ < all_.size() ? std::optional(all_[at_++]) : std::nullopt; }
  std::optional<Error> damage() const override { return {}; }
  void rewind() override { at_ = 0; }

 private:
  std::vector<RecordedMessage> all_;
  std::size_t at_ = 0;
};

/// Messages of two bytes: the first is a port, or 0 and the second a direction in degrees; 99: no ping.
Messages recorded(const std::vector<std::pair<int, int>>& messages) {
  std::vector<RecordedMessage> all;
  for (const auto& [port, number] : messages)
    all.push_back({Time(std::chrono::seconds(all.size())),
                   Origin::device,
                   Carrier::datagram,
                   {static_cast<std::byte>(port), static_cast<std::byte>(number)}});
  return Messages(std::move(all));
}
std::optional<recording::PingPart> part_of(recording::BytesView message) {
  const auto port = std::to_integer<std::uint16_t>(message[0]);
  if (port == 99) return std::nullopt;
  if (port != 0) return recording::PingPart{.port = port};
  return recording::PingPart{.head_rad = std::to_integer<int>(message[1]) * pi / 180};
}
const recording::Codec codec{.ping_part = part_of};

int second_of(const PlayedPing& ping) { return static_cast<int>(seconds(ping.at.time_since_epoch())); }

TEST(PlayedPings, OfAScanTheNearestLineIsTheNextInTime) {
  Messages reader = recorded({{0, 10}, {99, 0}, {0, 20}, {0, 30}, {0, 20}, {0, 10}});
  PlayedPings pings(reader, codec);
  ASSERT_TRUE(pings.open("f"));
  ASSERT_TRUE(pings.is_scan());
  const auto at = [&](double deg) { return second_of(pings.nearest(deg * pi / 180)); };
  EXPECT_EQ(at(20), 2);
  EXPECT_EQ(at(20), 4) << "the next pass of the head";
  EXPECT_EQ(at(20), 2) << "and around again";
  EXPECT_EQ(at(31), 3);
  EXPECT_EQ(at(11), 5);
  EXPECT_EQ(at(-350), 0) << "the same direction, a turn away";
  EXPECT_EQ(at(200), 3) << "nothing was recorded there: the nearest";
}

TEST(PlayedPings, PartsOfPortsMakeUpAPing) {
  Messages reader = recorded({{7, 1}, {8, 1}, {99, 0}, {7, 2}, {7, 3}, {8, 3}});
  PlayedPings pings(reader, codec);
  ASSERT_TRUE(pings.open("f"));
  EXPECT_FALSE(pings.is_scan());
  for (int round = 0; round < 2; ++round) {
    std::vector<std::size_t> parts;
    while (const auto ping = pings.next()) {
      parts.push_back(ping->parts.size());
      EXPECT_EQ(pings.at_end(), parts.size() == 3);
    }
    EXPECT_THAT(parts, ElementsAre(2, 1, 2));
    pings.rewind();
  }
}

TEST(PlayedPings, NeedAPing) {
  Messages reader = recorded({{99, 0}});
  PlayedPings pings(reader, codec);
  const auto opened = pings.open("f");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().text, "f holds no ping");
}

// ---- a driver at its sockets

using MakeWriter = std::unique_ptr<recording::RecordingWriter> (*)(std::unique_ptr<recording::Sink>);
constexpr MakeWriter raw_dump = [](std::unique_ptr<recording::Sink> sink) { return recording::write_raw_dump(std::move(sink)); };
constexpr MakeWriter ping_log = [](std::unique_ptr<recording::Sink> sink) { return recording::write_ping_log(std::move(sink)); };
Bytes file_of(MakeWriter make, const std::vector<Bytes>& messages) {
  Bytes file;
  const auto writer = make(recording::sink_into(file));
  for (const Bytes& message : messages) EXPECT_TRUE(writer->write({{}, Origin::device, Carrier::stream, message}));
  EXPECT_TRUE(writer->close());
  return file;
}

/// A recording on a disk that blocks until `goes_on` has a value or an exception.
class SlowDisk final : public recording::RecordingReader {
 public:
  SlowDisk(std::unique_ptr<recording::RecordingReader> of, std::shared_future<void> goes_on)
      : of_(std::move(of)), goes_on_(std::move(goes_on)) {}
  std::optional<RecordedMessage> next() override {
    if (stands_still) goes_on_.get();
    return of_->next();
  }
  std::optional<Error> damage() const override { return of_->damage(); }
  void rewind() override { of_->rewind(); }
  bool knows_times() const override { return of_->knows_times(); }
  std::atomic<bool> stands_still = false;

 private:
  std::unique_ptr<recording::RecordingReader> of_;
  std::shared_future<void> goes_on_;
};

/// A replay in a thread of its own. After it is open, its disk blocks until `goes_on`, if given.
class Replay {
 public:
  explicit Replay(Bytes file, double rate_hz = 1000, std::shared_future<void> goes_on = {})
      : Replay(std::move(file), false, rate_hz, std::move(goes_on)) {}
  Replay(Bytes file, bool loop, double rate_hz = 1000, std::shared_future<void> goes_on = {})
      : log_([] {
          LogOptions quiet;
          quiet.sink = [](LogLevel, const std::string&) {};
          return quiet;
        }()) {
    auto opened = recording::open_recording(recording::source_from("recording", std::move(file)));
    if (!opened) throw std::runtime_error(opened.error().text);
    recording_ = std::move(*opened);
    SlowDisk* disk = nullptr;
    if (goes_on.valid()) {
      auto slow = std::make_unique<SlowDisk>(std::move(recording_.reader), std::move(goes_on));
      disk = slow.get();
      recording_.reader = std::move(slow);
    }
    auto device = find_replay_device(*recording_.reader, "recording", 1042);
    if (!device || !device->by_requests()) throw std::runtime_error("not by requests");
    ReplayOptions options;
    options.at = {{127, 0, 0, 2}, 0};
    options.rate_hz = rate_hz;
    options.loop = loop;
    server_ = std::make_unique<RequestedReplay>(io_, *recording_.reader, *device, options, log_);
    if (const auto listening = server_->open("recording"); !listening) throw std::runtime_error(listening.error().text);
    if (disk != nullptr) disk->stands_still = true;
    server_->start();
    done_ = std::async(std::launch::async, [this] { io_.run(); });
  }
  ~Replay() {
    asio::post(io_, [this] { server_->stop(); });
    done_.wait();
  }
  bool ends() { return done_.wait_for(patience) == std::future_status::ready; }
  /// After the end.
  ReplayServer::Figures figures() const { return server_->figures(); }
  const Result<void>& outcome() const { return server_->outcome(); }

 private:
  Log log_;
  asio::io_context io_;
  recording::Recording recording_;
  std::unique_ptr<RequestedReplay> server_;
  std::future<void> done_;
};

class Tcp {
 public:
  explicit Tcp(std::uint16_t port) : socket_(io_) { socket_.connect({asio::ip::address_v4({127, 0, 0, 2}), port}); }
  void send(const Bytes& bytes) { asio::write(socket_, asio::buffer(bytes)); }
  void send(std::string_view text) { asio::write(socket_, asio::buffer(text)); }
  /// The next bytes; empty at the end of the stream.
  Bytes read() {
    Bytes bytes(1 << 16);
    pollfd waited{socket_.native_handle(), POLLIN, 0};
    if (::poll(&waited, 1, static_cast<int>(patience.count())) <= 0) {
      ADD_FAILURE() << "not a byte for " << patience.count() << " ms";
      return {};
    }
    error_code ec;
    bytes.resize(socket_.read_some(asio::buffer(bytes), ec));
    if (ec) socket_.close(ec);
    return bytes;
  }
  Bytes read_to_end() {
    Bytes all;
    for (Bytes piece = read(); !piece.empty(); piece = read()) all.insert(all.end(), piece.begin(), piece.end());
    return all;
  }

 private:
  asio::io_context io_;
  tcp::socket socket_;
};

Bytes micron_line(int bearing, char bin) {
  const auto state = micron::tests::device();
  micron::Settings s;
  s.command = micron::tests::sector();
  s.bearing = static_cast<std::uint16_t>(bearing);
  Ping ping;
  ping.request.settings = micron::ping_settings(s, state);
  ping.request.vendor_settings = std::make_shared<micron::HeldSettings>(s);
  ping.samples.assign(static_cast<std::size_t>(ping.request.settings.range_bin_count), static_cast<std::byte>(bin));
  return *micron::vendor().frame(ping, state);
}

/// A driver requests scan lines that are to port of ahead; the head turns by one grad after each.
TEST(ReplayOfMicron, ASendDataGetsTheRecordedLineOfItsDirection) {
  std::vector<Bytes> lines;
  for (int bearing = 2400; bearing <= 4000; bearing += 16) lines.push_back(micron_line(bearing, static_cast<char>(bearing / 16)));
  Replay replay(file_of(raw_dump, lines));
  Tcp driver(4001);
  driver.send(micron::tests::command(micron::tests::sector()));
  recording::MessageSplitter splitter(Origin::device, micron::framing);
  std::vector<int> bearings;
  for (int line = 0; line < 5; ++line) {
    driver.send(micron::tests::request());
    for (bool came = false; !came;) {
      const Bytes piece = driver.read();
      ASSERT_FALSE(piece.empty());
      splitter.append({}, piece);
      while (const auto whole = splitter.next()) {
        const auto message = micron::read_frame(whole->bytes);
        ASSERT_TRUE(message);
        if (message->header.id != micron::Id::head_data) continue;
        EXPECT_THAT(lines, ::testing::Contains(whole->bytes)) << "byte for byte";
        bearings.push_back(micron::read_front<micron::HeadData>(message->payload)->bearing);
        came = true;
      }
    }
  }
  for (std::size_t i = 1; i < bearings.size(); ++i) EXPECT_EQ(std::abs(bearings[i] - bearings[i - 1]), 16) << i;
}

/// A host by UDP.
class Udp {
 public:
  explicit Udp(std::uint16_t port)
      : at_(asio::ip::address_v4({127, 0, 0, 2}), port), socket_(io_, udp::endpoint(asio::ip::address_v4::loopback(), 0)) {}
  void send(const Bytes& bytes) { socket_.send_to(asio::buffer(bytes), at_); }
  std::optional<ping::Frame> read() {
    pollfd waited{socket_.native_handle(), POLLIN, 0};
    if (::poll(&waited, 1, static_cast<int>(patience.count())) <= 0) return std::nullopt;
    Bytes datagram(1 << 16);
    datagram.resize(socket_.receive(asio::buffer(datagram)));
    return ping::whole_frame(datagram);
  }
  /// The number of the next frame; Id{}: none came.
  ping::Id next_id() {
    const auto frame = read();
    return frame ? frame->header.id : ping::Id{};
  }

 private:
  asio::io_context io_;
  udp::endpoint at_;
  udp::socket socket_;
};

Bytes ping360_line(std::uint16_t angle, bool of_a_scan) {
  const Bytes samples(3, static_cast<std::byte>(angle));
  Bytes payload = of_a_scan
                      ? wire::bytes_of(ping::AutoDeviceData{.angle = angle, .period = 80, .khz = 740, .samples = 3, .count = 3})
                      : wire::bytes_of(ping::DeviceData{.angle = angle, .period = 80, .khz = 740, .samples = 3, .count = 3});
  payload.insert(payload.end(), samples.begin(), samples.end());
  return ping::framed(of_a_scan ? ping::Id::auto_device_data : ping::Id::device_data, 2, payload);
}

/// The recording is of a scan. A request of a single line gets the message with which the device answers such a request.
TEST(ReplayOfPing360, ARequestGetsTheLineOfItsAngleInTheMessageThatAnswersIt) {
  Replay replay(file_of(ping_log, {ping360_line(10, true), ping360_line(20, true), ping360_line(30, true)}));
  Udp host(12345);
  for (const std::uint16_t angle : std::array<std::uint16_t, 3>{20, 10, 28}) {
    host.send(ping::framed_message(
        ping::Id::transducer, 0,
        ping::Transducer{.angle = angle, .transmit_us = 10, .period = 80, .khz = 740, .samples = 200, .transmit = 1}));
    const auto frame = host.read();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->header.id, ping::Id::device_data);
    EXPECT_TRUE(frame->sum_is_right);
    ping::DeviceData data;
    wire::Reader reader(frame->payload);
    fields(reader, data);
    EXPECT_EQ(data.angle, angle == 28 ? 30 : angle) << "the nearest, under its own angle";
    EXPECT_EQ(data.samples, 3) << "settings of the recording";
    EXPECT_EQ(frame->payload.back(), static_cast<std::byte>(data.angle));
  }
}

// ---- range finders: a host requests each result, or a stream of results

Bytes ping1d_profile(std::uint32_t number) {
  ping::Profile profile;
  profile.distance_mm = 1000 + number;
  profile.confidence = 90;
  profile.ping = number;
  profile.length_mm = 4000;
  profile.count = 3;
  Bytes payload = wire::bytes_of(profile);
  payload.insert(payload.end(), 3, static_cast<std::byte>(number));
  return ping::framed(ping::Id::ping1d_profile, 1, payload);
}
template <class M>
M message_in(const ping::Frame& frame) {
  M message;
  wire::Reader reader(frame.payload);
  fields(reader, message);
  EXPECT_TRUE(reader.ok());
  return message;
}
/// A message that names another one.
Bytes about(ping::Id request, ping::Id id) {
  const auto number = static_cast<unsigned>(id);
  return ping::framed(request, 0, Bytes{static_cast<std::byte>(number & 0xFF), static_cast<std::byte>(number >> 8)});
}
Bytes wanted(ping::Id id) { return about(ping::Id::general_request, id); }

TEST(ReplayOfPing1D, AHostByUdpGetsTheResultsThatItRequestsOneByOne) {
  Replay replay(file_of(raw_dump, {ping1d_profile(1), ping1d_profile(2), ping1d_profile(3), ping1d_profile(4)}));
  Udp host(9090);
  host.send(wanted(ping::Id::ping1d_general_info));
  EXPECT_EQ(host.next_id(), ping::Id::ping1d_general_info) << "the device answers by itself";
  host.send(wanted(ping::Id::ping1d_profile));
  auto frame = host.read();
  ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_profile);
  EXPECT_EQ(message_in<ping::Profile>(*frame).ping, 1u);
  EXPECT_EQ(frame->payload.back(), std::byte{1}) << "with its samples";
  host.send(wanted(ping::Id::ping1d_distance));
  frame = host.read();
  ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_distance) << "made of the recorded profile";
  const auto distance = message_in<ping::Distance>(*frame);
  EXPECT_EQ(distance.distance_mm, 1002u);
  EXPECT_EQ(distance.length_mm, 4000u);
  host.send(wanted(ping::Id::ping1d_distance_simple));
  frame = host.read();
  ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_distance_simple);
  EXPECT_EQ(message_in<ping::DistanceSimple>(*frame).distance_mm, 1003u);
  host.send(wanted(ping::Id::ping1d_profile));
  ASSERT_EQ(host.next_id(), ping::Id::ping1d_profile);
  EXPECT_TRUE(replay.ends()) << "that was the last ping";
  EXPECT_EQ(replay.figures().messages, 4u);
}

TEST(ReplayOfPing1D, AHostByTcpGetsTheRecordedBytes) {
  Bytes all;
  std::vector<Bytes> profiles;
  for (std::uint32_t i = 1; i <= 3; ++i) profiles.push_back(ping1d_profile(i));
  for (const Bytes& one : profiles) all.insert(all.end(), one.begin(), one.end());
  Replay replay(file_of(raw_dump, profiles));
  Tcp host(9090);
  host.send(about(ping::Id::ping1d_continuous_start, ping::Id::ping1d_profile));
  const Bytes acked = ping::ack(ping::Id::ping1d_continuous_start, 1), got = host.read_to_end();
  ASSERT_EQ(got.size(), acked.size() + all.size());
  EXPECT_EQ(Bytes(got.begin() + static_cast<std::ptrdiff_t>(acked.size()), got.end()), all);
}

Bytes ping1d_distance(std::uint32_t number) {
  ping::Distance distance;
  distance.distance_mm = 1000 + number;
  distance.confidence = 90;
  distance.ping = number;
  distance.length_mm = 4000;
  return ping::framed_message(ping::Id::ping1d_distance, 1, distance);
}
Bytes ping1d_simple(std::uint32_t number) {
  return ping::framed_message(ping::Id::ping1d_distance_simple, 1, ping::DistanceSimple{1000 + number, 90});
}
/// The messages with which PlayedPings represents the pings of a recording.
std::vector<Bytes> played(const std::vector<Bytes>& messages, const recording::Codec& of) {
  std::vector<RecordedMessage> all;
  for (const Bytes& message : messages) all.push_back({{}, Origin::device, Carrier::datagram, message});
  Messages reader(std::move(all));
  PlayedPings pings(reader, of);
  EXPECT_TRUE(pings.open("f"));
  std::vector<Bytes> richest;
  while (const auto ping = pings.next()) richest.push_back(ping->parts.front().second);
  EXPECT_TRUE(pings.at_end());
  return richest;
}

TEST(ReplayOfPing1D, TheRichestMessageOfAPingStandsForIt) {
  const recording::Codec of = ping::ping1d::codec();
  const auto simple = ping1d_simple, distance = ping1d_distance, profile = ping1d_profile;
  EXPECT_THAT(played({simple(1), profile(1), simple(2), profile(2)}, of), ElementsAre(profile(1), profile(2)));
  EXPECT_THAT(played({profile(1), simple(1), profile(2), simple(2)}, of), ElementsAre(profile(1), profile(2)));
  EXPECT_THAT(played({simple(1), distance(1), profile(1), simple(2), distance(2)}, of), ElementsAre(profile(1), distance(2)));
  EXPECT_THAT(played({simple(1), profile(2), distance(3), simple(4)}, of),
              ElementsAre(simple(1), profile(2), distance(3), simple(4)))
      << "four pings";
  EXPECT_THAT(played({simple(1), simple(1), profile(1), profile(1)}, of), ElementsAre(simple(1), profile(1), profile(1)))
      << "a ping has one message of each kind";
}

TEST(ReplayOfS500, TheRichestMessageOfAPingStandsForIt) {
  ping::Profile6 profile;
  profile.depth_m = 2.5f;
  profile.smooth_depth_m = 2.25f;
  profile.confidence = 80;
  profile.smooth_confidence = 70;
  profile.power_up_ms = 100;
  const Bytes distance = ping::framed_message(ping::Id::s500_distance2, 0, ping::Distance2{2500, 2250, 0, 80, 70, 100}),
              later = ping::framed_message(ping::Id::s500_distance2, 0, ping::Distance2{2500, 2250, 0, 80, 70, 200}),
              altitude = ping::framed_message(ping::Id::ping1d_distance_simple, 0, ping::DistanceSimple{2500, 80}),
              whole = ping::framed_message(ping::Id::s500_profile6, 0, profile);
  EXPECT_THAT(played({altitude, distance, whole, later}, ping::s500::codec()), ElementsAre(whole, later));
}

TEST(ReplayOfPing1D, EveryProfileHasSamplesIfEveryPingHas) {
  Replay replay(file_of(raw_dump, {ping1d_simple(1), ping1d_profile(1), ping1d_simple(2), ping1d_profile(2)}));
  Udp host(9090);
  for (std::uint32_t number = 1; number <= 2; ++number) {
    host.send(wanted(ping::Id::ping1d_profile));
    const auto frame = host.read();
    ASSERT_TRUE(frame && frame->header.id == ping::Id::ping1d_profile);
    const auto profile = message_in<ping::Profile>(*frame);
    EXPECT_EQ(profile.ping, number);
    EXPECT_EQ(profile.count, 3u);
  }
  EXPECT_TRUE(replay.ends());
}

TEST(ReplayOfS500, AStreamOfAnotherReportIsMadeOfTheRecordedOne) {
  std::vector<Bytes> reports;
  for (std::uint32_t i = 1; i <= 3; ++i)
    reports.push_back(ping::framed_message(ping::Id::s500_distance2, 0, ping::Distance2{2000 + i, 2000, 0, 80, 70, 10 * i}));
  Replay replay(file_of(ping_log, reports));
  Udp host(51200);
  ping::SetPingParams params;
  params.period_ms = 0;
  params.report = ping::Id::s500_profile6;
  host.send(ping::framed_message(ping::Id::s500_set_ping_params, 0, params));
  EXPECT_EQ(host.next_id(), ping::Id::ack);
  for (std::uint32_t i = 1; i <= 3; ++i) {
    const auto frame = host.read();
    ASSERT_TRUE(frame && frame->header.id == ping::Id::s500_profile6);
    const auto report = message_in<ping::Profile6>(*frame);
    EXPECT_NEAR(report.depth_m, 2 + 1e-3f * static_cast<float>(i), 1e-5);
    EXPECT_EQ(report.confidence, 80);
    EXPECT_EQ(report.results, 0) << "the recording has no samples";
  }
  EXPECT_TRUE(replay.ends());
}

// ---- sonars that send while their host enables pings: the recording sets the pace

Bytes points(std::uint32_t number) {
  ping::AtofPointData data;
  data.power_up_ms = 200 * number;
  data.ping = number;
  return ping::framed_message(ping::Id::atof_point_data, 0, data);
}
Bytes enabling(bool enable) {
  ping::PingParameters settings;
  settings.end_mm = 5000;
  settings.period_ms = 1000;
  settings.enable = enable ? 1 : 0;
  return ping::framed_message(ping::Id::set_ping_parameters, 0, settings);
}
/// The next frame that is not of the conversation.
std::optional<ping::Frame> next_measured(Udp& host) {
  while (auto frame = host.read())
    if (frame->header.id != ping::Id::utc_request && frame->header.id != ping::Id::ack) return frame;
  return std::nullopt;
}

TEST(ReplayOfSurveyor, AHostByUdpGetsEveryMessageAtTheRecordedPace) {
  std::vector<Bytes> messages;
  for (std::uint32_t i = 1; i <= 4; ++i) {
    messages.push_back(ping::framed_message(ping::Id::attitude_report, 0, ping::AttitudeReport{{}, {}, 0, 200 * i}));
    messages.push_back(points(i));
  }
  Replay replay(file_of(ping_log, messages));
  Udp host(62312);
  host.send(wanted(ping::Id::device_information));
  ASSERT_EQ(next_measured(host)->header.id, ping::Id::device_information) << "and no ping before";
  const auto begin = std::chrono::steady_clock::now();
  host.send(enabling(true));  // enables once a second; the recording has five pings a second
  for (std::uint32_t i = 1; i <= 4; ++i)
    for (const ping::Id id : {ping::Id::attitude_report, ping::Id::atof_point_data}) {
      const auto frame = next_measured(host);
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->header.id, id) << i;
      EXPECT_EQ(ping::framed(frame->header.id, 0, frame->payload), messages[2 * (i - 1) + (id == ping::Id::atof_point_data)]);
    }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(590));
  EXPECT_TRUE(replay.ends());
  EXPECT_EQ(replay.figures().messages, 8u);
}

TEST(ReplayOfSurveyor, AnotherProductsMessagesInTheLogAreNotServed) {
  const Bytes tilt = ping::framed_message(ping::Id::attitude_report, 0, ping::AttitudeReport{{}, {}, 0, 200}),
              profile = ping::framed_message(ping::Id::os_mono_profile, 0, ping::OsMonoProfile{});
  const std::vector<Bytes> log{tilt, points(1), profile, points(2), profile};
  EXPECT_THAT(played(log, ping::surveyor::codec()), ElementsAre(tilt, points(1), points(2)));
  EXPECT_THAT(played(log, ping::omniscan::codec()), ElementsAre(profile, profile));
}

TEST(ReplayOfSurveyor, AHostByTcpIsAnsweredAndGetsPingsWhileItEnablesThem) {
  Replay replay(file_of(ping_log, {points(1), points(2), points(3)}), true);
  Tcp host(62312);
  ping::Framer framer(65535);
  const auto next = [&] {
    while (true) {
      const auto frame = framer.next();
      if (frame && frame->header.id != ping::Id::utc_request) return frame->header.id;
      if (!frame) framer.append(host.read());
    }
  };
  host.send(enabling(true));
  for (int i = 0; i < 7; ++i) EXPECT_EQ(next(), ping::Id::atof_point_data) << "again and again";
  host.send(ping::framed(ping::Id::set_device_id, 0, Bytes{std::byte{9}}));
  host.send(enabling(false));
  host.send(wanted(ping::Id::protocol_version));
  bool acked = false;
  for (auto id = next(); id != ping::Id::protocol_version; id = next()) acked |= id == ping::Id::ack;
  EXPECT_TRUE(acked);
  host.send(enabling(true));
  EXPECT_EQ(next(), ping::Id::atof_point_data);
}

struct NorbitReplay : ::testing::Test {
  NorbitReplay() {
    norbit::Settings settings{.power = true, .stop_m = 12};
    const protocol::DeviceState state = norbit::tests::device();
    for (int row = 100; row < 105; ++row) {
      const Ping ping = norbit::tests::ping_with(settings, state, row, 10);
      const Bytes one = norbit::encode_bathymetry(ping, state), other = norbit::encode_column(ping, state);
      bathymetry.insert(bathymetry.end(), one.begin(), one.end());
      column.insert(column.end(), other.begin(), other.end());
      Bytes both = one;
      both.insert(both.end(), other.begin(), other.end());
      messages.push_back(both);  // as the daemon records them
    }
  }
  Bytes bathymetry, column;
  std::vector<Bytes> messages;
};

TEST_F(NorbitReplay, PacketsThatWereRecordedInPiecesAreWhole) {
  Bytes stream;
  for (const Bytes& both : messages) stream.insert(stream.end(), both.begin(), both.end());
  std::vector<RecordedMessage> pieces;
  for (std::size_t at = 0; at < stream.size(); at += 1000) {
    const auto begin = stream.begin() + static_cast<std::ptrdiff_t>(at);
    const auto size = static_cast<std::ptrdiff_t>(std::min<std::size_t>(1000, stream.size() - at));
    pieces.push_back({{}, Origin::device, Carrier::stream, Bytes(begin, begin + size)});
  }
  Messages reader(std::move(pieces));
  const recording::Codec norbit_codec = norbit::codec();
  PlayedPings pings(reader, norbit_codec);
  ASSERT_TRUE(pings.open("f"));
  Bytes all;
  while (const auto ping = pings.next())
    for (const auto& part : ping->parts) all.insert(all.end(), part.second.begin(), part.second.end());
  EXPECT_EQ(all, stream);
}

TEST_F(NorbitReplay, EachPortSendsItsPacketsOnceTheDriverTurnsItOn) {
  Replay replay(file_of(raw_dump, messages));
  Tcp points(norbit::bathymetry_port), pictures(norbit::column_port), commands(norbit::command_port);
  ASSERT_THAT(commands.read(), ::testing::Not(IsEmpty())) << "it greets: the other two are served by then";
  commands.send(std::string_view("set_power 1\r\n"));
  auto received = std::async(std::launch::async, [&] { return pictures.read_to_end(); });
  EXPECT_EQ(points.read_to_end(), bathymetry);
  EXPECT_EQ(received.get(), column);
  EXPECT_THAT(commands.read_to_end(), ::testing::Not(IsEmpty())) << "its replies";
  EXPECT_TRUE(replay.ends()) << "the driver has received everything";
  EXPECT_EQ(replay.figures().messages, 5u);
  EXPECT_EQ(replay.figures().clients, 3u);
}

/// While pings wait for the disk, the driver's messages are answered, and no ping is cut or lost.
TEST_F(NorbitReplay, ADiskThatStandsStillDelaysNoConversation) {
  std::promise<void> goes_on;
  Replay replay(file_of(raw_dump, messages), 1000, goes_on.get_future().share());
  Tcp points(norbit::bathymetry_port), pictures(norbit::column_port), commands(norbit::command_port);
  EXPECT_THAT(commands.read(), ::testing::Not(IsEmpty())) << "it greets";
  for (int asked = 0; asked < 3; ++asked) {
    commands.send(std::string_view("set_power 1\r\n"));
    EXPECT_THAT(commands.read(), ::testing::Not(IsEmpty())) << "the event loop waits for the disk";
  }
  goes_on.set_value();
  auto received = std::async(std::launch::async, [&] { return pictures.read_to_end(); });
  EXPECT_EQ(points.read_to_end(), bathymetry);
  EXPECT_EQ(received.get(), column);
  EXPECT_TRUE(replay.ends());
  EXPECT_EQ(replay.figures().messages, 5u);
}

TEST_F(NorbitReplay, AFaultOfTheDiskEndsItWithItsText) {
  std::promise<void> goes_on;
  goes_on.set_exception(std::make_exception_ptr(std::runtime_error("the disk is gone")));
  Replay replay(file_of(raw_dump, messages), 1000, goes_on.get_future().share());
  Tcp commands(norbit::command_port), points(norbit::bathymetry_port);
  commands.send(std::string_view("set_power 1\r\n"));
  commands.read_to_end();
  points.read_to_end();
  ASSERT_TRUE(replay.ends());
  ASSERT_FALSE(replay.outcome());
  EXPECT_THAT(replay.outcome().error().text, ::testing::HasSubstr("the disk is gone"));
}

}  // namespace
}  // namespace sonar::requested_replay_test
