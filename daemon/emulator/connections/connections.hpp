// The connections of one emulated sonar: clients, connections that wait for a slot, connections that are ending, and observers,
// which receive every ping and change nothing. Streams of datagrams count as connections too. Each connection has an outbox and,
// except for streams, a dialogue in the vendor's protocol. This file uses no sockets and no clock.
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/emulator/connections/actions.hpp"
#include "daemon/emulator/connections/outbox.hpp"

namespace sonar {

struct Peer {
  std::string name;     // name in the log, such as "127.0.0.1:40123"
  protocol::Ipv4 ip{};  // address in the status message
  std::uint16_t port = 0;
};

struct Connection {
  enum class State {
    waiting,  // no slot is free yet
    served,
    leaving,  // gets the rest of the current message, but no longer counts as a client
  };
  ConnectionId id = 0;
  Role role = Role::client;
  Peer peer;
  State state = State::served;
  std::uint64_t number = 0;              // number of a client, counted from 1
  const protocol::Port* port = nullptr;  // one of the vendor's ports
  std::unique_ptr<protocol::Dialogue> dialogue;
  Outbox outbox;
  /// Lists of receivers. A client has one for each stream for which it requested receivers; a stream has the device's list.
  std::vector<protocol::SetReceivers> receivers;
  struct Held {  // a ping that a fault holds back
    Outbox::Message ping;
    Time until{};
    bool after_next = false;  // true: held until the next ping has been sent
  };
  std::deque<Held> held;
  bool finishing = false;  // true: bytes of the client are ignored, and no more pings are sent
  Time not_before{};       // earliest next call of dialogue->on_tick, in unskipped time
  std::uint64_t bytes_written = 0, bytes_read = 0;
  std::uint64_t streamed_pings = 0, streamed_bytes = 0;  // sent as datagrams of streams to the receivers of this client
  std::uint64_t requests = 0;                            // number of requests for settings or a ping
  std::string complaint = {};                            // the latest error in a request

  /// True if the port is of kind udp_stream or udp_dialogue, which send datagrams.
  bool takes_datagrams() const { return port != nullptr && port->kind != protocol::Port::Kind::tcp_stream; }
  /// True if the port never has pings, only answers to commands.
  bool is_for_commands() const { return port != nullptr && !port->has_pings; }
  /// Returns the number of pings that the client received over its own connection or from a stream.
  std::uint64_t pings_written() const { return outbox.pings_written() + streamed_pings; }
  /// True if the client has requested a receiver of that stream.
  bool receives(std::size_t stream) const;
  /// Returns the next time at which the dialogue must be called; nullopt while the connection is ending.
  std::optional<Time> next_tick() const;
  /// Returns the time at which the dialogue will request a ping without input from the client.
  std::optional<Time> next_request() const;
};

/// Adds the counts of pings and bytes of the connection.
void add_traffic(DeviceFigures& figures, const Connection& of);

class Connections {
 public:
  using List = std::list<Connection>;
  static constexpr std::size_t longest_queue = 16;

  explicit Connections(const SonarConfig& config) : config_(config) {}

  Connection* find(ConnectionId id);
  const Connection* find(ConnectionId id) const { return const_cast<Connections*>(this)->find(id); }
  /// Returns the number of served clients.
  std::size_t clients() const { return count(Role::client, Connection::State::served); }
  std::size_t observers() const { return count(Role::observer, Connection::State::served); }
  std::size_t waiting() const { return count(Role::client, Connection::State::waiting); }
  bool empty() const { return all_.empty(); }
  Connection* oldest_client();
  const Connection* oldest_client() const { return const_cast<Connections*>(this)->oldest_client(); }
  Connection* longest_waiting();
  /// Returns the stream with that number, counted from 0 among the vendor's streams.
  Connection* stream(std::size_t number);
  /// Returns the receivers of a stream's datagrams: the device's list and the lists of the clients, without repeated addresses.
  std::vector<protocol::Endpoint> receivers(const Connection& stream) const;
  /// True if a client is served or a stream has receivers.
  bool has_audience() const;
  /// True if nothing waits to be sent to any client.
  bool settled() const;

  /// The decision about a new connection. It depends on max_clients, when_full and max_observers.
  enum class Verdict { serve, take_over, wait, refuse };
  Verdict verdict(Role role) const;
  Connection& add(ConnectionId id, Role role, Peer peer, Connection::State state, const protocol::Port* port);
  void remove(ConnectionId id);

  List& all() { return all_; }
  const List& all() const { return all_; }

 private:
  std::size_t count(Role role, Connection::State state) const;

  const SonarConfig& config_;
  List all_;  // in the order of arrival
};

}  // namespace sonar
