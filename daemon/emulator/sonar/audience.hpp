// Manages the connections of an emulated sonar: slots of clients, the queue for slots, take-over, receivers of streams, and the
// end of a connection. After each change of the connections the Sonar calls has_audience(), and starts or stops pings.
#pragma once

#include <exception>
#include <optional>
#include <string>

#include "daemon/emulator/connections/connections.hpp"
#include "daemon/emulator/faults/faults.hpp"
#include "daemon/emulator/sonar/sonar_data.hpp"

namespace sonar {

class Audience {
 public:
  /// `sonar` must outlive the object.
  explicit Audience(SonarData& sonar) : sonar_(sonar), connections_(sonar.config) {}
  Audience(const Audience&) = delete;
  Audience& operator=(const Audience&) = delete;

  Connections& connections() { return connections_; }
  const Connections& connections() const { return connections_; }
  Connections::List& all() { return connections_.all(); }
  const Connections::List& all() const { return connections_.all(); }
  /// True if a client is served or a stream has receivers.
  bool has_audience() const { return connections_.has_audience(); }
  bool stopping() const { return stopping_; }

  /// Admits a new connection if a slot is free, unless an injected fault (`by_fault`) decides otherwise. Returns the
  /// connection if it gets a slot (the caller must then call serve()); null if it waits or is refused. After a take-over the
  /// previous client no longer counts as a client.
  Connection* admit(ConnectionId id, Role role, Peer peer, const protocol::Port* port, Faults::Admission by_fault,
                    Actions& actions);
  void serve(Connection& connection, Time now, Actions& actions);
  /// Returns the client that has waited longest for a slot; null if none waits or the sonar is stopping.
  Connection* next_waiting() { return stopping_ ? nullptr : connections_.longest_waiting(); }
  /// Adds the stream of an open port of kind udp_stream.
  void open_stream(ConnectionId id, const protocol::Port& port);
  /// Transfers the dialogue at a port of kind udp_dialogue to another host.
  void hand_over(ConnectionId id, Peer to);
  /// Sets the list of receivers of client `from`, or of the device if `from` is null. An address 0.0.0.0 becomes `ip`.
  void set_receivers(Connection* from, protocol::Ipv4 ip, protocol::SetReceivers wanted);
  /// Replaces the device's own list of a stream by `initial`.
  void restore_receivers(protocol::SetReceivers initial);
  /// Call it after a client has connected or left: updates the client in status messages, and drops pings without receivers.
  void on_membership();

  /// Marks a connection as ending, and drops its waiting pings; the current message and replies stay in the outbox.
  void finish(Connection& connection);
  /// Like finish(), and tells the caller to close the connection after these.
  void begin_finish(Connection& connection, const std::string& why, Actions& actions);
  /// Resets waiting connections, ends the others as begin_finish() does, and admits no more.
  void stop(const std::string& why, Actions& actions);
  /// Adds the counts of a closed connection to the figures, and removes the connection.
  void remove(Connection& connection, const std::string& why, bool by_client, Actions& actions);
  // Effects of faults.
  void end_by_fault(Connection& connection, Faults::RequestVerdict verdict, Actions& actions);
  /// Ends the client `only`, or all clients.
  void end_clients(std::optional<ConnectionId> only, bool reset, Actions& actions);
  void read_clients(bool on, Actions& actions);
  void drop_newest(bool on);
  void end_pauses(Actions& actions);
  /// Runs a function; an exception ends only this connection. A stream, which belongs to the device, only loses a ping.
  void guarded(Connection& connection, Actions& actions, auto call) {
    try {
      call();
    } catch (const std::exception& e) {
      sonar_.report_fault(e, actions);
      if (connection.role == Role::stream) return;
      finish(connection);
      actions.emplace_back(Reset{connection.id, "an internal fault"});
    }
  }

  /// Returns the earliest Connection::next_tick or next_request of all served clients, in the daemon's time.
  std::optional<Time> earliest(std::optional<Time> (Connection::*of)() const) const;

 private:
  SonarData& sonar_;
  Connections connections_;
  bool stopping_ = false;
};

}  // namespace sonar
