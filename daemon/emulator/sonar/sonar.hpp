// One emulated sonar without sockets, threads or a clock. It calls the dialogues with its clients and connects three parts: the
// Audience (the connections), the PingSource (settings and pings) and the Delivery (messages to clients).
//
// The caller reports each event (a connection, bytes, a finished ping, a tick) with its time; the sonar changes its state and
// returns the Actions to carry out. Replies and pings wait in outboxes, from which the caller fetches whole messages. Times are
// those of the daemon's clock; dialogues use unskipped time, which does not include the jumps of stepped time.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "daemon/emulator/connections/actions.hpp"
#include "daemon/emulator/faults/faults.hpp"
#include "daemon/emulator/sonar/audience.hpp"
#include "daemon/emulator/sonar/delivery.hpp"
#include "daemon/emulator/sonar/ping_source.hpp"
#include "daemon/emulator/sonar/sonar_data.hpp"

namespace sonar {

class Sonar {
 public:
  using Surroundings = SonarData::Surroundings;
  /// `index`: part of the key of random numbers. `skipped`: sum of the jumps of stepped time so far.
  Sonar(Surroundings around, SonarConfig config, std::uint32_t index, Time now, std::chrono::nanoseconds skipped = {});
  Sonar(const Sonar&) = delete;
  Sonar& operator=(const Sonar&) = delete;

  // ---- connections

  /// Reports a client or observer at a port of kind tcp_stream (null: the vendor's first), or a host at a port of kind
  /// udp_dialogue. The actions contain Serve, KeepWaiting or Refuse.
  Actions on_connect(ConnectionId id, Role role, Peer peer, Time now, const protocol::Port* port = nullptr);
  /// Call it when a port of kind udp_stream is open; next_message() with this id then returns messages for the receivers of the
  /// port.
  Actions open_stream(ConnectionId id, const protocol::Port& port, Time now);
  /// Returns the present receivers of a stream, or the host of a port of kind udp_dialogue.
  std::vector<protocol::Endpoint> receivers(ConnectionId stream) const { return delivery_.receivers(stream); }
  /// Transfers the dialogue at a port of kind udp_dialogue to another host.
  void hand_over(ConnectionId id, Peer to) { audience_.hand_over(id, std::move(to)); }
  Actions on_bytes(ConnectionId id, protocol::BytesView bytes, Time now);
  /// Returns the number of replies and events that bytes of clients have caused since the last call.
  std::size_t take_reactions() { return std::exchange(reactions_, 0); }
  /// Returns the next message to write; an empty one if none waits, or while a message is being written.
  Outbox::Message next_message(ConnectionId id, Time now) { return delivery_.next_message(id, now); }
  /// Reports that another `bytes` bytes of the message were sent; after the last byte, call on_written().
  void on_sent(ConnectionId id, std::size_t bytes) { delivery_.on_sent(id, bytes); }
  void on_written(ConnectionId id, const Outbox::Message& message, Time now) { delivery_.on_written(id, message, now); }
  /// Reports that a stream's last message had no receiver, or that none of its datagrams could be sent.
  void on_not_sent(ConnectionId id) { delivery_.on_not_sent(id); }
  /// Ends the connection after the message that is being written. A host that sends datagrams stops being a client at once,
  /// because the request of the next host may arrive before on_closed().
  Actions finish(ConnectionId id, Time now);
  /// Reports that a connection, served or waiting, is closed. `why` is for the log.
  Actions on_closed(ConnectionId id, const std::string& why, Time now, bool by_client = false);
  /// Counts a client that the caller refused for lack of a slot.
  void count_refused_client() { ++data_.figures.refused_clients; }
  /// Ends all connections as finish() does, and requests no more pings; `why` is for the log.
  Actions stop(const std::string& why);

  // ---- pings and datagrams

  Actions on_ping(PingOutcome outcome, Time now);
  /// Returns the datagrams of a status broadcast, in order; none if the vendor has no beacon.
  std::vector<protocol::Bytes> beacons(Time now) { return delivery_.beacons(now); }
  struct Answers {
    std::vector<protocol::Bytes> datagrams;  // datagrams to send back, in order
    Actions actions;
  };
  /// Handles a datagram of a host at a port of kind udp_answer.
  Answers on_datagram(const protocol::Port& port, const protocol::Endpoint& from, protocol::BytesView datagram, Time now);
  struct HttpAnswer {
    protocol::ResourceReply reply;
    Actions actions;
  };
  /// Handles a request at a port of kind http.
  HttpAnswer on_http(const protocol::Port& port, const protocol::ResourceRequest& request, Time now);

  // ---- time

