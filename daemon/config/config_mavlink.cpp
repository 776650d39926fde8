// Reads the MAVLink links and the origin from the configuration: poses.mavlink and world.origin (docs/poses.md).
#include <algorithm>

#include "core/text/decimal.hpp"
#include "daemon/config/config_parts.hpp"

namespace sonar {
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
