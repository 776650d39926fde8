// HTTP over loopback: documents, operations, events, keep-alive, limits, token, stop.
#include <gmock/gmock.h>

#include <list>
#include <nlohmann/json.hpp>

#include "tests/daemon/server/control/control_bench.hpp"

namespace sonar::testing_daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct HttpClient {
  Client tcp;
  std::string received, host;
  explicit HttpClient(ControlBench& bench)
      : tcp(bench.address, bench.http_port()), host(bench.address + ":" + std::to_string(bench.http_port())) {}

  void send(const std::string& method, const std::string& target, const std::string& body = "", const std::string& more = "") {
    std::string text = method + " " + target + " HTTP/1.1\r\nHost: " + host + "\r\n" + more;
    if (method == "POST") text += "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
    tcp.send(text + "\r\n" + body);
  }
  bool more(milliseconds timeout = patience) {
    const auto raw = tcp.read_raw(1, timeout);
    for (const std::byte b : raw) received += static_cast<char>(b);
    return !raw.empty();
  }
  /// Reads until `end`; returns all bytes up to and including it.
  std::string until(const std::string& end) {
    while (received.find(end) == std::string::npos)
      if (!more()) return "";
    const std::string part = received.substr(0, received.find(end) + end.size());
    received.erase(0, part.size());
    return part;
  }
  struct Answer {
    int status = 0;
    std::string head, body;
    json document() const { return json::parse(body); }
  };
  Answer next(bool without_body = false) {
    Answer answer;
    answer.head = until("\r\n\r\n");
    if (answer.head.size() < 12) return answer;
    answer.status = std::stoi(answer.head.substr(9, 3));
    const auto at = answer.head.find("Content-Length: ");
    if (at == std::string::npos || without_body) return answer;
    const auto size = static_cast<std::size_t>(std::stoul(answer.head.substr(at + 16)));
    while (received.size() < size)
      if (!more()) return answer;
    answer.body = received.substr(0, size);
    received.erase(0, size);
    return answer;
  }
  Answer get(const std::string& target, const std::string& more_head = "") {
    send("GET", target, "", more_head);
    return next();
  }
  Answer post(const std::string& target, const std::string& body) {
    send("POST", target, body);
    return next();
  }
};

TEST(ControlHttp, ServesManyRequestsOnOneConnection) {
  ControlBench bench;
  HttpClient client(bench);
  const auto help = client.get("/");
  EXPECT_EQ(help.status, 200);
  EXPECT_THAT(help.body, HasSubstr("curl -s http://" + client.host + "/api/v1/status"));
  EXPECT_EQ(client.get("/healthz").body, "ok\n");
  const auto metrics = client.get("/metrics");
  EXPECT_THAT(metrics.body, HasSubstr("sonard_up 1\n"));
  EXPECT_THAT(metrics.head, HasSubstr("Content-Type: text/plain; version=0.0.4"));
  EXPECT_EQ(client.get("/api/v1/status").document()["version"], "fake");
  client.send("HEAD", "/metrics");
  const auto head = client.next(true);
  EXPECT_EQ(head.status, 200);
  EXPECT_THAT(head.head, HasSubstr("Content-Length: " + std::to_string(metrics.body.size())));
  EXPECT_EQ(client.post("/api/v1/sonar", R"({"range_m":5})").document()["code"], "OK");
  EXPECT_EQ(client.get("/nothing").status, 404);
  EXPECT_EQ(client.get("/api/v1/load").status, 405);
  EXPECT_EQ(client.get("/healthz").status, 200) << "an error status does not end the connection";
  EXPECT_EQ(bench.operations.asked, 2);
}

TEST(ControlHttp, OperationsAnswerWithTheirStatus) {
  ControlBench bench;
  HttpClient client(bench);
  const auto refused = client.post("/api/v1/sonars/unknown", "{}");
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(refused.document()["text"], "there is no sonar \"unknown\"");
  EXPECT_EQ(refused.document()["code"], "REFUSED");
  const auto failed = client.post("/api/v1/load", R"({"path":"x"})");
  EXPECT_EQ(failed.status, 409);
  EXPECT_EQ(failed.document()["code"], "FAILED");
  const auto pose = client.post("/api/v1/pose", R"({"frame":"ENU_FLU","position":{"x":1},"orientation":{"w":1}})");
  EXPECT_EQ(pose.status, 200) << pose.body;
  bench.on_io(
      [&] { EXPECT_EQ(bench.operations.last_sender.id, "http 127.0.0.1") << "all connections of an address are one sender"; });
  EXPECT_EQ(client.post("/api/v1/pose", "{}").status, 400);
  bench.on_io([&] { EXPECT_EQ(bench.world.counters().refused, 1u); });
  client.send("POST", "/api/v1/load", R"({"path":"later"})");
  EXPECT_TRUE(eventually([&] { return bench.operations.asked == 4; }));
  bench.on_io([&] { bench.operations.later.at(0)({OperationResult::Code::done, "loaded"}); });
  EXPECT_EQ(client.next().document()["text"], "loaded");
}

