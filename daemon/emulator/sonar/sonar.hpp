// One emulated sonar without sockets, threads or a clock: settings, pacing, ping requests, and the conversations of its clients.
//
// Flow: the caller reports what happened (a connection, bytes, a finished ping, time passing) with the time it happened; the
// sonar changes its state and returns the Actions to carry out. Replies and pings wait in outboxes, from which the caller takes
// whole messages. Time is the daemon's (emulator/time); conversations run on unskipped time, which leaves out what stepped time
// jumps over.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/sonar/gain_assist.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/faults/faults.hpp"
#include "daemon/emulator/sonar/actions.hpp"
#include "daemon/emulator/sonar/connections.hpp"
#include "daemon/emulator/sonar/metrics.hpp"
#include "daemon/emulator/sonar/pacer.hpp"
#include "daemon/emulator/sonar/rate_watch.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

class Sonar {
 public:
  /// Both outlive the sonar. Of the configuration it reads what all sonars share: water, seed, switches, rules for stale poses.
  struct Surroundings {
    const Config& config;
    const World& world;
    FaultJournal* journal = nullptr;  // journal of faults; may be null
  };
  /// `index` keys its noise; `skipped`: what stepped time has jumped over so far.
  Sonar(Surroundings around, SonarConfig config, std::uint32_t index, Time now, std::chrono::nanoseconds skipped = {});
  Sonar(const Sonar&) = delete;
  Sonar& operator=(const Sonar&) = delete;

  // ---- connections

  /// A client or an observer at a port of kind tcp_stream, by default the vendor's first, or a host at one of kind udp_dialogue.
  /// Serve, KeepWaiting or Refuse is among the actions.
  Actions on_connect(ConnectionId id, Role role, Peer peer, Time now, const protocol::Port* port = nullptr);
  /// A port of kind udp_stream is open: messages for its receivers can be taken under this id.
  Actions open_stream(ConnectionId id, const protocol::Port& port, Time now);
  /// The present receivers of a stream's message, or of a message to the host at a port of kind udp_dialogue.
  std::vector<protocol::Endpoint> receivers(ConnectionId stream) const;
  /// Another host takes over the dialogue at a port of kind udp_dialogue.
  void hand_over(ConnectionId id, Peer to);
  Actions on_bytes(ConnectionId id, protocol::BytesView bytes, Time now);
  /// The next message to write, whole; empty when there is none or one is being written.
  Outbox::Message next_message(ConnectionId id, Time now);
  /// Reports `bytes` of it as sent; after the last one on_written() follows.
  void on_sent(ConnectionId id, std::size_t bytes);
  void on_written(ConnectionId id, const Outbox::Message& message, Time now);
  /// The message of a stream that was taken last had no receiver left, or none of its datagrams could be sent.
  void on_not_sent(ConnectionId id);
  /// The caller ends the connection after the message being written.
  void finish(ConnectionId id);
  /// The connection is closed; also one that waited. `why` is for the log.
  Actions on_closed(ConnectionId id, const std::string& why, Time now, bool by_client = false);
  /// The caller had no slot for a client that connected.
  void count_refused_client() { ++figures_.refused_clients; }
  /// Finishes every connection and requests no more pings; `why` is for the log.
  Actions stop(const std::string& why);

  // ---- pings and datagrams

  Actions on_ping(PingOutcome outcome, Time now);
  /// The datagrams of a status broadcast, in order; none when the vendor has no beacon.
  std::vector<protocol::Bytes> beacons(Time now);
  struct Answers {
    std::vector<protocol::Bytes> datagrams;  // datagrams to send back, in order
    Actions actions;
  };
  /// A datagram from a host, at a port of kind udp_answer.
  Answers on_datagram(const protocol::Port& port, const protocol::Endpoint& from, protocol::BytesView datagram, Time now);
  struct HttpAnswer {
    protocol::ResourceReply reply;
    Actions actions;
  };
  /// A request at a port of kind http.
  HttpAnswer on_http(const protocol::Port& port, const protocol::ResourceRequest& request, Time now);

