// Who is connected to an emulated sonar: slots of clients, the queue for them, take-over, receivers of streams, and the end of a
// connection. It changes no settings and computes no pings: the Sonar asks has_audience() after each change.
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
  /// `sonar` outlives it.
  explicit Audience(SonarData& sonar) : sonar_(sonar), connections_(sonar.config) {}
  Audience(const Audience&) = delete;
  Audience& operator=(const Audience&) = delete;

  Connections& connections() { return connections_; }
  const Connections& connections() const { return connections_; }
  Connections::List& all() { return connections_.all(); }
  const Connections::List& all() const { return connections_.all(); }
  /// A client is served or a stream has receivers.
  bool has_audience() const { return connections_.has_audience(); }
  bool stopping() const { return stopping_; }

  /// Decides about a connection: the slots do, unless a fault of clients does (`by_fault`). The connection, when it has a slot:
  /// serve() follows. Null: it waits or is refused. The client that it takes over from counts as gone.
  Connection* admit(ConnectionId id, Role role, Peer peer, const protocol::Port* port, Faults::Admission by_fault,
                    Actions& actions);
  void serve(Connection& connection, Time now, Actions& actions);
  /// The client that has waited longest for a slot. Null: there is none, or the sonar stops.
  Connection* next_waiting() { return stopping_ ? nullptr : connections_.longest_waiting(); }
  /// A port of kind udp_stream is open.
  void open_stream(ConnectionId id, const protocol::Port& port);
  /// Another host goes on with the dialogue at a port of kind udp_dialogue.
  void hand_over(ConnectionId id, Peer to);
  /// `from`: whose list it is; null = the device's own. 0.0.0.0 among the addresses becomes `ip`.
  void set_receivers(Connection* from, protocol::Ipv4 ip, protocol::SetReceivers wanted);
  /// Replaces the device's own list of that stream by the list of its stored configuration.
  void restore_receivers(protocol::SetReceivers initial);
  /// Called after a client has come or gone: the state that the device reports, and pings that have no receiver left.
  void on_membership();

  /// Waiting pings are dropped; the message that is being written and replies are still sent.
  void finish(Connection& connection);
  void finish(ConnectionId id) {
    if (Connection* const connection = connections_.find(id)) finish(*connection);
  }
  void begin_finish(Connection& connection, const std::string& why, Actions& actions);
  /// Every connection is finished and none is admitted any more.
  void stop(const std::string& why, Actions& actions);
  /// Accounts for a closed connection and removes it.
  void remove(Connection& connection, const std::string& why, bool by_client, Actions& actions);
  // Effects of faults.
  void end_by_fault(Connection& connection, Faults::RequestVerdict verdict, Actions& actions);
  /// `only` one of them, or all.
  void end_clients(std::optional<ConnectionId> only, bool reset, Actions& actions);
  void read_clients(bool on, Actions& actions);
  void drop_newest(bool on);
  void end_pauses(Actions& actions);
  /// An exception may cost this connection, never the others. A stream belongs to the device: it loses a ping only.
  template <class Call>
  void guarded(Connection& connection, Actions& actions, Call call) {
    try {
      call();
    } catch (const std::exception& e) {
      sonar_.report_fault(e, actions);
      if (connection.role == Role::stream) return;
      finish(connection);
      actions.emplace_back(Reset{connection.id, "an internal fault"});
    }
  }

  /// The earliest of these times of served clients (Connection::next_tick or next_request), as the daemon's time.
  std::optional<Time> earliest(std::optional<Time> (Connection::*of)() const) const;

 private:
  SonarData& sonar_;
  Connections connections_;
  bool stopping_ = false;
};

}  // namespace sonar
