#include "daemon/server/poses/mavlink_server.hpp"

#include <algorithm>

#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

constexpr auto tick_period = std::chrono::milliseconds(250);
constexpr std::size_t work_of_datagram = 64, work_of_byte = 4;

/// Returns real time, in which heartbeats and silence are measured even if the daemon's time is stepped.
Time wire_time() { return Time(std::chrono::steady_clock::now().time_since_epoch()); }

mavlink::Settings settings_of(const MavlinkConfig& link, const Config& config) {
  Vec3d held_m;
  for (const VehicleConfig& v : config.vehicles)
    if (v.name == link.vehicle) held_m = v.initial_pose.position_m;
  return {link.vehicle,
          link.system_id,
          link.component_id,
          link.request_rates,
          link.rate_hz,
          config.origin,
          config.clock == ClockMode::follow,
          link.distance_sensor,
          held_m};
}
std::string text_of(const MavlinkConfig& link) { return (link.dials ? "udpout:" : "udpin:") + sonar::text_of(link.at); }
std::string text_of(const udp::endpoint& e) { return e.address().to_string() + ":" + std::to_string(e.port()); }

}  // namespace

MavlinkServer::MavlinkServer(asio::io_context& io, const Config& config, PoseIntake& intake, Log& log, Time began)
    : io_(io), config_(config), intake_(intake), log_(log), began_(began) {}

Result<void> MavlinkServer::open() {
  for (const MavlinkConfig& wanted : config_.poses.mavlink) {
    const auto has_range_finder = [this, vehicle = wanted.vehicle] { return !range_finders_of(config_, vehicle).empty(); };
    const auto has_other_poses = [this, vehicle = wanted.vehicle] {
      const std::string_view source = intake_.live_source(vehicle);
      return !source.empty() && !source.starts_with("mavlink ");
    };
    mavlink::MavlinkPoses poses(settings_of(wanted, config_), inject_, has_range_finder, has_other_poses);
    Link& link =
        links_.emplace_back(Link{wanted, std::move(poses), udp::socket(io_), asio::steady_timer(io_), std::nullopt, {}, {}});
    const Endpoint at = wanted.dials ? Endpoint{} : wanted.at;
    if (auto r = bind_udp(link.socket, at, false); !r)
      return failure(r.error().kind, r.error().text + "; poses.mavlink in the configuration can set another address");
    if (wanted.dials)
      link.peer = udp::endpoint(address_of(wanted.at.ip), wanted.at.port);
    else
      link.config.at.port = link.socket.local_endpoint().port();
    link.name = std::string("mavlink ").append(text_of(link.config));
    error_code ec;
    link.socket.non_blocking(true, ec);  // datagrams that do not fit into the buffer are lost
  }
  return {};
}

// Each link has two coroutines that never end before stop(): receive() and tick(). After an exception, which is logged, a
// coroutine starts again.
void MavlinkServer::start() {
  for (Link& l : links_) {
    look_at_wants(l);
    const auto survives = [this, &l](const std::string& fault) {
      if (!stopping_) log_fault(log_, faults_, fault, {"at", l.name});
      return !stopping_;
    };
    keep_running(
        io_.get_executor(), [this, &l] { return receive(l); }, survives);
    keep_running(
        io_.get_executor(), [this, &l] { return tick(l); }, survives);
  }
}

void MavlinkServer::stop() {
  stopping_ = true;
  error_code ec;
  for (Link& l : links_) {
    l.socket.close(ec);
    l.timer.cancel();
  }
}

std::vector<std::string> MavlinkServer::endpoints() const {
  std::vector<std::string> all;
  for (const Link& l : links_) all.push_back(text_of(l.config));
  return all;
}
std::vector<LinkFigures> MavlinkServer::figures() const {
  std::vector<LinkFigures> all;
  for (const Link& l : links_) {
    LinkFigures& figures = all.emplace_back(l.distances);
    figures.endpoint = text_of(l.config);
    figures.vehicle = l.config.vehicle;
  }
  return all;
}
std::vector<Note> MavlinkServer::notes() const {
  std::vector<Note> all;
  for (const Link& l : links_) {
    const Time now = wire_time();
    if (const std::string error = l.poses.health_error(now); !error.empty())
      all.push_back({l.config.vehicle, l.name + ": " + error,
                     "docs/poses.md lists the messages that make a pose, and how to request them"});
    if (const std::string rival = l.poses.rival(now); !rival.empty())
      all.push_back({l.config.vehicle, l.name + ": " + rival, ""});
  }
  return all;
}
Endpoint MavlinkServer::listens_at(std::size_t link) const {
  return link < links_.size() ? std::next(links_.begin(), static_cast<std::ptrdiff_t>(link))->config.at : Endpoint{};
}

/// True for datagrams of the dialled peer or, on a listening link, of addresses that the configuration allows.
bool MavlinkServer::is_allowed(const Link& link, const asio::ip::address& from) const {
  if (link.config.dials) return from == address_of(link.config.at.ip);
  return is_admitted(config_.poses.allow_from, from);
}