  // ---- time

  /// Does everything that is due.
  Actions on_tick(Time now);
  /// When on_tick() has something to do next.
  std::optional<Time> next_tick() const;
  // The stepped clock advances to the next of these and performs them one by one.
  std::optional<Time> next_ping() const;
  std::optional<Time> next_conversation() const { return earliest(&Connection::next_tick); }
  /// When a conversation will request a ping by itself.
  std::optional<Time> next_request() const;
  Actions tick_pacer(Time now);
  Actions tick_conversations(Time now);
  /// Call it when stepped time jumps ahead.
  void skip(std::chrono::nanoseconds by);
  /// True if no ping is being computed and every client has received all that it was sent.
  bool settled() const;

  // ---- control

  /// Changes settings as another client would. A refusal says what the product can do, and nothing is changed.
  Result<Actions> change(const protocol::SettingsOverride& wanted, const std::string& who, Time now);
  /// Returns whether the setting changed.
  bool set_transmit(bool on);
  bool transmits() const { return transmits_; }
  /// Name of the client that last changed the settings; empty if they are the initial ones.
  const std::string& asked_by() const { return asked_by_; }
  Pose pose_at(Time at) const { return compose(around_.world.vehicle_at(config_.vehicle, at), config_.mount); }  // in world
  void move_mount(const Pose& mount, Time now);
  /// Uses vehicle and mount of a configuration that is otherwise the same.
  void move(const SonarConfig& config, Time now);
  void use_water(const Water& water, Time now);

  /// Why this sonar cannot have these faults, as a sentence: its vendor has no such thing, or another fault writes the same part.
  std::string why_no_faults(const std::vector<Fault>& faults) const;
  /// Those of `faults` that are for this sonar and take effect on it.
  Actions add_faults(const std::vector<Fault>& faults, bool manual, Time now);
  /// Empty `name` = all. False: there is none of that name.
  bool end_faults(const std::string& name, Time now, Actions& actions);
  const Faults& faults() const { return faults_; }

  const SonarConfig& config() const { return config_; }
  const protocol::Vendor& vendor() const { return vendor_; }
  const protocol::DeviceState& state() const { return state_; }
  const PingSettings& settings() const { return settings_; }
  PingSettings initial_settings() const { return vendor_.initial_settings(state_).settings; }
  const Connections& connections() const { return connections_; }
  std::uint32_t index() const { return index_; }
  bool busy() const { return busy_; }
  bool wants_pings() const;
  DeviceFigures figures() const;
  /// Pings that at least one client received, and pings that were made.
  std::uint64_t served() const { return figures_.served; }
  std::uint64_t pings() const { return figures_.pings; }
  /// A request for a ping as a client would get it now, but with a number and noise that no client's ping has. The sonar does not
  /// change. nullopt if poses are stale and the rule for stale poses forbids pings.
  std::optional<PingRequest> preview_request(PingNumber number, Time at) const;