TEST(ControlHttp, HealthSaysWhatIsWrong) {
  ControlBench bench;
  bench.operations.in_trouble = true;
  const auto sick = HttpClient(bench).get("/healthz");
  EXPECT_EQ(sick.status, 503);
  EXPECT_EQ(sick.body, "the engine hangs\n");
}

TEST(ControlHttp, PipelinedRequestsAreAnsweredInOrder) {
  ControlBench bench;
  HttpClient client(bench);
  for (int i = 0; i < 5; ++i) client.send("GET", i % 2 == 0 ? "/healthz" : "/metrics");
  for (int i = 0; i < 5; ++i) EXPECT_EQ(client.next().body.size(), i % 2 == 0 ? 3u : bench.operations.metrics().size());
}

TEST(ControlHttp, EventsAreLinesOfJson) {
  ControlBench bench;
  HttpClient client(bench);
  client.send("GET", "/api/v1/events?pings=1");
  EXPECT_THAT(client.until("\r\n\r\n"), HasSubstr("Transfer-Encoding: chunked"));
  EXPECT_TRUE(eventually([&] {
    bool heard = false;
    bench.on_io([&] { heard = bench.events.has_listeners(); });
    return heard;
  }));
  bench.on_io([&] {
    bench.events.publish_scene("s", "not asked for");
    for (std::uint32_t i = 0; i < 3; ++i) bench.events.publish(ping_event(i));
  });
  for (int i = 0; i < 3; ++i) {
    const std::string size = client.until("\r\n");
    const std::string line = client.until("\r\n");
    EXPECT_EQ(std::stoul(size, nullptr, 16), line.size() - 2);
    EXPECT_EQ(json::parse(line)["ping"]["number"], i);
    EXPECT_EQ(line[line.size() - 3], '\n');
  }
  client.tcp.close();
  EXPECT_TRUE(eventually([&] {  // the client's listener is removed with the next event
    bool heard = true;
    bench.on_io([&] {
      bench.events.publish(ping_event(9));
      heard = bench.events.has_listeners();
    });
    return !heard;
  }));
}

TEST(ControlHttp, BodiesAndHeadersAreBounded) {
  ControlBench bench;
  {
    HttpClient client(bench);
    client.tcp.send("POST /api/v1/load HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1048577\r\n\r\n");
    client.tcp.send(std::string(100000, 'x'));  // bytes that still arrive do not prevent the answer
    const auto answer = client.next();
    EXPECT_EQ(answer.status, 413);
    EXPECT_THAT(answer.head, HasSubstr("Connection: close"));
    EXPECT_THAT(answer.document()["text"].get<std::string>(), HasSubstr("1048576 bytes"));
  }
  {
    HttpClient client(bench);
    client.tcp.send("GET / HTTP/1.1\r\nX: " + std::string(9000, 'x'));
    EXPECT_EQ(client.next().status, 431);
  }
  {
    HttpClient client(bench);
    client.tcp.send(std::string("\x16\x03\x01\x02not HTTP at all\r\n\r\n"));
    EXPECT_EQ(client.next().status, 400);
    client.tcp.finish_sending();
    EXPECT_TRUE(client.tcp.read_to_end());
  }
}

