// Derives addresses from a sonar's address, and moves one sonar or all listeners to other addresses.
#include "daemon/config/sonar_addresses.hpp"

#include <algorithm>

#include "daemon/config/config.hpp"

namespace sonar {

void derive_addresses(SonarConfig& sonar) {
  if (!sonar.has_own_netmask) sonar.netmask = is_loopback(sonar.advertise_ip) ? Ipv4{255, 0, 0, 0} : Ipv4{255, 255, 255, 0};
  // Unless destinations are configured, a sonar sends status messages to the broadcast address of its network.
  if (sonar.has_own_status_to) return;
  Endpoint broadcast;
  for (std::size_t i = 0; i < 4; ++i)
    broadcast.ip[i] = static_cast<std::uint8_t>(sonar.advertise_ip[i] | (~sonar.netmask[i] & 0xff));
  sonar.status_to = {broadcast};
}

Result<void> rebind(Config& config, std::string_view address) {
  const auto ip = parse_ipv4(address);
  if (!ip) return failure(ErrorKind::usage, ip.error().text);
  if (*ip == Ipv4{})
    return failure(
        ErrorKind::usage,
        "0.0.0.0 is not an address that drivers can connect to; give one of this computer's, or write bind_ip: 0.0.0.0 and "
        "advertise_ip in a configuration file");
  if (const std::string why = why_not_of_a_computer(*ip); !why.empty()) return failure(ErrorKind::usage, why);
  SonarConfig& first = config.sonars.front();
  for (const SonarConfig& other : config.sonars)
    if (&other != &first && (other.bind_ip == *ip || other.bind_ip == Ipv4{}))
      return failure(ErrorKind::usage,
                     text_of(*ip) + " is already used by sonar \"" + other.name + "\"; each sonar needs its own address");
  first.bind_ip = first.advertise_ip = *ip;
  derive_addresses(first);
  return {};
}

namespace {

tl::unexpected<Error> cannot_move(const std::string& what) { return failure(ErrorKind::usage, what); }

Result<void> move_sonar(SonarConfig& sonar, int offset) {
  for (Ipv4* const ip : {&sonar.bind_ip, &sonar.advertise_ip}) {
    if (!is_loopback(*ip))
      return cannot_move("only sonars on 127.x.x.x can be moved, and sonar \"" + sonar.name + "\" has " + text_of(*ip) +
                         ": give it another address in the configuration");
    if ((*ip)[2] + offset > 255)
      return cannot_move("the third number of " + text_of(*ip) + " would exceed 255; give a smaller offset");
    (*ip)[2] = static_cast<std::uint8_t>((*ip)[2] + offset);
  }
  derive_addresses(sonar);
  return {};
}

Result<void> move_port(Endpoint& at, int offset) {
  if (at.port == 0) return {};
  const int port = at.port + ports_per_offset * offset;
  if (port > 65535) return cannot_move("the port of " + text_of(at) + " would exceed 65535; give a smaller offset");
  at.port = static_cast<std::uint16_t>(port);
  return {};
}

struct Listening {
  std::string key;
  Endpoint at;
  bool udp, tcp;
  bool gives_way = false;  // true: the address is a default, which is not used if the port is in use
  bool is_shared = false;  // true: other shared listeners may use the same port
};
/// True if two listeners need the same port and cannot share it. 0.0.0.0 uses the port at all addresses.
bool conflict(const Listening& a, const Listening& b) {
  const bool same_ip = a.at.ip == b.at.ip || a.at.ip == Ipv4{} || b.at.ip == Ipv4{};
  const bool same_kind = (a.udp && b.udp && !(a.is_shared && b.is_shared)) || (a.tcp && b.tcp);
  return same_ip && a.at.port == b.at.port && same_kind;
}
std::vector<Listening> listening_of(const Config& c) {
  std::vector<Listening> all;
  const auto add = [&](const std::string& key, bool enabled, const Endpoint& at, bool udp, bool tcp, bool gives_way = false) {
    if (enabled && at.port != 0) all.push_back({key, at, udp, tcp, gives_way});
  };
  add("poses.protobuf", c.poses.protobuf.enabled, c.poses.protobuf.at, true, false);
  add("poses.json", c.poses.json.enabled, c.poses.json.at, true, true);
  add("control.stream", c.control.stream.enabled, c.control.stream.at, false, true, !c.control.stream_given);
  add("control.http", c.control.http.enabled, c.control.http.at, false, true, !c.control.http_given);
  for (const MavlinkConfig& link : c.poses.mavlink) add("poses.mavlink", !link.dials, link.at, true, false);
  return all;
}

/// Adds the ports of a sonar. Sonars share the UDP ports of discovery (udp_answer).
void add_ports(std::vector<Listening>& all, const SonarConfig& sonar) {
  using Kind = protocol::Port::Kind;
  for (const protocol::Port& port : sonar.profile.vendor->ports()) {
    const bool shared = port.kind == Kind::udp_answer, udp = shared || port.kind == Kind::udp_dialogue;
    const bool tcp = port.kind == Kind::tcp_stream || port.kind == Kind::http;
    if (tcp || udp) all.push_back({"sonar \"" + sonar.name + "\"", {sonar.bind_ip, port.number}, udp, tcp, false, shared});
  }
  if (sonar.max_observers > 0 && sonar.observer_port != 0)
    all.push_back({"observers.port of sonar \"" + sonar.name + "\"", {sonar.bind_ip, sonar.observer_port}, false, true});
}

/// Checks that no moved address, port or device id is that of another sonar or listener of the unmoved configuration.
Result<void> check_apart(const Config& moved, const Config& unmoved) {
  const std::string instead = " without an offset; give another offset";
  for (const SonarConfig& a : moved.sonars)
    for (const SonarConfig& b : unmoved.sonars) {
      if (a.name == b.name) continue;
      if (a.device_id == b.device_id)
        return cannot_move("sonar \"" + a.name + "\" would have device_id " + std::to_string(a.device_id) + ", which sonar \"" +
                           b.name + "\" has" + instead);
      if (a.bind_ip == b.bind_ip)
        return cannot_move("sonar \"" + a.name + "\" would have " + text_of(a.bind_ip) + ", which sonar \"" + b.name + "\" has" +
                           instead);
    }
  for (const Listening& a : listening_of(moved))
    for (const Listening& b : listening_of(unmoved))
      if (conflict(a, b)) return cannot_move(a.key + " would be at " + text_of(a.at) + ", where " + b.key + " is" + instead);
  return {};
}

}  // namespace

Result<void> check_ports_apart(const Config& config) {
  std::vector<Listening> all;
  for (const SonarConfig& sonar : config.sonars) add_ports(all, sonar);
  for (Listening& listening : listening_of(config)) all.push_back(std::move(listening));
  for (auto b = all.begin(); b != all.end(); ++b)
    for (auto a = all.begin(); a != b; ++a)
      if (conflict(*a, *b) && !a->gives_way && !b->gives_way)
        return failure(ErrorKind::config, config.source + ": " + a->key + " and " + b->key + " would both listen at " +
                                              text_of(b->at) + "; give each its own address or port");
  return {};
}

Result<void> move_addresses(Config& config, int offset, bool first_too) {
  const Config unmoved = config;
  for (SonarConfig& sonar : config.sonars) {
    // The device id changes too, because drivers distinguish sonars by the id.
    const int id = sonar.device_id + 100 * offset;
    if (id > 65535)
      return cannot_move("device_id " + std::to_string(sonar.device_id) + " would exceed 65535; give a smaller offset");
    sonar.device_id = static_cast<std::uint16_t>(id);
    if (&sonar == &config.sonars.front() && !first_too) continue;
    if (auto r = move_sonar(sonar, offset); !r) return r;
  }
  for (PoseListener* const listener : {&config.poses.protobuf, &config.poses.json, &config.control.stream, &config.control.http})
    if (auto r = move_port(listener->at, offset); !r) return r;
  for (MavlinkConfig& link : config.poses.mavlink)
    if (!link.dials)
      if (auto r = move_port(link.at, offset); !r) return r;
  return check_apart(config, unmoved);
}

namespace {

bool is_multicast(const Ipv4& ip) { return ip[0] >> 4 == 0xE; }

bool is_broadcast(const Ipv4& ip, const SonarConfig& sonar) {
  constexpr unsigned first_reserved = 240;  // from here on, addresses do not belong to single computers
  if (ip[0] >= first_reserved || ip == Ipv4{127, 255, 255, 255}) return true;
  bool broadcast = sonar.netmask != Ipv4{255, 255, 255, 255};
  for (std::size_t i = 0; i < ip.size(); ++i)
    broadcast = broadcast && ip[i] == static_cast<std::uint8_t>(sonar.bind_ip[i] | static_cast<std::uint8_t>(~sonar.netmask[i]));
  return broadcast;
}

}  // namespace

bool may_receive(const Ipv4& ip, const protocol::Port& port, const SonarConfig& sonar) {
  const bool multicast = is_multicast(ip);
  if (!multicast && !is_broadcast(ip, sonar)) return true;
  if (ip == port.group.ip || (multicast && port.any_group)) return true;
  return std::find(sonar.groups.begin(), sonar.groups.end(), ip) != sonar.groups.end();
}

}  // namespace sonar
