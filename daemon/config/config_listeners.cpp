// Reads the control listeners from the configuration, and the rules for their clients.

#include <algorithm>

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

// Reads the MAVLink links and the origin from the configuration: poses.mavlink and world.origin (docs/poses.md).

namespace {

using text::Map;
using text::Node;
using text::Range;

/// Reads an endpoint such as "udpin:127.0.0.1:14551".
void read_link(const Node& node, bool has_ranges, MavlinkConfig& link) {
  const std::string given = node.text(64);
  const std::size_t first = given.find(':'), last = given.rfind(':');
  const std::string direction = given.substr(0, first);
  const bool whole = (direction == "udpin" || direction == "udpout") && first != last;
  const auto ip = parse_ipv4(whole ? std::string_view(given).substr(first + 1, last - first - 1) : std::string_view());
  const std::int64_t port = whole ? text::parse_integer(std::string_view(given).substr(last + 1)).value_or(-1) : -1;
  link.dials = direction == "udpout";
  if (!ip || port < (link.dials ? 1 : 0) || port > 65535)
    return node.fail("is not a MAVLink endpoint; write udpin:127.0.0.1:14551 to listen, or udpout:127.0.0.1:14551 to dial");
  link.at = {*ip, static_cast<std::uint16_t>(port)};
  if (const std::string why = why_not_of_a_computer(link.at.ip); !link.dials && !why.empty()) return node.fail(why);
  if (!link.dials && !is_loopback(link.at.ip) && !has_ranges)
    node.fail("poses from other computers need poses.allow_from, e.g. allow_from: [192.168.1.0/24]");
  if (link.dials && link.at.ip == Ipv4{}) node.fail("udpout needs the address of the other end");
}

/// Reads the vehicle to which a link belongs. The name may be left out if there is only one vehicle.
std::string read_vehicle(Map& map, const std::vector<VehicleConfig>& vehicles) {
  if (vehicles.empty()) return {};  // the error is reported already
  const Node node = vehicles.size() > 1 ? map.required("vehicle") : map.optional("vehicle");
  if (!node.present()) return vehicles.front().name;
  std::vector<std::string_view> names;
  for (const VehicleConfig& v : vehicles) names.push_back(v.name);
  return vehicles[std::min(node.choice_index(std::move(names)), vehicles.size() - 1)].name;
}

}  // namespace

std::vector<std::string> range_finders_of(const Config& config, const std::string& vehicle) {
  std::vector<std::string> names;
  for (const SonarConfig& sonar : config.sonars)
    if (sonar.profile.vendor != nullptr && sonar.profile.vendor->measures_distance() && sonar.vehicle < config.vehicles.size() &&
        config.vehicles[sonar.vehicle].name == vehicle)
      names.push_back(sonar.name);
  return names;
}

std::optional<Geodetic> read_origin(const Node& node) {
  if (!node.present()) return std::nullopt;
  Map place = node.map();
  const double latitude_deg = place.required("lat").number(Range::between(-90, 90));
  const double longitude_deg = place.required("lon").number(Range::between(-180, 180));
  return Geodetic{rad_from_deg(latitude_deg), rad_from_deg(longitude_deg),
                  place.optional("alt").number_or(0, Range::between(-12000, 10000))};
}

/// Reads `off`, one endpoint as a text, or a list of links.
std::vector<MavlinkConfig> read_mavlink(const Node& node, bool has_ranges, const Config& config) {
  const std::vector<VehicleConfig>& vehicles = config.vehicles;
  std::vector<MavlinkConfig> links;
  if (!node.present()) return links;
  if (node.is_scalar()) {
    if (node.text(64) == "off") return links;
    MavlinkConfig link;
    read_link(node, has_ranges, link);
    if (vehicles.size() > 1)
      node.fail("there are several vehicles; write [{endpoint: " + node.text(64) + ", vehicle: " + vehicles.front().name + "}]");
    if (!vehicles.empty()) link.vehicle = vehicles.front().name;
    return {link};
  }
  for (const Node& item : node.items(0, 16)) {
    Map map = item.map();
    MavlinkConfig link;
    const Node endpoint = map.required("endpoint");
    read_link(endpoint, has_ranges, link);
    link.vehicle = read_vehicle(map, vehicles);
    link.system_id = static_cast<std::uint8_t>(map.optional("system_id").integer_or(0, 0, 255));
    link.component_id = static_cast<std::uint8_t>(map.optional("component_id").integer_or(0, 0, 255));
    link.request_rates = map.optional("request_rates").boolean_or(false);
    link.rate_hz = map.optional("rate_hz").number_or(link.rate_hz, Range::between(1, 200));
    const Node distances = map.optional("distance_sensor");
    link.distance_sensor = distances.boolean_or(false);
    if (link.distance_sensor && range_finders_of(config, link.vehicle).empty() && !config.sonars.empty())
      distances.fail("vehicle \"" + link.vehicle + "\" has no range finder; mount an altimeter on it, or set this to false");
    const bool taken = std::any_of(links.begin(), links.end(), [&](const MavlinkConfig& other) {
      return other.at.port != 0 && other.at.port == link.at.port && other.at.ip == link.at.ip;
    });
    if (taken) endpoint.fail("another link already uses this endpoint; give each link its own endpoint");
    links.push_back(std::move(link));
  }
  return links;
}

}  // namespace sonar
