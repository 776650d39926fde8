// Fuzzes the HTTP port: requests in a stream, and their routing. The first byte gives the length of the pieces, the second byte
// whether a token is needed; the rest is the stream. The requests must not depend on the pieces. An accepted request has an
// allowed Host, or is HTTP/1.0. Without the token only /healthz and the files of the page are accepted.
#include <algorithm>
#include <string>
#include <vector>

#include "daemon/server/http/door.hpp"
#include "daemon/server/http/http_router.hpp"
#include "daemon/server/http/page.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace {

using namespace sonar;
using fuzz::require;

struct Taken {
  std::vector<HttpRequest> requests;
  unsigned refused = 0;
};
bool same(const HttpRequest& a, const HttpRequest& b) {
  return a.method == b.method && a.target == b.target && a.host == b.host && a.origin == b.origin && a.body == b.body &&
         a.authorization == b.authorization && a.content_type == b.content_type && a.keep_alive == b.keep_alive;
}
Taken take(std::span<const std::byte> stream, std::size_t piece) {
  Taken taken;
  HttpReader reader;
  for (std::size_t at = 0; at < stream.size() && taken.refused == 0; at += piece) {
    reader.feed(stream.subspan(at, std::min(piece, stream.size() - at)));
    auto request = reader.next();
    for (; request && *request; request = reader.next()) taken.requests.push_back(std::move(**request));
    if (!request) taken.refused = request.error().status;
    reader.asks_to_continue();
  }
  return taken;
}

/// Checks that a socket is opened only to a client that sends a secret or has an allowed Origin.
void check_door(const HttpRequest& request, const SocketAction& asked, const HttpPolicy& policy) {
  ControlConfig config;
  config.hosts = {"sonar.example"};
  config.view_origins = {{"http://a"}};
  ViewSecrets secrets;
  const auto opened = open_view(request, asked.query, {policy.token, secrets, policy.reached, config}, {});
  const auto* welcome = std::get_if<ViewWelcome>(&opened);
  if (welcome == nullptr) return;
  require(request.socket_version == "13" && !request.bytes_behind);
  if (policy.token.needed()) {
    const auto is_token = [&](const auto& pair) { return pair.first == "token" && policy.token.matches(pair.second); };
    return require(policy.token.matches(bearer_token(request.authorization)) || std::ranges::any_of(asked.query, is_token));
  }
  require(!request.has_origin || request.origin == "http://a" || origin_allowed(request.origin, policy.reached, policy.hosts));
  require(request.origin != "http://a" || !welcome->may_steer);
}

void check(const HttpRequest& request, const HttpPolicy& policy) {
  require(request.body.size() <= HttpReader::longest_body);
  const RoutedRequest routed = route_request(request, policy);
  if (const auto* answer = std::get_if<HttpAnswer>(&routed.action)) {
    if (answer->status >= 400 && answer->body.starts_with('{')) return require(answer->status < 500);
    // Files of the page hold no data, so they need no token.
    const std::string path = request.target.substr(0, request.target.find('?'));
    const auto page = page_answer({path, request.accept, request.accept_encoding, request.if_none_match});
    require(page && page->status == answer->status && (request.method == "GET" || request.method == "HEAD"));
    require(request.has_host ? host_allowed(request.host, policy.reached, policy.hosts) : request.http_1_0);
    return require(!request.has_origin || origin_allowed(request.origin, policy.reached, policy.hosts));
  }
  if (const auto* asked = std::get_if<SocketAction>(&routed.action)) return check_door(request, *asked, policy);
  require(request.has_host ? host_allowed(request.host, policy.reached, policy.hosts) : request.http_1_0);
  require(!request.has_origin || origin_allowed(request.origin, policy.reached, policy.hosts));
  if (!policy.token.matches(bearer_token(request.authorization))) {
    const auto* health = std::get_if<HealthAction>(&routed.action);
    require(health != nullptr && !health->with_text);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  static const Token secret("0123456789abcdef");
  static const Token none;
  static const std::vector<std::string> hosts{"sonar.example"};
  const HttpPolicy policy{data[1] % 2 == 1 ? secret : none, Ipv4{192, 168, 1, 2}, hosts};
  const auto stream = std::as_bytes(std::span(data, size)).subspan(2);
  const Taken whole = take(stream, stream.size()), pieces = take(stream, data[0] + std::size_t{1});
  require(whole.requests.size() == pieces.requests.size());  // the time at which half a request is refused may differ
  for (std::size_t i = 0; i < whole.requests.size(); ++i) {
    require(same(whole.requests[i], pieces.requests[i]));
    check(whole.requests[i], policy);
  }
  return 0;
}
