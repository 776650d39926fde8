// Which targets, hosts, origins and routes are accepted and which are refused.
#include "daemon/server/http/http_router.hpp"

#include <gmock/gmock.h>

namespace sonar {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using Kind = Route::Kind;

constexpr Ipv4 reached{127, 0, 0, 5};
const std::vector<std::string> names = {"sonar-lab", "sonar.example.org", "10.1.2.3"};

TEST(HttpRules, TargetsAreSplitAndDecoded) {
  const auto t = parse_target("/api/v1/sonars/front%20left%2Fup?pings=1&why=%41+b&flag");
  ASSERT_TRUE(t);
  EXPECT_THAT(t->segments, ElementsAre("api", "v1", "sonars", "front left/up"));
  EXPECT_THAT(t->query, ElementsAre(Pair("pings", "1"), Pair("why", "A+b"), Pair("flag", "")));
  EXPECT_TRUE(parse_target("/")->segments.empty());
  EXPECT_THAT(parse_target("/healthz/")->segments, ElementsAre("healthz"));
  for (const char* bad : {"", "*", "http://127.0.0.1/", "/a%", "/a%4", "/a%4g", "/a%00", "/a%0Ab", "/a?b=%7f", "api"})
    EXPECT_FALSE(parse_target(bad)) << bad;
}

TEST(HttpRules, HostsOfThisComputerAreAllowed) {
  for (const char* good : {"127.0.0.5:8088", "127.0.0.5", "127.0.0.1:1", "localhost", "LocalHost:8088", "sonar-lab",
                           "SONAR.example.org:80", "10.1.2.3"})
    EXPECT_TRUE(host_allowed(good, reached, names)) << good;
  for (const char* bad : {"", ":80", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "192.168.1.7", "[::1]",
                          "localhost:", "localhost:80a", "localhost:123456", "127.0.0.1:80:80", "localhost@evil.example",
                          "0.0.0.0", "sonar-lab.", "127.1"})
    EXPECT_FALSE(host_allowed(bad, reached, names)) << bad;
  EXPECT_TRUE(host_allowed("192.168.1.7:8088", {192, 168, 1, 7}, {})) << "the address of the connection";
}

TEST(HttpRules, OriginsThatMaySendRequests) {
  for (const char* good : {"http://127.0.0.5:8088", "http://localhost", "HTTPS://sonar-lab:444"})
    EXPECT_TRUE(origin_allowed(good, reached, names)) << good;
  for (const char* bad : {"", "null", "http://", "http://evil.example", "file://", "localhost", "ftp://localhost",
                          "http://localhost.evil.example", "http://localhost/"})
    EXPECT_FALSE(origin_allowed(bad, reached, names)) << bad;
}

Route route(const char* target, const char* method = "GET") { return route_of(*parse_target(target), method); }

TEST(HttpRules, PathsLeadToOperations) {
  EXPECT_EQ(route("/").kind, Kind::help);
  EXPECT_EQ(route("/healthz").kind, Kind::health);
  EXPECT_EQ(route("/metrics").kind, Kind::metrics);
  EXPECT_EQ(route("/api/v1/status").kind, Kind::status);
  EXPECT_EQ(route("/api/v1/events?pings=1").kind, Kind::events);
  for (const char* op : {"sonar", "environment", "load", "pose", "object", "add_object", "remove_object", "set_object",
                         "set_trajectory", "step", "start_recording", "stop_recording"}) {
    const Route r = route(("/api/v1/" + std::string(op)).c_str());
    EXPECT_EQ(r.kind, Kind::operation);
    EXPECT_EQ(r.op, op);
    EXPECT_EQ(r.method, "POST");
  }
  EXPECT_EQ(route("/api/v1/sonars/front").op, "sonar");
  EXPECT_EQ(route("/api/v1/sonars/front").name, "front");
  EXPECT_EQ(route("/api/v1/objects/a%20b").name, "a b");
  EXPECT_EQ(route("/api/v1/objects/a").op, "set_object");
  for (const char* none : {"/api", "/api/v1", "/api/v2/status", "/api/v1/hello", "/api/v1/subscribe", "/api/v1/sonars",
                           "/api/v1/status/x", "/etc/passwd", "/api/v1/sonars/a/b"})
    EXPECT_EQ(route(none).kind, Kind::unknown) << none;
}

TEST(HttpRules, PathsOfFaultsLeadToOperations) {
  EXPECT_EQ(route("/api/v1/faults").kind, Kind::faults);
  EXPECT_EQ(route("/api/v1/faults", "POST").op, "add_fault");
  for (const char* list : {"kinds", "journal"}) {
    const Route r = route(("/api/v1/faults/" + std::string(list)).c_str());
    EXPECT_EQ(r.kind, Kind::faults);
    EXPECT_EQ(r.op, list);
    EXPECT_EQ(r.method, "GET");
  }
  EXPECT_EQ(route("/api/v1/faults/reset").op, "end_faults");
  EXPECT_EQ(route("/api/v1/faults/reset").method, "POST");
  const Route one = route("/api/v1/faults/slow%20net");
  EXPECT_EQ(one.kind, Kind::end_fault);
  EXPECT_EQ(one.method, "DELETE");
  EXPECT_EQ(one.name, "slow net");
}

TEST(HttpRules, ARequestIsDetectedByItsFirstBytes) {
  for (const char* begins : {"GET / HT", "POST /", "OPTIONS ", "PUT *", "HEAD /x"})
    EXPECT_TRUE(begins_http_request(begins)) << begins;
  for (const char* other : {"", "GET", "GETX /", "OPTIONS", "\x08\x12\x06", "get / HT"})
    EXPECT_FALSE(begins_http_request(other)) << other;
}

TEST(HttpRules, ARequestIsDetectedInAnyPieces) {
  const auto detects = [](std::string_view stream, std::size_t first) {
    HttpDetector detector;
    const auto bytes = std::as_bytes(std::span(stream));
    return detector.speaks_http(bytes.first(first)) || detector.speaks_http(bytes.subspan(first));
  };
  for (std::size_t first = 0; first <= 12; ++first) {
    EXPECT_TRUE(detects("DELETE /x HT", first)) << first;
    EXPECT_FALSE(detects("binary GET /", first)) << "a method counts only at the beginning";
  }
}

TEST(HttpRules, QueriesSelectEvents) {
  const auto of = [](const char* target) { return subscription_of(*parse_target(target)); };
  EXPECT_TRUE(of("/e")->pings && of("/e")->clients && of("/e")->poses && of("/e")->scene) << "without a query, all events";
  const auto some = of("/e?pings=1&scene=true&poses=0");
  ASSERT_TRUE(some);
  EXPECT_TRUE(some->pings && some->scene && !some->poses && !some->clients);
  EXPECT_THAT(of("/e?ping=1").error().text, HasSubstr("\"ping\": unknown"));
  EXPECT_THAT(of("/e?pings=yes").error().text, HasSubstr("1 or 0"));
  EXPECT_THAT(of("/e?pings=0").error().text, HasSubstr("no events requested"));
}

TEST(HttpRules, OnlyJsonTypesAreAccepted) {
  for (const char* good : {"application/json", "Application/JSON; charset=utf-8", "application/json ;x"})
    EXPECT_TRUE(is_json(good)) << good;
  for (const char* bad :
       {"", "text/plain", "application/jsonp", "application/x-www-form-urlencoded", "text/plain; application/json"})
    EXPECT_FALSE(is_json(bad)) << bad;
}

}  // namespace
}  // namespace sonar