asio::awaitable<void> MavlinkServer::receive(Link& link) {
  std::vector<std::byte> buffer(65536);
  asio::steady_timer pause(io_);
  while (!stopping_) {
    error_code ec;
    udp::endpoint from;
    const std::size_t n = co_await link.socket.async_receive_from(asio::buffer(buffer), from, into(ec));
    if (stopping_) co_return;
    if (ec) continue;  // the error is an ICMP answer: the port of the other end is not open yet
    const auto now = std::chrono::steady_clock::now();
    const std::size_t work = work_of_datagram + work_of_byte * n;  // a frame has at least 12 bytes
    const bool taken = link.of_address.takes(from.address().to_string(), work, config_.limits.input_bytes_per_s, now);
    if (taken)
      on_datagram(link, mavlink::BytesView(buffer).first(n), from);
    else
      intake_.refuse("more than limits.input_bytes_per_s was sent", {link.name, link.name});
    const auto wait = link.rate.pause_after(taken, now);
    if (wait.count() == 0) continue;
    pause.expires_after(wait);  // a few milliseconds
    co_await pause.async_wait(into(ec));
  }
}

void MavlinkServer::on_datagram(Link& link, mavlink::BytesView bytes, const udp::endpoint& from) {
  const std::string sender = "mavlink udp " + text_of(from);
  if (!is_allowed(link, from.address())) {
    const char* const why = link.config.dials ? "address is not the one that was dialled" : "address is not in poses.allow_from";
    return intake_.refuse(why, {sender, sender});
  }
  const mavlink::Reaction reaction = link.poses.on_datagram(bytes, wire_time());
  if (reaction.from_vehicle && !link.config.dials) link.peer = from;
  act_on(link, reaction, sender, from);
  look_at_wants(link);  // the datagram may have contained a command
}

// ---- distances

bool MavlinkServer::wants_distances(const std::string& vehicle) const {
  return std::any_of(links_.begin(), links_.end(),
                     [&](const Link& l) { return l.config.vehicle == vehicle && l.poses.wants_distances(); });
}

/// Reports that the vehicle of this link has started or stopped requesting distances, because its range finders then start or
/// stop pinging without clients.
void MavlinkServer::look_at_wants(Link& link) {
  const bool wants = link.poses.wants_distances();
  if (std::exchange(link.distances_wanted, wants) != wants && distances_wanted_) distances_wanted_();
}

/// Sends a distance on every link of the vehicle that requested distances, and counts it there as sent or dropped.
void MavlinkServer::on_distance(const SonarConfig& sonar, const PingQueued& ping) {
  if (sonar.vehicle >= config_.vehicles.size()) return;
  const std::string& vehicle = config_.vehicles[sonar.vehicle].name;
  if (!wants_distances(vehicle)) return;
  const PingRequest& request = ping.ping->request;
  const FrequencyMode& mode = ping.ping->mode();
  mavlink::Measured measured;
  measured.boot_ms = std::chrono::duration_cast<std::chrono::milliseconds>(request.fired_at - began_).count();
  measured.nearest_m = static_cast<double>(mode.min_range_m);
  measured.farthest_m = static_cast<double>(mode.max_range_m);
  measured.horizontal_rad = static_cast<double>(mode.pattern.azimuth_width_rad);
  measured.vertical_rad = static_cast<double>(mode.pattern.elevation_width_rad);
  measured.sensor_in_body = sonar.mount.orientation;
  const std::vector<std::string> all = range_finders_of(config_, vehicle);
  measured.sensor = static_cast<std::uint8_t>(std::find(all.begin(), all.end(), sonar.name) - all.begin());
  for (Link& link : links_) {
    if (link.config.vehicle != vehicle || !link.poses.wants_distances()) continue;
    error_code failed;
    if (ping.distance) {
      measured.range_m = ping.distance->range_m;
      measured.confidence_percent = ping.distance->confidence_percent;
      const auto message = link.poses.distance_message(mavlink::distance_sensor_of(measured));
      if (!message) continue;  // the vehicle has requested distances at a lower rate
      if (link.peer) link.socket.send_to(asio::buffer(*message), *link.peer, 0, failed);
    }
    LinkFigures& counts = link.distances;
    std::string why;
    if (!ping.distance)
      ++counts.withheld, why = "a fault withholds the ping";
    else if (!link.peer)
      ++counts.unaddressed, why = "no vehicle is known";
    else if (failed)
      ++counts.refused, why = failed.message();
    else
      ++counts.sent;
    if (!why.empty())
      log_limited(log_, link.drops, LogLevel::info, link.name + ": DISTANCE_SENSOR was not sent: " + why,
                  {{"sonar", sonar.name}, {"dropped", counts.dropped()}, {"sent", counts.sent}});
    look_at_wants(link);
  }
}

// Ticks send heartbeats, report changes of the link, and request messages again while no poses come.
asio::awaitable<void> MavlinkServer::tick(Link& link) {
  while (!stopping_) {
    act_on(link, link.poses.on_tick(wire_time()), link.name, link.peer);
    error_code ec;
    link.timer.expires_after(tick_period);
    co_await link.timer.async_wait(into(ec));
  }
}

/// Handles refusals, poses, notices and replies; replies are sent to `to`, if it is known.
void MavlinkServer::act_on(Link& link, const mavlink::Reaction& reaction, const std::string& from,
                           const std::optional<udp::endpoint>& to) {
  for (const std::string& why : reaction.refusals) intake_.refuse(why, {from, from});
  for (const mavlink::SourcedPose& pose : reaction.poses) {
    // A router may send from any port, so the link counts as the sender.
    const std::string source = link.name + " " + pose.source;
    intake_.take(pose.sample, {source, source});
  }
  for (const std::string& notice : reaction.notices) log_limited(log_, link.notices, LogLevel::info, link.name + ": " + notice);
  error_code ignored;
  if (to)
    for (const mavlink::Bytes& reply : reaction.replies) link.socket.send_to(asio::buffer(reply), *to, 0, ignored);
}

}  // namespace sonar
