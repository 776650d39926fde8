// What the HTTP server takes from a request and what it lets through: targets, hosts, origins, tokens, routes. Pure text in,
// answer out; no sockets. daemon/control/http_judge.hpp puts the rules in order.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/config/config.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

/// "/api/v1/sonars/front%20left?pings=1", taken apart and decoded.
struct Target {
  std::vector<std::string> segments;
  std::vector<std::pair<std::string, std::string>> query;
};
/// Nothing when it is no such thing: a full URL, a broken %xx, control characters.
std::optional<Target> parse_target(std::string_view text);

/// Who may be meant by "Host: name:port" when we were reached at `reached`: that address, loopback, localhost, and the names of
/// control.hosts. Against pages whose name is made to point here (DNS rebinding).
bool host_allowed(std::string_view host, Ipv4 reached, const std::vector<std::string>& names);
/// The same of "Origin: http://name:port": pages of other sites have no business here.
bool origin_allowed(std::string_view origin, Ipv4 reached, const std::vector<std::string>& names);

/// Of "Authorization: Bearer abc"; empty when it is not that.
std::string_view bearer_token(std::string_view authorization);
/// "application/json", whatever parameters follow.
bool is_json(std::string_view content_type);

/// Whether these are the first bytes of an HTTP request: for ports that speak something else. The first longest_http_method of
/// them are enough to tell.
bool begins_http_request(std::string_view bytes);
inline constexpr std::size_t longest_http_method = 8;  // "OPTIONS "

struct Route {
  enum class Kind { unknown, help, health, metrics, status, events, operation };
  Kind kind = Kind::unknown;
  std::string_view method;  // the one it takes
  std::string op;           // of an operation: the member of Request.op
  std::string name = {};    // of the sonar or object, when the path says it
};
Route route_of(const Target& target);

/// ?pings=1&clients=0...; nothing asked for = everything. The refusal is a sentence.
Result<control::Subscribe> subscription_of(const Target& target);

}  // namespace sonar
