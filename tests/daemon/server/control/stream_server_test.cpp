// The control stream over loopback: greeting, token, answers in any order, events, limits, exceptions.
#include <gmock/gmock.h>

#include <list>

#include "protocol/control/control.hpp"
#include "tests/daemon/server/control/control_bench.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::HasSubstr;

struct StreamClient {
  Client tcp;
  control::DelimitedParser parser;
  explicit StreamClient(ControlBench& bench, int receive_buffer = 0) : tcp(bench.address, bench.stream_port(), receive_buffer) {}
  void send(const control::Request& request) { tcp.send(control::delimited(control::encode_request(request))); }
  void greet(const std::string& token = "") {
    send({1, control::Hello{1, "test", token}});
    const auto answer = next();
    ASSERT_TRUE(answer);
    ASSERT_EQ(answer->status().code(), v1::Status::OK) << answer->status().text();
    ASSERT_TRUE(answer->has_hello());
  }
  /// Returns the next answer; null at the deadline or the end of the stream.
  std::shared_ptr<const v1::Response> next(milliseconds timeout = patience) {
    const auto deadline = Steady::now() + timeout;
    while (true) {
      const auto message = parser.next();
      if (!message) return nullptr;
      if (*message) {
        auto response = control::decode_response(**message);
        EXPECT_TRUE(response) << response.error().text;
        return response.value_or(nullptr);
      }
      const auto left = std::chrono::duration_cast<milliseconds>(deadline - Steady::now());
      if (left.count() <= 0) return nullptr;
      const auto raw = tcp.read_raw(1, left);
      if (raw.empty() && tcp.ended) return nullptr;
      parser.feed(raw);
    }
  }
};

TEST(ControlStream, AnswersComeWithTheirIdWhenReady) {
  ControlBench bench;
  StreamClient client(bench);
  client.greet();
  client.send({2, control::LoadScene{"later"}});
  client.send({3, control::GetStatus{}});
  const auto status = client.next();
  ASSERT_TRUE(status);
  EXPECT_EQ(status->id(), 3u);
  EXPECT_EQ(status->daemon().version(), "fake");
  bench.on_io([&] { bench.operations.later.at(0)({}); });
  const auto load = client.next();
  ASSERT_TRUE(load);
  EXPECT_EQ(load->id(), 2u);
  EXPECT_EQ(load->status().code(), v1::Status::OK);
  control::SetSonar unknown;
  unknown.sonar = "unknown";
  client.send({4, unknown});
  const auto refused = client.next();
  EXPECT_EQ(refused->status().code(), v1::Status::REFUSED);
  EXPECT_EQ(refused->status().text(), "there is no sonar \"unknown\"");
  client.send({5, control::LoadScene{"x.yaml"}});
  EXPECT_EQ(client.next()->status().code(), v1::Status::FAILED);
  client.send({6, control::Unsupported{}});
  EXPECT_EQ(client.next()->status().code(), v1::Status::UNSUPPORTED);
  client.send({7, control::RemoveObject{}});
  const auto malformed = client.next();
  EXPECT_EQ(malformed->id(), 7u);
  EXPECT_THAT(malformed->status().text(), HasSubstr("object is missing"));
}

TEST(ControlStream, PosesWithoutAnIdAreNotAnswered) {
  ControlBench bench;
  StreamClient client(bench);
  client.greet();
  client.send({0, control::PoseSample{}});
  client.send({9, control::PoseSample{}});
  const auto answer = client.next();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->id(), 9u);
  EXPECT_EQ(bench.operations.asked, 2);
  bench.on_io([&] { EXPECT_THAT(bench.operations.last_sender.id, HasSubstr("protobuf tcp 127.")); });
  control::PoseSample broken;
  broken.pose.position_m.x = std::numeric_limits<double>::quiet_NaN();
  client.send({10, broken});
  EXPECT_EQ(client.next()->status().code(), v1::Status::REFUSED);
  EXPECT_THAT(bench.log_text(), HasSubstr("pose refused: position has a NaN"));
  bench.on_io([&] { EXPECT_EQ(bench.world.counters().refused, 1u); });
}

