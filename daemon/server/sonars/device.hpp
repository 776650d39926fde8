// The network side of one emulated sonar: the vendor's ports, the port for observers, a timer. It passes bytes to the Sonar and
// carries out the returned Actions. Fleet owns it, and only the I/O thread uses it.
#pragma once

#include <array>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/connections/pacer.hpp"
#include "daemon/emulator/sonar/sonar.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/connections/listener.hpp"
#include "daemon/server/engine/simulator.hpp"
#include "daemon/server/recording/recording_file.hpp"
#include "daemon/server/sonars/datagram_port.hpp"
#include "daemon/server/sonars/session.hpp"
#include "daemon/server/sonars/sonar_http.hpp"
#include "daemon/server/sonars/visit_log.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

namespace v1 {  // from control.pb.h
class PingEvent;
class SonarStatus;
}  // namespace v1

class Device;

/// The functions of the daemon that a device calls. It must outlive the device.
class DeviceParent {
 public:
  virtual ~DeviceParent() = default;
  /// Computes a ping. `done` is called once, later, on the I/O thread.
  virtual void compute(const Device& of, PingRequest request, Simulator::Done done) = 0;
  virtual void on_ping_queued(const Device& of, const PingQueued& ping) = 0;
  virtual void on_client(const Device& of, const std::string& peer, bool connected, const std::string& why) = 0;
  /// Called when a device that was started begins to stop.
  virtual void on_stop(const Device& of, const std::string& why) = 0;
  /// Called after a change for which stepped time or the shutdown may wait.
  virtual void on_change() = 0;
  /// Called when the daemon must end.
  virtual void on_engine_failure(const Error& why) = 0;
};

/// Objects that all devices share. They must outlive the devices.
struct DeviceNetwork {
  asio::io_context& io;
  Clock& clock;
  Admission& admission;
  Log& log;
  bool digest = false;  // true: computes the SHA-256 of the bytes sent to each client
};

struct StreamDigest {
  std::uint64_t client = 0, bytes = 0;
  std::string sha256;
};

/// A refused or ended connection, or a search for the sonar.
struct Visit {
  std::string address, why;
  std::chrono::system_clock::time_point at = std::chrono::system_clock::now();
  std::chrono::steady_clock::time_point noted = std::chrono::steady_clock::now();  // steady time of the visit
  bool by_itself = false, without_ping = false;
  std::optional<std::chrono::steady_clock::time_point> connected_at = {};  // start of a connection that ended
};

class Device final : public SessionParent {
 public:
  Device(DeviceNetwork& network, Sonar::Surroundings around, const SonarConfig& config, std::uint32_t index,
         DeviceParent& parent);
  ~Device() override;

  /// Opens the vendor's ports, then the port for observers. Errors name the address and the next step.
  Result<void> open();
  void start();
  /// Stops accepting clients and making pings, and ends every connection with FIN after its current message.
  void stop(const std::string& why = "sonard stops");

  // Called in stepped time.
  void step() { perform(sonar_.tick_pacer(network_.clock.now())); }
  void tick_sessions() { perform(sonar_.tick_conversations(network_.clock.now())); }
  void skip(std::chrono::nanoseconds by) { sonar_.skip(by); }

  /// Carries out the sonar's actions, in order.
  void perform(Actions actions);

  bool gone() const;  // after stop(): no connection and no ping is left
  const Sonar& sonar() const { return sonar_; }
  Preview& preview() { return preview_; }
  const Preview& preview() const { return preview_; }
  const SonarConfig& config() const { return sonar_.config(); }
  DeviceFigures figures() const { return sonar_.figures(); }
  std::vector<StreamDigest> digests() const;
  /// Returns the address of the vendor's first TCP port; port 0 if there is none.
  Endpoint data_endpoint() const;
  std::vector<udp::endpoint> status_destinations() const { return beacon_.destinations(); }
  std::vector<protocol::DriverAddress> addresses() const;

  // Control (device_control.cpp).
  v1::SonarStatus status(Time now) const;
  v1::PingEvent event_of(const PingQueued& queued) const;
  /// Returns the properties that recordings need.
  RecordedSonar recorded() const;
  /// Returns a sentence about a problem, or an empty text.
  std::string problem() const;
  /// Changes settings as a client would. An error states what the product can do; the settings then do not change.
  Result<void> ask(const control::SetSonar& asked, const std::string& who);
  /// Uses vehicle and mount of `config`, which is otherwise equal to the present configuration.
  void use_place(const SonarConfig& config) { sonar_.move(config, network_.clock.now()); }
  void use_water(const Water& water);
  /// See Sonar::run_itself.
  void run_itself(bool on) {
    sonar_.run_itself(on, network_.clock.now());
    perform({});
  }
  void add_faults(const std::vector<Fault>& faults, bool manual) {
    perform(sonar_.add_faults(faults, manual, network_.clock.now()));
  }
  /// Ends the faults with this name, or all if it is empty. Returns false if there is none.
  bool end_faults(const std::string& name);
  /// Closes connections whose peer has disconnected. Called periodically, and before a client is admitted or refused, because
  /// the listener may run before the reader of the closed connection.
  void forget_who_left();

