#include "daemon/server/http/http_router.hpp"

#include <algorithm>
#include <array>

#include "core/base/letters.hpp"
#include "core/text/decimal.hpp"
#include "daemon/server/http/page.hpp"

namespace sonar {
namespace {

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char l = small_letter(c);
  return l >= 'a' && l <= 'f' ? l - 'a' + 10 : -1;
}

/// Decodes %xx. Refuses control characters, plain or encoded, so that they get into no log or answer.
std::optional<std::string> decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hex_value(text[i + 1]), low = hex_value(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(16 * high + low);
      i += 2;
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return std::nullopt;
    out += c;
  }
  return out;
}

/// Removes the text up to `stop`, and `stop` itself. Returns the text before `stop`.
std::string_view cut(std::string_view& rest, char stop) {
  const std::size_t end = std::min(rest.find(stop), rest.size());
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return part;
}

bool good_port(std::string_view port) {
  return !port.empty() && port.size() <= 5 && std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::optional<Target> parse_target(std::string_view text) {
  if (text.empty() || text.front() != '/') return std::nullopt;
  Target target;
  std::string_view query = text.substr(1);
  std::string_view path = cut(query, '?');
  while (!path.empty()) {
    const auto segment = decoded(cut(path, '/'));
    if (!segment) return std::nullopt;
    target.segments.push_back(*segment);
  }
  while (!query.empty()) {
    std::string_view value = cut(query, '&');
    const auto key = decoded(cut(value, '='));
    const auto value_text = decoded(value);
    if (!key || !value_text) return std::nullopt;
    target.query.emplace_back(*key, *value_text);
  }
  return target;
}

/// Compares the host with the allowed names. With DNS rebinding, a page of another site connects to this server with the name of
/// its site, which is not allowed.
bool host_allowed(std::string_view host, Ipv4 reached, const std::vector<std::string>& names) {
  std::string_view port = host;
  const std::string_view name = cut(port, ':');
  if (host.find(':') != std::string_view::npos && !good_port(port)) return false;
  if (const auto ip = parse_ipv4(name)) {
    if (*ip == reached || is_loopback(*ip)) return true;
  } else if (same_letters(name, "localhost")) {
    return true;
  }
  return !name.empty() && std::any_of(names.begin(), names.end(), [&](const std::string& n) { return same_letters(n, name); });
}

bool origin_allowed(std::string_view origin, Ipv4 reached, const std::vector<std::string>& names) {
  for (const std::string_view scheme : {"http://", "https://"})
    if (origin.size() > scheme.size() && same_letters(origin.substr(0, scheme.size()), scheme))
      return host_allowed(origin.substr(scheme.size()), reached, names);
  return false;  // the origin is "null" or has another scheme
}

bool begins_http_request(std::string_view bytes) {
  constexpr std::array<std::string_view, 9> methods{"GET ",     "HEAD ",    "POST ",  "PUT ",  "DELETE ",
                                                    "CONNECT ", "OPTIONS ", "TRACE ", "PATCH "};
  return std::any_of(methods.begin(), methods.end(), [bytes](std::string_view method) { return bytes.starts_with(method); });
}

/// Collects the first bytes, because a request may arrive in pieces.
bool HttpDetector::speaks_http(std::span<const std::byte> received) {
  for (std::size_t i = 0; i < received.size() && first_bytes_.size() < longest_http_method; ++i)
    first_bytes_ += static_cast<char>(received[i]);
  return begins_http_request(first_bytes_);
}

std::vector<std::string> words_of_header(std::string_view list) {
  std::vector<std::string> words;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    std::string_view word = list.substr(0, end);
    list.remove_prefix(std::min(end + 1, list.size()));
    const auto first = word.find_first_not_of(" \t");
    if (first == std::string_view::npos) continue;
    word = word.substr(first, word.find_last_not_of(" \t") - first + 1);
    words.emplace_back(word);
  }
  return words;
}

bool header_names(std::string_view list, std::string_view wanted) {
  const std::vector<std::string> words = words_of_header(list);
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) { return same_letters(word, wanted); });
}

bool is_json(std::string_view content_type) {
  std::string_view type = cut(content_type, ';');
  while (!type.empty() && (type.back() == ' ' || type.back() == '\t')) type.remove_suffix(1);
  return same_letters(type, "application/json");
}

namespace {

/// Returns the route for a path below /api/v1/faults; these paths are like those of Toxiproxy.
Route fault_route(const std::vector<std::string>& s, std::string_view method) {
  if (s.size() == 3)
    return method == "POST" ? Route{Route::Kind::operation, "POST", "add_fault"} : Route{Route::Kind::faults, "GET", "faults"};
  if (s.size() != 4) return {};
  if (s[3] == "kinds" || s[3] == "journal") return {Route::Kind::faults, "GET", s[3]};
  if (s[3] == "reset") return {Route::Kind::operation, "POST", "end_faults"};
  return {Route::Kind::end_fault, "DELETE", "end_faults", s[3]};
}

}  // namespace

Route route_of(const Target& target, std::string_view method) {
  const auto& s = target.segments;
  if (s.empty()) return {Route::Kind::help, "GET", ""};
  if (s.size() == 1 && s[0] == "healthz") return {Route::Kind::health, "GET", ""};
  if (s.size() == 1 && s[0] == "metrics") return {Route::Kind::metrics, "GET", ""};
  if (s.size() < 3 || s[0] != "api" || s[1] != "v1") return {};
  if (s[2] == "faults") return fault_route(s, method);
  if (s.size() == 4 && s[2] == "sonars" && !s[3].empty()) return {Route::Kind::operation, "POST", "sonar", s[3]};
  if (s.size() == 4 && s[2] == "objects" && !s[3].empty()) return {Route::Kind::operation, "POST", "set_object", s[3]};
  if (s.size() != 3) return {};
  if (s[2] == "status") return {Route::Kind::status, "GET", "status"};
  if (s[2] == "view_ticket") return {Route::Kind::ticket, "POST", ""};
  if (s[2] == "events") return {Route::Kind::events, "GET", ""};
  constexpr std::array<std::string_view, 12> operations = {
      "sonar",         "environment", "load",           "pose", "object",          "add_object",
      "remove_object", "set_object",  "set_trajectory", "step", "start_recording", "stop_recording"};
  if (std::find(operations.begin(), operations.end(), s[2]) != operations.end()) return {Route::Kind::operation, "POST", s[2]};
  return {};
}

Result<control::Subscribe> subscription_of(const Target& target) {
  control::Subscribe wanted;
  if (target.query.empty()) return control::Subscribe{true, true, true, true, true};
  for (const auto& [key, value] : target.query) {
    bool* kind = key == "pings"     ? &wanted.pings
                 : key == "clients" ? &wanted.clients
                 : key == "poses"   ? &wanted.poses
                 : key == "scene"   ? &wanted.scene
                 : key == "faults"  ? &wanted.faults
                                    : nullptr;
    if (kind == nullptr)
      return failure(ErrorKind::bad_data,
                     '"' + key.substr(0, 64) + "\": unknown; events are pings, clients, poses, scene, faults");
    if (value != "1" && value != "0" && value != "true" && value != "false")
      return failure(ErrorKind::bad_data, key + " must be 1 or 0");
    *kind = value == "1" || value == "true";
  }
  if (!wanted.pings && !wanted.clients && !wanted.poses && !wanted.scene && !wanted.faults)
    return failure(ErrorKind::bad_data, "no events requested: pings=1, clients=1, poses=1, scene=1, faults=1");
  return wanted;
}

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
