// Reads the control listeners from the configuration, and the rules for their clients.
#include "core/text/decimal.hpp"
#include "daemon/config/config_parts.hpp"

namespace sonar {

using text::Map;
using text::Node;

Endpoint read_endpoint(const Node& node, bool is_listener) {
  const std::string text = node.text(64);
  const std::size_t colon = text.find(':');
  Endpoint endpoint;
  const auto ip = parse_ipv4(std::string_view(text).substr(0, colon));
  const auto port = colon == std::string::npos ? std::optional<std::int64_t>(0) : text::parse_integer(text.substr(colon + 1));
  const std::string why = is_listener && ip ? why_not_of_a_computer(*ip) : "";
  if (!why.empty())
    node.fail(why);
  else if (!ip || (is_listener && colon == std::string::npos))
    node.fail("is not an address; write it as " +
              std::string(is_listener ? "127.0.0.1:14770" : "127.255.255.255 or 192.168.1.7:52102"));
  else if (!port || *port < 0 || *port > 65535)
    node.fail("port must be a number from 0 to 65535");
  else
    endpoint = {*ip, static_cast<std::uint16_t>(*port)};
  return endpoint;
}

namespace {

/// `given` is set if the file names the address, which must then be free. A default address in use is only a warning.
void read_control_listener(const Node& node, bool has_token, PoseListener& listener, bool& given) {
  if (!node.present()) return;
  given = true;
  if (node.text(64) == "off") {
    listener = {false, {}};
    return;
  }
  listener = {true, read_endpoint(node, true)};
  if (!is_loopback(listener.at.ip) && !has_token)
    node.fail("can be reached from other computers: that needs control.token_file, the file of a secret that clients must show");
}

/// Reads an origin: a text, or a map with `origin` and `steer`.
ViewOrigin read_view_origin(const Node& node) {
  ViewOrigin allowed;
  Node origin = node;
  if (node.is_map()) {
    Map map = node.map();
    origin = map.required("origin");
    allowed.steer = map.optional("steer").boolean_or(false);
  }
  allowed.origin = origin.text(256);
  const std::size_t scheme = allowed.origin.find("://");
  const bool is_web = allowed.origin.starts_with("http://") || allowed.origin.starts_with("https://");
  if (!is_web || allowed.origin.find('/', scheme + 3) != std::string::npos || allowed.origin.size() == scheme + 3)
    origin.fail("is not an origin; write it as browsers do: https://example.com or http://192.168.1.7:8080");
  return allowed;
}

}  // namespace

/// Reads token_file first, because listeners that are not on loopback require it.
ControlConfig read_control(const Node& node, const std::filesystem::path& directory) {
  ControlConfig control;
  if (!node.present()) return control;
  Map map = node.map();
  if (const Node file = map.optional("token_file")) control.token_file = directory / file.text();
  control.hosts = map.optional("hosts").texts(0, 64);
  for (const Node& origin : map.optional("view_origins").items(0, 64)) control.view_origins.push_back(read_view_origin(origin));
  const bool has_token = !control.token_file.empty();
  read_control_listener(map.optional("stream"), has_token, control.stream, control.stream_given);
  read_control_listener(map.optional("http"), has_token, control.http, control.http_given);
  const bool same = control.stream.enabled && control.http.enabled && control.http.at.port != 0 &&
                    control.stream.at.ip == control.http.at.ip && control.stream.at.port == control.http.at.port;
  if (same) map.optional("http").fail("the same address as control.stream; give each its own port");
  return control;
}

}  // namespace sonar