TEST(ControlStream, AFloodOfPosesIsReadSlowlyButOtherClientsAreNot) {
  LimitConfig limits;
  limits.pose_bytes_per_s = 65536;
  ControlBench bench({}, limits);
  std::vector<std::byte> poses;
  while (poses.size() < 400000) {
    const auto one = control::delimited(control::encode_request({0, control::PoseSample{}}));
    poses.insert(poses.end(), one.begin(), one.end());
  }
  const auto begin = Steady::now();
  std::list<StreamClient> flood;
  for (int i = 0; i < 4; ++i) {
    flood.emplace_back(bench).greet();
    flood.back().tcp.send(poses);
  }
  std::this_thread::sleep_for(milliseconds(500));
  const auto seconds = std::chrono::duration<double>(Steady::now() - begin).count();
  EXPECT_LT(bench.operations.asked, (1 + seconds) * 65536 / 64 + 4 * 4096 / 20.) << "each pose counts as 64 bytes at least";
  StreamClient neighbour(bench);
  neighbour.greet();
  for (std::uint64_t id = 2; id < 20; ++id) {
    neighbour.send({id, control::PoseSample{}});
    EXPECT_TRUE(neighbour.next());
  }
}

TEST(ControlStream, OfPosesBeyondTheRateOnlyTheNewestIsUsed) {
  LimitConfig limits;
  limits.pose_bytes_per_s = 65536;
  ControlBench bench({}, limits);
  std::vector<std::byte> poses;
  const auto add = [&](double x) {
    control::PoseSample sample;
    sample.pose.position_m.x = x;
    const auto one = control::delimited(control::encode_request({0, sample}));
    poses.insert(poses.end(), one.begin(), one.end());
  };
  while (poses.size() < 2000000) add(1);
  add(2);
  {
    StreamClient flood(bench);
    flood.greet();
    flood.tcp.send(poses);
  }  // the client has left
  EXPECT_TRUE(eventually([&] {
    double x = 0;
    bench.on_io([&] { x = bench.operations.last_pose.x; });
    return x == 2;
  }));
  const int by_then = bench.operations.asked;
  EXPECT_LT(by_then, 10000) << "of more than 50,000";
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_EQ(bench.operations.asked, by_then);
}

TEST(ControlStream, AnswersCostMoreThanTheirRequests) {
  LimitConfig limits;
  limits.input_bytes_per_s = 16384;
  ControlBench bench({}, limits);
  const auto begin = Steady::now();
  StreamClient client(bench);
  client.greet();
  std::vector<std::byte> requests;
  for (std::uint64_t id = 2; id < 1002; ++id) {
    const auto one = control::delimited(control::encode_request({id, control::GetStatus{}}));
    requests.insert(requests.end(), one.begin(), one.end());
  }
  client.tcp.send(requests);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(client.next());
  const double seconds = std::chrono::duration<double>(Steady::now() - begin).count();
  EXPECT_LT(bench.operations.asked, (1 + seconds) * 16384 / 128 + 4096. / 6)
      << "each answer counts as 128 bytes, and the last read is allowed";
}

TEST(ControlStream, WithoutTheTokenNoRequestIsServed) {
  const TokenFile file;
  ControlConfig config;
  config.token_file = file.path;
  ControlBench bench(config);
  for (const std::string shown : {"", "0123456789abcdef-lax"}) {
    StreamClient untrusted(bench);
    untrusted.send({5, control::Hello{1, "test", shown}});
    const auto answer = untrusted.next();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status().code(), v1::Status::UNAUTHENTICATED);
    EXPECT_THAT(answer->status().text(), HasSubstr("token"));
    EXPECT_FALSE(answer->has_hello());
    EXPECT_TRUE(untrusted.tcp.read_to_end());
  }
  StreamClient friendly(bench);
  friendly.greet(TokenFile::text);
  friendly.send({2, control::GetStatus{}});
  EXPECT_EQ(friendly.next()->status().code(), v1::Status::OK);
  EXPECT_EQ(bench.operations.asked, 1);
  EXPECT_THAT(bench.log_text(), HasSubstr("token"));
  EXPECT_EQ(bench.log_text().find("0123456789"), std::string::npos) << "the log must show neither our token nor the client's";
}