  std::size_t on_bytes(ConnectionId from, protocol::BytesView bytes) override;
  Outbox::Message next_message(ConnectionId to) override { return sonar_.next_message(to, network_.clock.now()); }
  std::vector<Endpoint> receivers(ConnectionId stream) override;
  void on_sent(ConnectionId to, std::size_t bytes) override { sonar_.on_sent(to, bytes); }
  void on_written(ConnectionId to, const Outbox::Message& message) override;
  void on_not_sent(ConnectionId stream) override;
  std::optional<std::chrono::milliseconds> longest_silence(ConnectionId of) const override;
  void look_for_host(ConnectionId stream) override;
  void on_finish(ConnectionId session) override { perform(sonar_.finish(session, network_.clock.now())); }
  void on_fault(const std::string& what) override;
  void on_send_error(const Endpoint& to, const std::string& why) override;
  void on_over(ConnectionId session, const std::string& why, bool by_client) override;

 private:
  using SessionPointer = std::shared_ptr<Session>;
  using StreamPointer = std::shared_ptr<DatagramStream>;
  struct Arrived {  // a connection without a session
    tcp::socket socket;
    Admission::Place place;
    Role role = Role::client;
  };
  struct TcpPort {
    TcpPort(const protocol::Port* p, Listener l) : port(p), listener(std::move(l)) {}
    const protocol::Port* port;
    Listener listener;
  };

  Result<void> open(const protocol::Port& port);
  Result<DatagramPort*> datagram_port(std::uint16_t number);
  Result<void> open_observers();
  using OnAdmitted = std::function<void(tcp::socket)>;
  void admit(tcp::socket socket, OnAdmitted serve);
  asio::awaitable<void> serve_later(tcp::socket socket, std::chrono::steady_clock::duration pause, OnAdmitted serve);
  void on_client_socket(tcp::socket socket, const protocol::Port& port);
  std::optional<std::vector<protocol::Bytes>> on_limited_datagram(const Endpoint& from, protocol::BytesView datagram,
                                                                  const std::function<std::vector<protocol::Bytes>()>& act);
  void on_host_datagram(DatagramPort& at, const protocol::Port& port, const Endpoint& from, protocol::BytesView datagram);
  StreamPointer host_of(const protocol::Port& port) const;
  void on_host_closed(const protocol::Port& port, const Endpoint& host);
  void on_receiver_closed(const Endpoint& receiver);
  StreamPointer begin_dialogue(DatagramPort& at, const protocol::Port& port, Peer host);
  void on_arrival(tcp::socket socket, Admission::Place place, Role role, const protocol::Port* port);
  asio::awaitable<void> refuse(tcp::socket socket, Admission::Place place);
  void arm();
  void report_visit(Role role, VisitLog::Kind kind, const std::string& what, std::vector<LogField> fields);
  SessionPointer session_of(ConnectionId id) const;
  StreamPointer stream_of(ConnectionId id) const;

  void carry_out(ComputePing& action);
  void carry_out(const Serve& action);
  void carry_out(const KeepWaiting& action);
  void carry_out(const Refuse& action);
  void carry_out(const Listen& action);
  void carry_out(const ReadFrom& action);
  void carry_out(const EndPauses& action);
  void carry_out(const Wake& action);
  void carry_out(const Finish& action);
  void carry_out(const Reset& action);
  void carry_out(const Closed& action);
  void carry_out(const Announce&) { beacon_.send_now(); }
  void carry_out(const PingQueued& action);
  void carry_out(const Report& action);
  void carry_out(const EngineFailed& action) { parent_.on_engine_failure(action.why); }

  DeviceNetwork& network_;
  DeviceParent& parent_;
  const LimitConfig& limits_;
  const std::vector<std::string>& hosts_;  // host names that HTTP requests may use
  Sonar sonar_;
  Preview preview_;
  RecentRate made_;
  std::list<TcpPort> tcp_ports_;
  Listener observer_listener_;
  Beacon beacon_;
  std::list<DatagramPort> datagram_ports_;
  std::list<SonarHttp> http_;
  asio::steady_timer timer_;
  std::optional<std::chrono::steady_clock::time_point> timer_at_;

  ConnectionId last_connection_ = 0;
  std::map<ConnectionId, Arrived> arrived_;  // connections that wait for a verdict or a slot
  std::list<SessionPointer> sessions_;
  std::list<StreamPointer> streams_;
  std::list<std::pair<Endpoint, std::chrono::steady_clock::time_point>>
      closed_;                                           // receivers that were unreachable, with the time of the next attempt
  int refusing_ = 0, waiting_ = 0;                       // numbers of connections
  std::optional<Visit> refused_, gone_, searched_;       // the last visit of each kind
  std::chrono::steady_clock::time_point closing_since_;  // time at which the connection that ends now had connected
  std::string silenced_by_;

  bool started_ = false, stopping_ = false;
  std::array<LogLimiter, static_cast<std::size_t>(Report::Topic::topics)> limiters_;
  std::size_t datagram_work_ = 0;  // work for the present datagram, besides its bytes
  LogLimiter faults_, observer_visits_, send_errors_, storms_;
  VisitLog visits_;
  std::vector<StreamDigest> digests_;
};

}  // namespace sonar
