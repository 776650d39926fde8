// The sockets for poses over MAVLink. Each link has a socket, which listens (udpin) or sends first (udpout), and a MavlinkPoses.
// The links and the PoseServer use the same PoseIntake. App owns the server.
#pragma once

#include <functional>
#include <list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "daemon/server/connections/port_guard.hpp"
#include "daemon/server/poses/pose_intake.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"
#include "protocol/mavlink/mavlink_poses.hpp"

namespace sonar {

class MavlinkServer {
 public:
  /// `config` must outlive the object: open() reads the links and the geographic origin, and each datagram the allowed addresses.
  /// `began`: the daemon's time from which messages count the time since boot.
  MavlinkServer(asio::io_context& io, const Config& config, PoseIntake& intake, Log& log, Time began);

  /// Call it before open(). Sets the function, for all links, that carries out the command to inject a failure. Without the
  /// function the answer to the command is "unsupported".
  void inject_failures_with(mavlink::InjectFailure inject) { inject_ = std::move(inject); }
  /// Call it before open(). `tell` is called when wants_distances() of a vehicle has changed.
  void on_distances_wanted(std::function<void()> tell) { distances_wanted_ = std::move(tell); }
  /// True if a link of that vehicle sends the distances of its range finders.
  bool wants_distances(const std::string& vehicle) const;
  /// Sends the distance of a range finder's ping to the autopilot of its vehicle.
  void on_distance(const SonarConfig& sonar, const PingQueued& ping);
  Result<void> open();
  void start();
  void stop();

  /// Returns texts such as "udpin:127.0.0.1:14551", with the port that the system chose for 0.
  std::vector<std::string> endpoints() const;
  /// Returns for each link how many distances were sent and dropped, in the order of the configuration.
  std::vector<LinkFigures> figures() const;
  /// Returns notes on links without poses, with the missing messages, and on ignored messages of a second system.
  std::vector<Note> notes() const;
  /// Returns the address of a listening link; links are in the order of the configuration.
  Endpoint listens_at(std::size_t link) const;

 private:
  static constexpr std::size_t most_datagrams_per_s = 4096;  // limit; autopilots send a few hundred

  struct Link {
    MavlinkConfig config;
    mavlink::MavlinkPoses poses;
    udp::socket socket;
    asio::steady_timer timer;
    std::optional<udp::endpoint> peer;  // gets heartbeats, requests and distances; a reply goes to the sender of its request
    std::string name;                   // such as "mavlink udpin:127.0.0.1:14551"
    LogLimiter notices = {}, drops = {};
    LinkFigures distances = {};
    WorkRate of_address = {};
    DatagramRate rate = DatagramRate(most_datagrams_per_s);
    bool distances_wanted = false;  // result of the last look_at_wants()
  };

  asio::awaitable<void> receive(Link& link);
  asio::awaitable<void> tick(Link& link);
  void on_datagram(Link& link, mavlink::BytesView bytes, const udp::endpoint& from);
  void act_on(Link& link, const mavlink::Reaction& reaction, const std::string& from, const std::optional<udp::endpoint>& to);
  void look_at_wants(Link& link);
  bool is_allowed(const Link& link, const asio::ip::address& from) const;

  asio::io_context& io_;
  const Config& config_;
  PoseIntake& intake_;
  Log& log_;
  Time began_;
  mavlink::InjectFailure inject_;
  std::function<void()> distances_wanted_;
  LogLimiter faults_;
  std::list<Link> links_;
  bool stopping_ = false;
};

}  // namespace sonar