TEST(ControlStream, EventsComeToSubscribersAndLossIsReported) {
  ControlBench bench;
  StreamClient client(bench);
  client.greet();
  client.send({2, control::Subscribe{true, false, false, false}});
  ASSERT_EQ(client.next()->id(), 2u);
  bench.on_io([&] {
    EXPECT_TRUE(bench.events.has_listeners());
    bench.events.publish_scene("s", "not asked for");
    for (std::uint32_t i = 0; i < 100; ++i) bench.events.publish(ping_event(i));  // more than can wait for one client
  });
  for (std::uint32_t i = 0; i < EventQueue::limit; ++i) {
    const auto event = client.next();
    ASSERT_TRUE(event);
    EXPECT_EQ(event->id(), 0u);
    EXPECT_EQ(event->event().ping().number(), i);
  }
  bench.on_io([&] { bench.events.publish(ping_event(100)); });
  const auto after = client.next();
  ASSERT_TRUE(after);
  EXPECT_EQ(after->event().unsent(), 100 - EventQueue::limit);
  client.send({3, control::Subscribe{}});
  ASSERT_EQ(client.next()->id(), 3u);
  bench.on_io([&] { bench.events.publish(ping_event(101)); });
  client.send({4, control::GetStatus{}});
  EXPECT_EQ(client.next()->id(), 4u) << "no event comes after the subscription has ended";
}

TEST(ControlStream, AClientThatReadsNothingIsReadNoFurtherAndClosed) {
  LimitConfig limits;
  limits.stall = milliseconds(300);
  ControlBench bench({}, limits);
  StreamClient client(bench, 4096);
  client.greet();
  constexpr int requests = 5000;
  for (int i = 0; i < requests; ++i)  // 20 MB of answers, each with its request's path: more than kernels can store
    client.send({static_cast<std::uint64_t>(i + 2), control::LoadScene{std::string(4000, 'x')}});
  EXPECT_TRUE(eventually([&] { return bench.log_text().find("client does not read") != std::string::npos; }));
  EXPECT_LT(bench.operations.asked, requests);
  StreamClient next(bench);
  next.greet();
}

TEST(ControlStream, AnswersAfterTheClientHasLeftAreDropped) {
  ControlBench bench;
  {
    StreamClient client(bench);
    client.greet();
    client.send({2, control::LoadScene{"later"}});
    EXPECT_TRUE(eventually([&] { return bench.operations.asked == 1; }));
    client.tcp.reset();
  }
  bench.on_io([&] { bench.operations.later.at(0)({}); });
  StreamClient next(bench);
  next.greet();
}

TEST(ControlStream, HalfClosedClientsGetTheirLateAnswers) {
  ControlBench bench;
  StreamClient client(bench);
  client.greet();
  client.send({2, control::LoadScene{"later"}});
  client.tcp.finish_sending();
  EXPECT_TRUE(eventually([&] { return bench.operations.asked == 1; }));
  bench.on_io([&] { bench.operations.later.at(0)({}); });
  EXPECT_EQ(client.next()->id(), 2u);
  EXPECT_TRUE(client.tcp.read_to_end());
}

TEST(ControlStream, AnExceptionEndsItsConnectionOnly) {
  ControlBench bench;
  StreamClient unlucky(bench), lucky(bench);
  unlucky.greet();
  lucky.greet();
  unlucky.send({2, control::LoadScene{"throw"}});
  unlucky.tcp.read_to_end();
  EXPECT_TRUE(unlucky.tcp.ended);
  lucky.send({2, control::GetStatus{}});
  EXPECT_TRUE(lucky.next());
  EXPECT_THAT(bench.log_text(), HasSubstr("internal fault: no such luck"));
}

TEST(ControlStream, BeforeTheHelloFourKilobytesAreReadAndBusyClientsKeepTheirSlots) {
  LimitConfig limits;
  limits.control_clients = 2;
  ControlBench bench({}, limits);
  Client chatter(bench.address, bench.stream_port());
  chatter.send(std::vector<std::byte>{std::byte{0xff}, std::byte{0xff},
                                      std::byte{0x20}});  // states the size of a message of half a megabyte
  chatter.send(std::string(6000, 'x'));
  chatter.read_to_end();
  EXPECT_TRUE(chatter.ended);
  StreamClient a(bench), b(bench);
  a.greet();
  b.greet();
  std::this_thread::sleep_for(milliseconds(1200));
  b.send({2, control::GetStatus{}});
  ASSERT_TRUE(b.next());
  StreamClient c(bench);
  c.greet();
  a.tcp.read_to_end();
  EXPECT_TRUE(a.tcp.ended) << "the client that was idle longest is evicted";
  b.send({3, control::GetStatus{}});
  EXPECT_TRUE(b.next());
}