TEST(ControlHttp, ForeignHostsAndOriginsAreRefused) {
  ControlBench bench;
  HttpClient client(bench);
  client.tcp.send("GET /api/v1/status HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(client.next().status, 403);
  EXPECT_EQ(client.get("/api/v1/status", "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(client.get("/api/v1/status", "Origin: http://localhost:3000\r\n").status, 200);
  const auto answer = client.get("/api/v1/status");
  EXPECT_EQ(answer.head.find("Access-Control"), std::string::npos);
  EXPECT_EQ(bench.operations.asked, 2);
}

TEST(ControlHttp, WithATokenOnlyHealthIsOpen) {
  const TokenFile file;
  ControlConfig config;
  config.token_file = file.path;
  ControlBench bench(config);
  HttpClient client(bench);
  const auto told = client.get("/api/v1/status");
  EXPECT_EQ(told.status, 401);
  EXPECT_THAT(told.head, HasSubstr("WWW-Authenticate: Bearer"));
  EXPECT_EQ(client.get("/metrics", "Authorization: Bearer wrong\r\n").status, 401);
  EXPECT_EQ(client.get("/healthz").body, "ok\n");
  bench.operations.in_trouble = true;
  EXPECT_EQ(client.get("/healthz").body, "unhealthy\n");
  EXPECT_EQ(client.get("/api/v1/status", std::string("Authorization: Bearer ") + TokenFile::text + "\r\n").status, 200);
  EXPECT_EQ(bench.log_text().find("0123456789"), std::string::npos);
  EXPECT_THAT(bench.log_text(), HasSubstr("control refused: token required: "));
  EXPECT_EQ(bench.log_text().find("suppressed"), std::string::npos) << "no line was suppressed";
}

TEST(ControlHttp, Http10AndExpectContinueAreServed) {
  ControlBench bench;
  {
    HttpClient client(bench);
    client.tcp.send("GET /healthz HTTP/1.0\r\nHost: localhost\r\nConnection: keep-alive\r\n\r\n");
    const auto kept = client.next();
    EXPECT_EQ(kept.body, "ok\n");
    EXPECT_THAT(kept.head, HasSubstr("\r\nConnection: keep-alive\r\n"));
    client.tcp.send("GET /healthz HTTP/1.0\r\nHost: localhost\r\n\r\n");
    const auto last = client.next();
    EXPECT_EQ(last.body, "ok\n");
    EXPECT_THAT(last.head, HasSubstr("\r\nConnection: close\r\n"));
    EXPECT_TRUE(client.tcp.read_to_end());
  }
  {
    HttpClient client(bench);
    client.tcp.send("GET /healthz HTTP/1.0\r\n\r\n");
    EXPECT_EQ(client.next().body, "ok\n") << "HTTP 1.0 needs no Host";
  }
  for (const std::string request : {"GET /healthz HTTP/1.1\r\n\r\n", "GET /healthz HTTP/1.0\r\nHost: evil.example\r\n\r\n",
                                    "GET /api/v1/status HTTP/1.0\r\nOrigin: http://evil.example\r\n\r\n"}) {
    HttpClient client(bench);
    client.tcp.send(request);
    EXPECT_EQ(client.next().status, request.find("1.1") != std::string::npos ? 400 : 403) << request;
  }
  HttpClient client(bench);
  client.tcp.send(
      "POST /api/v1/sonar HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nExpect: 100-continue\r\n"
      "Content-Length: 2\r\n\r\n");
  EXPECT_THAT(client.until("\r\n\r\n"), StartsWith("HTTP/1.1 100 "));
  client.tcp.send("{}");
  EXPECT_EQ(client.next().status, 200);
}

TEST(ControlHttp, ConnectionsBeyondTheLimitGet503AndSilentOnesAreReplaced) {
  LimitConfig limits;
  limits.control_clients = 2;
  ControlBench bench({}, limits);
  HttpClient a(bench), b(bench);
  EXPECT_EQ(a.get("/healthz").status, 200);
  EXPECT_EQ(b.get("/healthz").status, 200);
  HttpClient c(bench);
  const auto answer = c.next();
  EXPECT_TRUE(answer.status == 503 || answer.status == 0);  // on a slow machine `a` may already have been silent for too long
  std::this_thread::sleep_for(milliseconds(1200));
  EXPECT_EQ(b.get("/healthz").status, 200);
  HttpClient d(bench);
  EXPECT_EQ(d.get("/healthz").status, 200);
  a.tcp.read_to_end();
  EXPECT_TRUE(a.tcp.ended);
}

/// As many clients as there are slots send endless requests, byte by byte.
TEST(ControlHttp, SlowSendersReplaceNoOtherClient) {
  ControlBench bench;
  std::list<Client> slow;
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-Slow: " + std::string(200, 'x');
  for (int i = 0; i < 32; ++i) {
    slow.emplace_back(bench.address, bench.http_port());
    slow.back().send(request.substr(0, 40));
  }
  for (std::size_t i = 0; i < 12; ++i) {
    for (Client& c : slow) c.send(request.substr(40 + i, 1));
    HttpClient watches(bench);
    EXPECT_EQ(watches.get("/healthz").body, "ok\n") << i;
  }
}

/// The limit is an amount of work in the time that passed, so it holds on any machine.
TEST(ControlHttp, RequestsCostMoreThanTheirBytes) {
  LimitConfig limits;
  limits.input_bytes_per_s = 65536;
  ControlBench bench({}, limits);
  const auto begin = Steady::now();
  const auto most = [&](std::size_t cost) {
    return 2 + (1 + std::chrono::duration<double>(Steady::now() - begin).count()) * 65536 / static_cast<double>(cost);
  };
  HttpClient flood(bench);
  for (int i = 0; i < 2000; ++i) flood.send("GET", "/api/v1/status");
  EXPECT_TRUE(eventually([&] { return bench.operations.asked > 20; }));
  std::this_thread::sleep_for(milliseconds(500));
  EXPECT_LT(bench.operations.asked, most(512));
  const int before = bench.operations.asked;
  for (int i = 0; i < 40; ++i) {  // a new connection has no new limit
    HttpClient again(bench);
    EXPECT_EQ(again.get("/api/v1/status").status, 200);
  }
  EXPECT_LT(bench.operations.asked, most(512)) << before;
}

TEST(ControlHttp, UntrustedClientsEvictNoTrustedOne) {
  const TokenFile file;
  ControlConfig config;
  config.token_file = file.path;
  LimitConfig limits;
  limits.control_clients = 3;
  ControlBench bench(config, limits);
  const std::string token = std::string("Authorization: Bearer ") + TokenFile::text + "\r\n";
  HttpClient events(bench);
  events.send("GET", "/api/v1/events?pings=1", "", token);
  ASSERT_FALSE(events.until("\r\n\r\n").empty());
  std::this_thread::sleep_for(milliseconds(1200));  // silent long enough to be evicted
  std::list<Client> untrusted;
  for (int i = 0; i < 40; ++i) untrusted.emplace_back(bench.address, bench.http_port());
  for (int i = 0; i < 20; ++i) {
    HttpClient asks(bench);
    ASSERT_EQ(asks.get("/api/v1/status", token).status, 200) << "request " << i;
    asks.tcp.finish_sending();
    EXPECT_TRUE(asks.tcp.read_to_end());
  }
  bench.on_io([&] { bench.events.publish(ping_event(1)); });
  EXPECT_FALSE(events.until("\r\n").empty()) << "the subscriber keeps its slot";
}

TEST(ControlHttp, RefusedClientsReadTheReason) {
  LimitConfig limits;
  limits.control_clients = 1;
  ControlBench bench({}, limits);
  HttpClient busy(bench);
  for (int i = 0; i < 10; ++i) {
    if (busy.get("/healthz").status != 200) break;  // on a slow machine it was silent for a second and lost its slot
    HttpClient newcomer(bench);
    newcomer.send("POST", "/api/v1/load", std::string(20000, ' '));
    const auto answer = newcomer.next();
    if (answer.status == 400) break;  // busy has lost its slot
    ASSERT_EQ(answer.status, 503) << "the client gets an answer, not a reset";
    EXPECT_THAT(answer.body, HasSubstr("too many connections"));
  }
}

TEST(ControlHttp, AnExceptionEndsItsConnectionOnly) {
  ControlBench bench;
  HttpClient unlucky(bench);
  unlucky.send("POST", "/api/v1/load", R"({"path":"throw"})");
  unlucky.tcp.read_to_end();
  EXPECT_TRUE(unlucky.tcp.ended);
  EXPECT_EQ(HttpClient(bench).get("/healthz").status, 200);
  EXPECT_THAT(bench.log_text(), HasSubstr("internal fault: no such luck"));
}

TEST(ControlHttp, StopsDuringStreamsAndRequests) {
  ControlBench bench;
  HttpClient idle(bench), events(bench), waiting(bench), half(bench);
  events.send("GET", "/api/v1/events");
  EXPECT_FALSE(events.until("\r\n\r\n").empty());
  waiting.send("POST", "/api/v1/load", R"({"path":"later"})");
  half.tcp.send("GET / HT");
  EXPECT_TRUE(eventually([&] { return bench.operations.asked == 1; }));
  bench.stop();
  events.tcp.read_to_end();
  EXPECT_TRUE(events.tcp.ended);
}

TEST(ControlHttp, StopsWithoutWaitingForClientsThatSentTooMuch) {
  LimitConfig limits;
  limits.input_bytes_per_s = 1024;  // the next bytes are read only after a quarter of a minute
  ControlBench bench({}, limits);
  HttpClient talks(bench);
  talks.tcp.send("POST /api/v1/pose HTTP/1.1\r\nContent-Length: 100000\r\n\r\n" + std::string(30000, ' '));
  Client streams(bench.address, bench.stream_port());
  streams.send(std::string("\x04\x12\x02\x08\x01\xa0\x8d\x06") + std::string(30000, ' '));
  ASSERT_FALSE(streams.read_raw(1).empty()) << "no answer to Hello";
  std::this_thread::sleep_for(milliseconds(200));
  const auto begin = Steady::now();
  bench.stop();
  EXPECT_LT(Steady::now() - begin, std::chrono::seconds(8));
}

}  // namespace
}  // namespace sonar::testing_daemon
