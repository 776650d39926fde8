// Applies the rules of this file in order, to map a request to an action, which ControlHttp executes, or to the answer that
// rejects the request.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/server/connections/http_reader.hpp"
#include "daemon/server/connections/token.hpp"
#include "protocol/control/control.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

// The rules of the HTTP server about targets, hosts, origins, tokens and routes.

/// A target such as "/api/v1/sonars/front%20left?pings=1", split and decoded.
struct Target {
  std::vector<std::string> segments;
  std::vector<std::pair<std::string, std::string>> query;
};
/// Parses a target. Returns nullopt for a full URL, an invalid %xx, or control characters.
std::optional<Target> parse_target(std::string_view text);

/// Checks "Host: name:port" against DNS rebinding. Allowed names are the local address `reached` of the connection, loopback,
/// localhost, and the names in control.hosts.
bool host_allowed(std::string_view host, Ipv4 reached, const std::vector<std::string>& names);
/// Checks "Origin: http://name:port" in the same way, to reject cross-origin requests of browsers.
bool origin_allowed(std::string_view origin, Ipv4 reached, const std::vector<std::string>& names);

/// Splits the list in a header into words.
std::vector<std::string> words_of_header(std::string_view list);
/// True if a list header contains the word, ignoring case. `wanted` must be in small letters.
bool header_names(std::string_view list, std::string_view wanted);

/// True if the type is "application/json", with or without parameters.
bool is_json(std::string_view content_type);

/// True if a stream begins with an HTTP request. `bytes` must have the first longest_http_method bytes.
bool begins_http_request(std::string_view bytes);
inline constexpr std::size_t longest_http_method = 8;  // "OPTIONS "

/// Detects HTTP requests on ports of other protocols; any web page can make a browser send such requests.
class HttpDetector {
 public:
  /// Reads the next bytes. True if the stream begins with an HTTP request.
  bool speaks_http(std::span<const std::byte> received);

 private:
  std::string first_bytes_;
};

struct Route {
  enum class Kind { unknown, help, health, metrics, status, events, operation, faults, end_fault, ticket };
  Kind kind = Kind::unknown;
  std::string_view method;  // the allowed method
  std::string op;           // member of Request.op; for faults "faults", "kinds" or "journal"
  std::string name = {};    // name of the sonar, object or fault in the path
};
Route route_of(const Target& target, std::string_view method);

/// Parses ?pings=1&clients=0...; an empty query selects all kinds. The error is a sentence.
Result<control::Subscribe> subscription_of(const Target& target);

/// Makes an answer with the body {"code", "text"}, like every answer without a document.
HttpAnswer answer_of(unsigned status, control::StatusCode code, const std::string& text);

/// True for GET with "Upgrade: websocket".
bool wants_socket(const HttpRequest& request);

struct HttpPolicy {
  const Token& token;
  Ipv4 reached;  // local address of the connection
  const std::vector<std::string>& hosts;
};

struct HelpAction {};
struct HealthAction {
  bool with_text = false;  // true: the answer includes the reason, for authorized clients
};
struct MetricsAction {};
struct OperationAction {
  control::Operation operation;
};
/// A WebSocket of the live view: daemon/server/http/door.hpp decides, with its own rules for Origin and secrets.
struct SocketAction {
  std::vector<std::pair<std::string, std::string>> query;
};
struct TicketAction {};
/// The action of an HTTP request. Subscribe: a stream of events.
using HttpAction = std::variant<HttpAnswer, HelpAction, HealthAction, MetricsAction, OperationAction, control::Subscribe,
                                SocketAction, TicketAction>;

struct RoutedRequest {
  HttpAction action;
  std::string pose_refusal = {};  // reason why a malformed pose was refused; the server counts it
};
RoutedRequest route_request(const HttpRequest& request, const HttpPolicy& policy);

/// Returns the answer to GET / for clients that do not request the page.
std::string help_text(const std::string& address);

}  // namespace sonar