TEST(ControlStream, BytesThatAreNoProtobufEndTheConnection) {
  ControlBench bench;
  StreamClient client(bench);
  client.greet();
  client.send({2, control::RemoveObject{}});
  EXPECT_EQ(client.next()->status().code(), v1::Status::REFUSED) << "an invalid request does not end the connection";
  client.tcp.send(control::delimited(bytes_of("\xff\xff\xff")));
  client.send({3, control::GetStatus{}});
  const auto last = client.next();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->status().code(), v1::Status::REFUSED);
  EXPECT_EQ(last->status().text(), "message is not a Request");
  EXPECT_FALSE(client.next());
  EXPECT_TRUE(client.tcp.ended);
  EXPECT_EQ(bench.operations.asked, 0) << "later requests on the connection are ignored";
}

TEST(ControlStream, AnHttpRequestIsRecognisedAndEndsTheConnection) {
  ControlBench bench;
  for (const std::string begins : {"POST /", "GET /%08%01"}) {
    Client page(bench.address, bench.stream_port());
    page.send(begins.substr(0, 2));
    page.send(begins.substr(2));  // neither a whole line nor a whole message
    page.read_to_end();
    EXPECT_TRUE(page.ended);
    EXPECT_EQ(page.bytes_read, 0u);
  }
  EXPECT_THAT(bench.log_text(), HasSubstr("HTTP request on the control stream"));
}

TEST(ControlStream, UntrustedClientsEvictNoTrustedOne) {
  const TokenFile file;
  ControlConfig config;
  config.token_file = file.path;
  LimitConfig limits;
  limits.control_clients = 3;
  ControlBench bench(config, limits);
  std::list<StreamClient> subscribers;
  for (int i = 0; i < 2; ++i) {
    subscribers.emplace_back(bench).greet(TokenFile::text);
    subscribers.back().send({2, control::Subscribe{true, false, false, false}});
    ASSERT_TRUE(subscribers.back().next());
  }
  std::this_thread::sleep_for(milliseconds(1200));  // silent long enough to be evicted
  std::list<Client> untrusted;
  for (int i = 0; i < 40; ++i) untrusted.emplace_back(bench.address, bench.stream_port());
  for (int i = 0; i < 20; ++i) {
    StreamClient asks(bench);
    asks.greet(TokenFile::text);
    asks.send({2, control::GetStatus{}});
    ASSERT_TRUE(asks.next()) << "request " << i;
    asks.tcp.finish_sending();
    EXPECT_TRUE(asks.tcp.read_to_end());
  }
  bench.on_io([&] { bench.events.publish(ping_event(1)); });
  for (StreamClient& s : subscribers) EXPECT_TRUE(s.next()) << "they keep their slots";
}

TEST(ControlStream, AClientWithATokenGetsTheErrorThatAllSlotsAreInUse) {
  const TokenFile file;
  ControlConfig config;
  config.token_file = file.path;
  LimitConfig limits;
  limits.control_clients = 1;
  ControlBench bench(config, limits);
  for (int i = 0; i < 50; ++i) {  // on a slow machine `busy` may already have been silent for a second
    StreamClient busy(bench);
    const auto in = [&busy] {
      busy.send({1, control::Hello{1, "test", TokenFile::text}});
      const auto answer = busy.next();
      return answer && answer->has_hello();
    };
    if (!in()) continue;  // the last client still has the slot
    StreamClient late(bench);
    late.send({1, control::Hello{1, "test", TokenFile::text}});
    const auto answer = late.next();
    ASSERT_TRUE(answer);
    if (answer->status().code() == v1::Status::OK) continue;
    EXPECT_EQ(answer->status().code(), v1::Status::FAILED);
    EXPECT_THAT(answer->status().text(), HasSubstr("all connection slots are in use"));
    EXPECT_TRUE(late.tcp.read_to_end());
    return;
  }
  FAIL() << "every client was admitted";
}

TEST(ControlStream, StopsDuringSubscriptionsAndRequests) {
  ControlBench bench;
  StreamClient idle(bench), subscriber(bench), waiting(bench);
  subscriber.greet();
  subscriber.send({2, control::Subscribe{true, true, true, true}});
  ASSERT_TRUE(subscriber.next());
  waiting.greet();
  waiting.send({2, control::LoadScene{"later"}});
  EXPECT_TRUE(eventually([&] { return bench.operations.asked == 1; }));
  bench.stop();
  subscriber.tcp.read_to_end();
  EXPECT_TRUE(subscriber.tcp.ended);
}

}  // namespace
}  // namespace sonar::testing_daemon
