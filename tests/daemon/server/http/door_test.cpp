// Which clients may read and which may change settings: every cell of the table in docs/live-view.md, and the handshake.
#include "daemon/server/http/door.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/server/http/http_router.hpp"

namespace sonar::door_test {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

const Token no_token, lab_token("0123456789abcdef");

struct Door : testing::Test {
  Door() {
    config.hosts = {"sonar-lab"};
    config.view_origins = {{"https://look.example", false}, {"https://steer.example", true}};
    secrets.make_key();
    request.method = "GET";
    request.target = "/";
    request.upgrade = "websocket";
    request.connection = "keep-alive, Upgrade";
    request.socket_version = "13";
    request.socket_key = "dGhlIHNhbXBsZSBub25jZQ==";
    request.socket_protocols = "foxglove.sdk.v1";
  }
  std::variant<HttpAnswer, ViewWelcome> open(const Token& token = no_token) {
    return open_view(request, query, {token, secrets, {127, 0, 0, 1}, config}, now);
  }
  /// Returns "steers" or "looks" for an admitted viewer, else the status of the answer.
  std::string outcome(const Token& token = no_token) {
    const auto opened = open(token);
    if (const auto* welcome = std::get_if<ViewWelcome>(&opened)) return welcome->may_steer ? "steers" : "looks";
    return std::to_string(std::get<HttpAnswer>(opened).status);
  }
  std::string outcome_from(const std::string& origin, const Token& token = no_token) {
    request.has_origin = true;
    request.origin = origin;
    return outcome(token);
  }
  HttpRequest request;
  std::vector<std::pair<std::string, std::string>> query;
  ViewSecrets secrets;
  ControlConfig config;
  ViewSecrets::Steady::time_point now{};
};

TEST_F(Door, OriginAndKeyDecideWhoMayReadAndSteer) {
  EXPECT_EQ(outcome(), "steers") << "a program sends no Origin";
  EXPECT_EQ(outcome_from("http://127.0.0.1:8088"), "steers");
  EXPECT_EQ(outcome_from("http://sonar-lab"), "steers");
  EXPECT_EQ(outcome_from("https://look.example"), "looks");
  EXPECT_EQ(outcome_from("https://steer.example"), "steers");
  EXPECT_EQ(outcome_from("https://look.example:8443"), "403") << "the port must match, too";
  EXPECT_EQ(outcome_from("https://evil.example"), "403");
  EXPECT_EQ(outcome_from("null"), "403");
  EXPECT_EQ(outcome_from("file://"), "403");
  EXPECT_EQ(outcome_from(""), "403");
}

TEST_F(Door, WithTheKeyAnyOriginIsAdmitted) {
  query = {{"key", secrets.key()}};
  EXPECT_EQ(outcome_from("null"), "steers");
  EXPECT_EQ(outcome_from("https://look.example"), "steers");
  query = {{"key", std::string(32, '0')}};
  EXPECT_EQ(outcome_from("null"), "403");
  EXPECT_EQ(outcome_from("https://look.example"), "looks");
  secrets = {};  // there is no secret
  query = {{"key", ""}};
  EXPECT_EQ(outcome_from("null"), "403");
}

TEST_F(Door, WithATokenFileEveryViewerMustSendTheToken) {
  for (const char* origin : {"http://127.0.0.1", "https://look.example", "https://steer.example", "null"})
    EXPECT_EQ(outcome_from(origin, lab_token), "401") << origin;
  request.has_origin = false;
  EXPECT_EQ(outcome(lab_token), "401");
  query = {{"key", secrets.key()}};
  EXPECT_EQ(outcome(lab_token), "401") << "the key is no token";
  query = {{"token", "0123456789abcdef"}};
  EXPECT_EQ(outcome(lab_token), "steers");
  EXPECT_EQ(outcome_from("null", lab_token), "steers");
  query = {{"token", "0123456789abcdee"}};
  EXPECT_EQ(outcome(lab_token), "401");
  query = {};
  request.authorization = "Bearer 0123456789abcdef";
  EXPECT_EQ(outcome(lab_token), "steers");
}

TEST_F(Door, TicketsAreValidOnceAndForHalfAMinute) {
  const std::string ticket = secrets.new_ticket(now);
  EXPECT_EQ(ticket.size(), 32u);
  query = {{"ticket", ticket}};
  EXPECT_EQ(outcome(lab_token), "steers");
  EXPECT_EQ(outcome(lab_token), "401") << "used";
  query = {{"ticket", secrets.new_ticket(now)}};
  now += seconds(31);
  EXPECT_EQ(outcome(lab_token), "401") << "too old";
}

TEST_F(Door, RefusalsNameTheLineThatWouldAdmitTheViewer) {
  request.has_origin = true;
  request.origin = "https://evil.example";
  const auto opened = open();
  const auto& answer = std::get<HttpAnswer>(opened);
  EXPECT_THAT(answer.why, HasSubstr("control: {view_origins: [\"https://evil.example\"]}"));
  EXPECT_THAT(answer.body, testing::Not(HasSubstr("view_origins")));
}

TEST_F(Door, TheHandshakeIsChecked) {
  const auto status = [this] { return outcome(); };
  request.socket_protocols = "other, foxglove.websocket.v1 ,foxglove.sdk.v1";
  EXPECT_EQ(std::get<ViewWelcome>(open()).protocol, "foxglove.websocket.v1") << "the first protocol that the client names";
  request.socket_protocols = "foxglove.sdk.v1, foxglove.websocket.v1";
  EXPECT_EQ(std::get<ViewWelcome>(open()).protocol, "foxglove.sdk.v1");
  request.socket_protocols = "";
  EXPECT_EQ(status(), "400");
  request.socket_protocols = "foxglove.sdk.v1";
  request.socket_version = "8";
  EXPECT_EQ(status(), "426");
  EXPECT_EQ(std::get<HttpAnswer>(open()).headers.at(0).second, "13");
  request.socket_version = "13";
  for (const char* key : {"", "dGhlIHNhbXBsZSBub25jZQ=", "dGhlIHNhbXBsZSBub25jZ!==", "dGhlIHNhbXBsZSBub25jZQaa"}) {
    request.socket_key = key;
    EXPECT_EQ(status(), "400") << key;
  }
  request.socket_key = "dGhlIHNhbXBsZSBub25jZQ==";
  request.bytes_behind = true;
  EXPECT_EQ(status(), "400");
  request.bytes_behind = false;
  request.http_1_0 = true;
  EXPECT_EQ(status(), "400");
  request.http_1_0 = false;
  request.connection = "keep-alive";
  EXPECT_EQ(status(), "400");
  request.connection = "Upgrade";
  query = {{"max_hz", "5"}};
  EXPECT_EQ(std::get<ViewWelcome>(open()).most_hz, 5);
  query = {{"max_hz", "-1"}};
  EXPECT_EQ(status(), "400");
  request.upgrade = "h2c";
  EXPECT_FALSE(wants_socket(request));
}

}  // namespace
}  // namespace sonar::door_test
