#include "daemon/server/http/http_router.hpp"

#include "core/text/decimal.hpp"
#include "daemon/server/http/page.hpp"

namespace sonar {
namespace {

using control::StatusCode;
using Kind = Route::Kind;

HttpAnswer refused(unsigned status, const std::string& text) {
  return answer_of(status, status == 404 || status == 405 ? StatusCode::unsupported : StatusCode::refused, text);
}

HttpAnswer wrong_method(const Route& route) {
  HttpAnswer answer = refused(405, "method not allowed; use " + std::string(route.method));
  answer.allow = route.method == "GET" ? "GET, HEAD" : std::string(route.method);
  return answer;
}

/// Parses the body. A name in the path replaces the name in the message.
RoutedRequest operation_of(const Route& route, const std::string& body) {
  const bool pose = route.op == "pose" || route.op == "object";
  auto request = control::request_from_json(route.op, body, route.name);
  if (!request) return {refused(400, request.error().text), pose ? request.error().text : ""};
  return std::visit(
      [&](auto op) -> RoutedRequest {
        if constexpr (std::is_constructible_v<control::Operation, decltype(op)>)
          return {OperationAction{std::move(op)}};
        else
          return {refused(404, "not found")};
      },
      std::move(request->op));
}

/// Returns the refusal of a Host header; nullopt if it is accepted.
std::optional<HttpAnswer> reject_host(const HttpRequest& request, const HttpPolicy& policy) {
  // HTTP/1.0 has no Host header (RFC 9112, 3.2). Browsers always send one, so this does not weaken the check.
  if (!request.has_host && !request.http_1_0) return refused(400, "the Host header is missing");
  if (request.has_host && !host_allowed(request.host, policy.reached, policy.hosts))
    return refused(403, "unknown Host: use this computer's address, or add the name to control.hosts");
  return std::nullopt;
}
std::optional<HttpAnswer> reject_origin(const HttpRequest& request, const HttpPolicy& policy) {
  if (request.has_origin && !origin_allowed(request.origin, policy.reached, policy.hosts))
    return refused(403, "cross-origin requests are not allowed (Origin); add the site to control.hosts to allow them");
  return std::nullopt;
}

}  // namespace

HttpAnswer answer_of(unsigned status, StatusCode code, const std::string& text) {
  HttpAnswer answer{status, control::json_of(code, text) + "\n"};
  if (status == 401 || status == 403) answer.why = text;
  return answer;
}

bool wants_socket(const HttpRequest& request) { return request.method == "GET" && header_names(request.upgrade, "websocket"); }

/// Applies the rules in this order, which matters for security: host, WebSocket, origin, page, token, route, method, body.
RoutedRequest route_request(const HttpRequest& request, const HttpPolicy& policy) {
  if (auto answer = reject_host(request, policy)) return {*std::move(answer)};
  const auto target = parse_target(request.target);
  if (target && target->segments.empty() && wants_socket(request)) return {SocketAction{target->query}};
  if (auto answer = reject_origin(request, policy)) return {*std::move(answer)};
  if (!target) return {refused(400, "the target is not a path")};
  if (request.method == "GET" || request.method == "HEAD") {
    const std::string path = request.target.substr(0, request.target.find('?'));
    if (auto page = page_answer({path, request.accept, request.accept_encoding, request.if_none_match}))
      return {*std::move(page)};
  }
  const Route route = route_of(*target, request.method);
  // The token is checked before the path, so that clients without it do not learn which paths exist. Without a token, health is
  // reported without a reason.
  const bool authorised = policy.token.matches(bearer_token(request.authorization));
  if (!authorised && route.kind != Kind::health)
    return {refused(401, "token required: send Authorization: Bearer TOKEN, with the token of control.token_file")};
  if (route.kind == Kind::unknown) return {refused(404, "not found; GET / lists the requests")};
  const bool get = request.method == "GET" || request.method == "HEAD";
  if (route.method == "GET" ? !get : request.method != route.method) return {wrong_method(route)};
  switch (route.kind) {
    case Kind::help:
      return {HelpAction{}};
    case Kind::health:
      return {HealthAction{authorised}};
    case Kind::metrics:
      return {MetricsAction{}};
    case Kind::ticket:
      return {TicketAction{}};
    case Kind::status:
      return {OperationAction{control::GetStatus{}}};
    case Kind::faults: {
      control::GetFaults wanted;
      wanted.kinds = route.op == "kinds";
      for (const auto& [key, value] : target->query)
        if (key == "after") wanted.journal_after = text::parse_unsigned(value).value_or(0);
      return {OperationAction{wanted}};
    }
    case Kind::end_fault:
      return {OperationAction{control::EndFaults{route.name}}};
    case Kind::events: {
      auto wanted = subscription_of(*target);
      if (!wanted) return {refused(400, wanted.error().text)};
      return {*wanted};
    }
    default:
      if (!is_json(request.content_type)) return {refused(415, "send Content-Type: application/json")};
      return operation_of(route, request.body);
  }
}

std::string help_text(const std::string& address) {
  const std::string url = "http://" + address;
  const std::string post = "  curl -s " + url + "/api/v1/";
  const std::string json = " -H 'Content-Type: application/json' -d ";
  return "sonard, control over HTTP (docs/control.md). With control.token_file add: -H \"Authorization: Bearer $(cat FILE)\"\n\n"
         "  curl -s " +
         url +
         "/healthz\n"
         "  curl -s " +
         url +
         "/metrics\n"
         "  curl -s " +
         url +
         "/api/v1/status\n"
         "  curl -sN '" +
         url + "/api/v1/events?pings=1&clients=1&poses=1&scene=1&faults=1'\n" + post + "sonars/NAME" + json +
         "'{\"range_m\":5,\"gain_percent\":60}'\n" + post + "environment" + json + "'{\"environment\":{\"temperature_c\":4}}'\n" +
         post + "pose" + json + "'{\"frame\":\"NED_FRD\",\"position\":{\"x\":0,\"y\":0,\"z\":3},\"orientation\":{\"w\":1}}'\n" +
         post + "objects/NAME" + json + "'{\"visible\":false}'\n" + post + "load" + json +
         "'{\"path\":\"demo.yaml\"}'\n\n"
         "POST to /api/v1/ also: sonar, object, add_object, remove_object, set_object, set_trajectory, step, start_recording,\n"
         "stop_recording. Faults, with sonard --faults: GET and POST faults, GET faults/kinds and faults/journal, POST\n"
         "faults/reset, DELETE faults/NAME.\n";
}

}  // namespace sonar
