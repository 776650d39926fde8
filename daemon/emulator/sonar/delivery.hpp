// Delivers the messages of an emulated sonar: frames a ping once per port, offers it to each connection unless a fault holds it
// back, and returns messages from the outbox when a connection can write.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/emulator/faults/faults.hpp"
#include "daemon/emulator/sonar/audience.hpp"
#include "daemon/emulator/sonar/sonar_data.hpp"

namespace sonar {

/// The bytes of a ping for each port. They are made when first needed, and connections share them.
class FramedPing {
 public:
  using Bytes = protocol::Bytes;
  using Datagrams = std::shared_ptr<const std::vector<Bytes>>;

  /// `ping`: as the device reports it. `recorded`: PingOutcome::recorded. All arguments must outlive the object.
  FramedPing(const protocol::Vendor& vendor, const protocol::DeviceState& state, const Ping& ping,
             const PartsByPort* recorded = nullptr);

  /// Returns the bytes of the ping for TCP; null if the vendor sends only datagrams.
  const std::shared_ptr<const Bytes>& bytes() const { return bytes_; }
  /// Returns the bytes for clients at a port of kind tcp_stream: bytes(), or only the port's part of them; null if there are
  /// none.
  std::shared_ptr<const Bytes> bytes_at(const protocol::Port& port);
  /// Returns the parts of the ping at a port: datagrams or, for a port of kind tcp_stream with a gap, the bytes between pauses.
  const Datagrams& parts(const protocol::Port& port);
  /// Returns the pauses between the parts of bytes(); null if there are no pauses.
  std::shared_ptr<const Outbox::Shape> pauses(const protocol::Port& port);

 private:
  const protocol::Vendor& vendor_;
  const protocol::DeviceState& state_;
  const Ping& ping_;
  const PartsByPort* recorded_;
  std::shared_ptr<const Bytes> bytes_;
  bool is_first_ports_ = false;  // true: vendor.frame() made bytes_, which are for the first TCP port
  struct AtPort {
    const protocol::Port* port;
    Datagrams parts;
    std::shared_ptr<const Outbox::Shape> pauses;
  };
  std::vector<AtPort> ports_;
  AtPort& at(const protocol::Port& port);
  std::vector<Bytes> made_for(const protocol::Port& port) const;
};

class Delivery {
 public:
  /// The arguments must outlive the object.
  Delivery(SonarData& sonar, Audience& audience, Faults& faults) : sonar_(sonar), audience_(audience), faults_(faults) {}

  /// Requests that dialogues make after a ping.
  using Requests = std::vector<std::pair<Connection*, protocol::Event>>;
  /// Puts the ping into the outbox of every connection that gets the ping.
  PingQueued queue(const PingOutcome& outcome, Time now, Requests& requests, Actions& actions);
  /// Releases held pings that are due now; with `all`, all held pings.
  void release_held(Time now, bool all, Actions& actions);
  /// Returns the time at which the next held ping is due.
  std::optional<Time> next_release() const;

  /// Returns the present receivers of a stream, or the host of a port of kind udp_dialogue.
  std::vector<protocol::Endpoint> receivers(ConnectionId stream) const;
  /// Returns the datagrams of a status broadcast.
  std::vector<protocol::Bytes> beacons(Time now);
  // The comments of Sonar describe the following functions.
  Outbox::Message next_message(ConnectionId id, Time now);
  void on_sent(ConnectionId id, std::size_t bytes);
  void on_not_sent(ConnectionId id);
  void on_written(ConnectionId id, const Outbox::Message& message, Time now);
  /// Call it when ping numbers begin at 1 again.
  void restart() { last_served_ = {}; }

 private:
  std::vector<protocol::Event> offer(Connection& to, FramedPing& framed, PingQueued& queued, Time now, Actions& actions);
  FramedPing::Datagrams datagrams_for(Connection& to, FramedPing& framed, std::uint32_t ping, Time now);
  void deliver(Connection& to, Outbox::Message ping, Time now, Actions& actions);
  void release_held(Connection& to, Time now, bool all, Actions& actions);

  SonarData& sonar_;
  Audience& audience_;
  Faults& faults_;
  struct {
    std::uint32_t ping = 0;
    Time tick{}, at{};
  } last_served_;
};

}  // namespace sonar
