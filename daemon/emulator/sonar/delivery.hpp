// Delivers the messages of an emulated sonar: a ping is framed once for each port, offered to each connection, perhaps held back
// by a fault, and taken from the outbox when the connection can write.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/emulator/faults/faults.hpp"
#include "daemon/emulator/sonar/audience.hpp"
#include "daemon/emulator/sonar/sonar_data.hpp"

namespace sonar {

/// The bytes of a ping for each port. The parts for a port are made when they are first needed; connections share them.
class FramedPing {
 public:
  using Bytes = protocol::Bytes;
  using Datagrams = std::shared_ptr<const std::vector<Bytes>>;

  /// `ping` as the device reports it. `recorded`: PingOutcome::recorded. All outlive the object.
  FramedPing(const protocol::Vendor& vendor, const protocol::DeviceState& state, const Ping& ping,
             const PartsByPort* recorded = nullptr);

  /// The bytes of the ping over TCP; null if the vendor sends only datagrams.
  const std::shared_ptr<const Bytes>& bytes() const { return bytes_; }
  /// The bytes for clients at that port of kind tcp_stream: bytes(), or the port's own part of them. Null: none.
  std::shared_ptr<const Bytes> bytes_at(const protocol::Port& port);
  /// The parts of the ping at that port: datagrams, or what a port of kind tcp_stream with a gap sends between pauses.
  const Datagrams& parts(const protocol::Port& port);
  /// The pauses between the parts of bytes(). Null: bytes() are written without pauses.
  std::shared_ptr<const Outbox::Shape> pauses(const protocol::Port& port);

 private:
  const protocol::Vendor& vendor_;
  const protocol::DeviceState& state_;
  const Ping& ping_;
  const PartsByPort* recorded_;
  std::shared_ptr<const Bytes> bytes_;
  bool is_first_ports_ = false;  // with several streams, bytes_ are those of the vendor's first TCP port
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
  /// The arguments outlive the object.
  Delivery(SonarData& sonar, Audience& audience, Faults& faults) : sonar_(sonar), audience_(audience), faults_(faults) {}

  /// The requests by which clients answer a ping.
  using Requests = std::vector<std::pair<Connection*, protocol::Event>>;
  /// Puts the ping into the outbox of every connection that takes it.
  PingQueued queue(const PingOutcome& outcome, Time now, Requests& requests, Actions& actions);
  /// Sends pings that a fault held back until now; with `all`, also those that are due later.
  void release_held(Time now, bool all, Actions& actions);
  /// The time at which the next ping that is held back is due.
  std::optional<Time> next_release() const;

  /// Returns the present receivers of a stream, or of a dialogue at a port of kind udp_dialogue.
  std::vector<protocol::Endpoint> receivers(ConnectionId stream) const;
  /// Returns the datagrams of a status broadcast.
  std::vector<protocol::Bytes> beacons(Time now);
  // See Sonar, which passes these on.
  Outbox::Message next_message(ConnectionId id, Time now);
  void on_sent(ConnectionId id, std::size_t bytes);
  void on_not_sent(ConnectionId id);
  void on_written(ConnectionId id, const Outbox::Message& message, Time now);
  /// Call it when pings are numbered from 1 again.
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