  /// Does everything that is due at this time.
  Actions on_tick(Time now);
  /// Returns the next time at which on_tick() must be called.
  std::optional<Time> next_tick() const;
  // The stepped clock advances to the earliest of these times.
  std::optional<Time> next_ping() const { return source_.next_ping(); }
  /// Returns the time of the next tick of a dialogue, or of the next ping that a slow device sends.
  std::optional<Time> next_conversation() const;
  /// Returns the time at which a dialogue will request a ping without input.
  std::optional<Time> next_request() const;
  Actions tick_pacer(Time now) { return source_.tick(now); }
  /// Does what is due in dialogues, faults and held pings.
  Actions tick_conversations(Time now);
  std::optional<Time> next_tick_of_conversations() const;
  /// Call it when stepped time jumps ahead.
  void skip(std::chrono::nanoseconds by);
  /// True if no ping is being computed and nothing waits to be sent to any client.
  bool settled() const { return !busy() && connections().settled(); }

  // ---- control

  /// Changes settings as a client would. An error states what the product can do; the settings then do not change.
  Result<Actions> change(const protocol::SettingsOverride& wanted, const std::string& who, Time now);
  /// Sets whether the sonar pings without a client, for example a range finder whose distances an autopilot gets.
  void run_itself(bool on, Time now) { source_.run_itself(on, now); }
  /// Sets whether the sonar transmits. Returns whether that changed.
  bool set_transmit(bool on) { return source_.set_transmit(on); }
  bool transmits() const { return source_.transmits(); }
  /// Returns the name of the client that last changed the settings; empty if no client did.
  const std::string& asked_by() const { return source_.asked_by(); }
  Pose pose_at(Time at) const { return data_.pose_at(at); }  // pose in the world
  void move_mount(const Pose& mount, Time now);
  /// Uses vehicle and mount of `config`, which is otherwise equal to the present configuration.
  void move(const SonarConfig& config, Time now);
  void use_water(const Water& water, Time now) { source_.use_water(water, now); }

  /// Returns the reason why this sonar cannot have these faults; nullopt if it can.
  std::optional<FaultRefusal> why_no_faults(const std::vector<Fault>& faults) const { return faults_.why_not(faults); }
  /// Adds those of `faults` that are for this sonar and have an effect on it.
  Actions add_faults(const std::vector<Fault>& faults, bool manual, Time now);
  /// Ends the faults with this name, or all if `name` is empty. Returns false if there is none.
  bool end_faults(const std::string& name, Time now, Actions& actions);
  const Faults& faults() const { return faults_; }

  const SonarConfig& config() const { return data_.config; }
  const protocol::Vendor& vendor() const { return data_.vendor; }
  const protocol::DeviceState& state() const { return data_.state; }
  const PingSettings& settings() const { return source_.settings(); }
  PingSettings initial_settings() const { return vendor().initial_settings(state()).settings; }
  const Connections& connections() const { return audience_.connections(); }
  std::uint32_t index() const { return data_.index; }
  bool busy() const { return source_.busy(); }
  bool wants_pings() const { return source_.wants_pings(); }
  DeviceFigures figures() const;
  /// Return the number of pings that at least one client received, and the number of computed pings.
  std::uint64_t served() const { return data_.figures.served; }
  std::uint64_t pings() const { return data_.figures.pings; }
  /// Returns a request for the ping that a client would get now, but with another number and other noise. The sonar does not
  /// change. Returns nullopt if poses are stale and the rule for stale poses forbids pings.
  std::optional<PingRequest> preview_request(PingNumber number, Time at) const { return source_.preview_request(number, at); }

 private:
  /// The cause of an event. `connection`: null for a datagram or an HTTP request.
  struct Source {
    Connection* connection = nullptr;
    std::string name;
    protocol::Ipv4 ip{};
  };
  static Source source_of(Connection& connection) { return {&connection, connection.peer.name, connection.peer.ip}; }
  void deliver(const PingOutcome& outcome, Time now, Actions& actions);
  void handle(Connection& from, protocol::Reaction reaction, Time now, Actions& actions);
  void on_event(const Source& from, const protocol::Event& event, Time now, Actions& actions);
  void serve(Connection& connection, Time now, Actions& actions);
  void serve_waiting(Time now, Actions& actions);
  void on_membership(Time now, Actions& actions);
  void on_left(Time now, Actions& actions);
  void apply_fault_orders(Time now, Actions& actions);
  void apply(const FaultOrder& order, Time now, Actions& actions);
  void change_as_requested(const Source& from, protocol::ChangeSettings change, Time now, Actions& actions);

  SonarData data_;
  Audience audience_;
  Faults faults_;
  PingSource source_;
  Delivery delivery_;
  std::size_t reactions_ = 0;
};

}  // namespace sonar