 private:
  Time unskipped(Time now) const { return now - state_.skipped; }
  /// The inverse of unskipped(), if no more time is skipped.
  Time clock_time(Time unskipped) const {
    return unskipped > Time::max() - state_.skipped ? Time::max() : unskipped + state_.skipped;
  }
  std::optional<Time> earliest(std::optional<Time> (Connection::*of)() const) const;
  void handle(Connection& from, protocol::Reaction reaction, Time now, Actions& actions);
  /// `connection`: null when a datagram or an HTTP request caused it.
  struct Source {
    Connection* connection = nullptr;
    std::string name;
    protocol::Ipv4 ip{};
  };
  static Source source_of(Connection& connection) { return {&connection, connection.peer.name, connection.peer.ip}; }
  void on_event(const Source& from, const protocol::Event& event, Time now, Actions& actions);
  void set_receivers(const Source& from, protocol::SetReceivers wanted, Time now);
  void update_pacer(Time now);
  // Faults (sonar_faults.cpp).
  void apply_fault_orders(Time now, Actions& actions);
  void apply(const FaultOrder& order, Time now, Actions& actions);
  void deliver(Connection& to, Outbox::Message ping, Time now, Actions& actions);
  void release_held(Connection& to, Time now, bool all, Actions& actions);
  void serve_waiting(Time now, Actions& actions);
  void change_as_requested(const Source& from, protocol::ChangeSettings change, Time now, Actions& actions);
  void end_by_fault(Connection& connection, Faults::RequestVerdict verdict, Actions& actions);
  void serve(Connection& connection, Time now, Actions& actions);
  /// An exception is a mistake in sonard: it may cost this connection, never the others.
  template <class Call>
  void guarded(Connection& connection, Actions& actions, Call call) {
    try {
      call();
    } catch (const std::exception& e) {
      report_fault(e, actions);
      finish(connection.id);
      actions.emplace_back(Reset{connection.id, "an internal fault"});
    }
  }
  void report_fault(const std::exception& e, Actions& actions) const {
    report(Report::Topic::fault, LogLevel::error, std::string("internal fault: ") + e.what(), {}, actions);
  }
  void begin_finish(Connection& connection, const std::string& why, Actions& actions);
  void on_membership(Time now, Actions& actions);
  void use_initial_settings();
  void change_settings(const protocol::ChangeSettings& change, const std::string& who, Time now, Actions& actions);
  bool waits_for_pose(Time at) const;
  PingRequest request_at(Time at, const protocol::RequestPing& aim) const;
  void request_ping(Time at, Actions& actions);
  PingNumber next_number();
  void queue_ping(const PingOutcome& outcome, Time now, Actions& actions);
  std::vector<protocol::Event> offer(Connection& to, const std::shared_ptr<const protocol::Bytes>& bytes, const Ping& reported,
                                     const PingRequest& ping, Time now, Actions& actions);
  std::shared_ptr<const Outbox::Shape> parted(const Connection& to, const Ping& ping) const;
  void offer_datagrams(Connection& stream, const Ping& ping, Time now, PingQueued& queued, Actions& actions);
  std::vector<protocol::Event> offer_to_host(Connection& host, const Ping& ping, Time now, PingQueued& queued, Actions& actions);
  void push_datagrams(Connection& to, const Ping& ping, Time now, PingQueued& queued, Actions& actions);
  void note_water(const PingRequest& computed, Time now, Actions& actions);
  void update_depth(Time now);
  void follow_water();
  void report(Report::Topic topic, LogLevel level, std::string phrase, std::vector<LogField> fields, Actions& actions) const;

  Surroundings around_;
  SonarConfig config_;
  const protocol::Vendor& vendor_;
  std::uint32_t index_;
  protocol::DeviceState state_;
  Connections connections_;
  Faults faults_;

  Pacer pacer_;
  PingSettings settings_;
  protocol::RequestPing aim_;  // the last
  GainAssist gain_assist_;
  bool asked_ = false;  // settings were requested since the first client or receiver came
  std::string asked_by_;
  bool transmits_ = true;
  bool stopping_ = false;

  // The ping that is being computed.
  bool busy_ = false;
  std::shared_ptr<const VendorSettings> busy_settings_;
  bool busy_blank_ = false;     // requested as noise only
  bool busy_unwanted_ = false;  // its clients have gone

  std::uint32_t ping_number_ = 0;
  std::uint64_t numbered_skips_ = 0;  // ticks lost to overload, as of the last ping
  bool in_air_ = false;               // at the last ping
  std::optional<Time> air_reported_;
  struct {
    std::uint32_t ping = 0;
    Time tick{}, at{};
  } last_served_;
  RateWatch rate_watch_;
  DeviceFigures figures_;
};

}  // namespace sonar
