// Applies the rules of http_rules.hpp in order, to map a request to an action, which ControlHttp executes, or to the answer that
// rejects the request.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "daemon/server/connections/http_reader.hpp"
#include "daemon/server/connections/token.hpp"
#include "daemon/server/http/http_rules.hpp"
#include "protocol/control/control.hpp"

namespace sonar {

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
