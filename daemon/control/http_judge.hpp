// From a request to what is wanted of the daemon, or to the answer that says why not: the rules of http_rules.hpp in order. Pure;
// what is wanted is carried out by HttpConnection.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "daemon/control/http_reader.hpp"
#include "daemon/control/http_rules.hpp"
#include "daemon/control/token.hpp"
#include "protocol/control/control.hpp"

namespace sonar {

struct HttpAnswer {
  unsigned status = 200;
  std::string body;
  std::string type = "application/json";
  std::string allow = {};  // of 405
  std::string why = {};    // for the log, of 401 and 403
};
/// {"code", "text"}; every answer that is no document is one.
HttpAnswer answer_of(unsigned status, control::StatusCode code, const std::string& text);

struct HttpPolicy {
  const Token& token;
  Ipv4 reached;  // our end of the connection
  const std::vector<std::string>& hosts;
};

struct WantsHelp {};
struct WantsHealth {
  bool with_text = false;  // why it is not well, to those who may know
};
struct WantsMetrics {};
struct WantsOperation {
  control::Operation operation;
};
/// What an HTTP request comes down to. A Subscribe = a stream of events.
using Wanted = std::variant<HttpAnswer, WantsHelp, WantsHealth, WantsMetrics, WantsOperation, control::Subscribe>;

struct Judgement {
  Wanted wanted;
  std::string pose_refusal = {};  // it should have been a pose: such refusals are counted
};
Judgement judge(const HttpRequest& request, const HttpPolicy& policy);

/// The text of GET /, for whoever reached the port with a browser or curl.
std::string help_text(const std::string& address);

}  // namespace sonar
