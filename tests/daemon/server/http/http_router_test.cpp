// The rules that map a request to an action, in their order, and the text of each refusal.
#include "daemon/server/http/http_router.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "daemon/server/http/page.hpp"

namespace sonar {
namespace {

using testing::HasSubstr;

const Token no_token, lab_token("0123456789abcdef");
const std::vector<std::string> hosts = {"sonar-lab"};

HttpRequest request_for(const std::string& method, const std::string& target, const std::string& body = "") {
  HttpRequest r;
  r.method = method;
  r.target = target;
  r.has_host = true;
  r.host = "127.0.0.1:8088";
  r.body = body;
  if (method == "POST") r.content_type = "application/json";
  return r;
}
RoutedRequest routed(const HttpRequest& r, const Token& token = no_token) {
  return route_request(r, {token, {127, 0, 0, 1}, hosts});
}
HttpAnswer answer_to(const HttpRequest& r, const Token& token = no_token) {
  const RoutedRequest j = routed(r, token);
  const auto* answer = std::get_if<HttpAnswer>(&j.action);
  EXPECT_NE(answer, nullptr) << "routed";
  if (answer == nullptr) return {};
  const auto json = nlohmann::json::parse(answer->body);
  EXPECT_FALSE(json["text"].get<std::string>().empty());
  EXPECT_NE(json["code"], "OK");
  return *answer;
}

TEST(HttpRouter, RoutesValidRequests) {
  EXPECT_TRUE(std::holds_alternative<HelpAction>(routed(request_for("GET", "/")).action));
  EXPECT_TRUE(std::holds_alternative<MetricsAction>(routed(request_for("HEAD", "/metrics")).action));
  EXPECT_TRUE(std::get<HealthAction>(routed(request_for("GET", "/healthz")).action).with_text);
  EXPECT_TRUE(std::get<control::Subscribe>(routed(request_for("GET", "/api/v1/events?clients=1")).action).clients);
  const auto status = routed(request_for("GET", "/api/v1/status"));
  EXPECT_TRUE(std::holds_alternative<control::GetStatus>(std::get<OperationAction>(status.action).operation));
  const auto sonar = routed(request_for("POST", "/api/v1/sonars/front", R"({"range_m":5})"));
  const auto& set = std::get<control::SetSonar>(std::get<OperationAction>(sonar.action).operation);
  EXPECT_EQ(set.sonar, "front");
  EXPECT_EQ(set.range_m, 5.0);
}

TEST(HttpRouter, GivesThePageWithoutATokenToBrowsersThatMayCall) {
  if (page_files().empty()) GTEST_SKIP() << "this build has no page";
  HttpRequest browser = request_for("GET", "/?sonar=front");
  browser.accept = "text/html,*/*;q=0.8";
  browser.accept_encoding = "gzip, br";
  const RoutedRequest page = routed(browser, lab_token);
  EXPECT_EQ(std::get<HttpAnswer>(page.action).status, 200u);
  EXPECT_EQ(std::get<HttpAnswer>(page.action).type, "text/html; charset=utf-8");
  browser.host = "elsewhere.example";
  EXPECT_EQ(answer_to(browser, lab_token).status, 403u);
  EXPECT_EQ(answer_to(request_for("GET", "/"), lab_token).status, 401u) << "the help text";
}

TEST(HttpRouter, WrongRequestsHaveTheirStatus) {
  EXPECT_EQ(answer_to(request_for("GET", "/nothing")).status, 404u);
  EXPECT_EQ(answer_to(request_for("GET", "http://a/")).status, 400u);
  EXPECT_EQ(answer_to(request_for("GET", "/api/v1/sonar")).status, 405u);
  EXPECT_EQ(answer_to(request_for("GET", "/api/v1/sonar")).allow, "POST");
  EXPECT_EQ(answer_to(request_for("POST", "/metrics", "{}")).allow, "GET, HEAD");
  EXPECT_EQ(answer_to(request_for("OPTIONS", "/api/v1/sonar")).status, 405u) << "preflight requests are rejected";
  EXPECT_EQ(answer_to(request_for("GET", "/api/v1/events?x=1")).status, 400u);
  HttpRequest form = request_for("POST", "/api/v1/sonar", "{}");
  form.content_type = "text/plain";
  EXPECT_EQ(answer_to(form).status, 415u);
  const HttpAnswer refused = answer_to(request_for("POST", "/api/v1/sonar", R"({"rang_m":5})"));
  EXPECT_EQ(refused.status, 400u);
  EXPECT_THAT(refused.body, HasSubstr("rang_m"));
  EXPECT_TRUE(routed(request_for("POST", "/api/v1/sonar", "x")).pose_refusal.empty());
  EXPECT_THAT(routed(request_for("POST", "/api/v1/pose", R"({"position":{},"orientation":{"w":1}})")).pose_refusal,
              HasSubstr("frame is missing"));
}

TEST(HttpRouter, UnknownHostsAndOriginsAreRejectedFirst) {
  HttpRequest rebound = request_for("GET", "/api/v1/status");
  rebound.host = "evil.example:8088";
  EXPECT_EQ(answer_to(rebound).status, 403u);
  HttpRequest nameless = request_for("GET", "/healthz");
  nameless.has_host = false;
  EXPECT_EQ(answer_to(nameless).status, 400u);
  HttpRequest page = request_for("POST", "/api/v1/sonar", "{}");
  page.has_origin = true;
  page.origin = "http://evil.example";
  EXPECT_EQ(answer_to(page).status, 403u);
  page.origin = "http://sonar-lab";
  EXPECT_TRUE(std::holds_alternative<OperationAction>(routed(page).action));
}

TEST(HttpRouter, RequestsWithoutTheRequiredTokenAreRejected) {
  for (const char* target : {"/", "/metrics", "/api/v1/status", "/nothing", "/api/v1/events"}) {
    HttpRequest r = request_for("GET", target);
    EXPECT_EQ(answer_to(r, lab_token).status, 401u) << target;
    r.authorization = "Bearer 0123456789abcdeX";
    EXPECT_EQ(answer_to(r, lab_token).status, 401u) << target;
  }
  HttpRequest post = request_for("POST", "/api/v1/sonar", "broken");
  EXPECT_EQ(answer_to(post, lab_token).status, 401u) << "the token is checked before the body";
  post.authorization = "Bearer 0123456789abcdef";
  EXPECT_EQ(answer_to(post, lab_token).status, 400u);
  EXPECT_FALSE(std::get<HealthAction>(routed(request_for("GET", "/healthz"), lab_token).action).with_text);
}

}  // namespace
}  // namespace sonar
