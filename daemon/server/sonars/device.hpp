// The network side of one emulated sonar: its listeners for clients and observers, its status broadcast, its timer. Bytes go to
// the Sonar, whose Actions it carries out. Owned by Fleet. I/O thread only.
#pragma once

#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/sonar/sonar.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/engine/simulator.hpp"
#include "daemon/server/operations.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/sonars/admission.hpp"
#include "daemon/server/sonars/datagram_answers.hpp"
#include "daemon/server/sonars/session.hpp"
#include "daemon/server/sonars/visit_log.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/time/clock.hpp"

namespace sonar {

/// What all devices share; outlives them.
struct DeviceContext {
  asio::io_context& io;
  Clock& clock;
  World& world;
  Simulator& simulator;
  Admission& admission;
  Log& log;
  const Config& config;
  Events& events;
  Recordings& recordings;
  bool digest = false;
  std::function<void()> on_change;                   // something stepped time or the end may have waited for
  std::function<void(const Error& why)> on_failure;  // the engine failed: the daemon cannot go on
};

struct StreamDigest {
  std::uint64_t client = 0, bytes = 0;
  std::string sha256;
};

class Device final : public SessionParent {
 public:
  Device(DeviceContext& context, const SonarConfig& config, std::uint32_t index);
  ~Device() override;

  /// Binds the TCP listeners, then the socket of the status broadcast. Errors name the address and the next step.
  Result<void> open();
  void start();
  /// Stop accepting, stop pinging, let every client have its current message whole and a FIN.
  void stop(const std::string& why = "sonard stops");

  // Stepped time.
  void step() { perform(sonar_.tick_pacer(context_.clock.now())); }
  void tick_sessions() { perform(sonar_.tick_conversations(context_.clock.now())); }
  void skip(std::chrono::nanoseconds by) { sonar_.skip(by); }

  bool gone() const;  // after stop(): nothing is left
  const Sonar& sonar() const { return sonar_; }
  const SonarConfig& config() const { return sonar_.config(); }
  DeviceFigures figures() const { return sonar_.figures(); }
  std::vector<StreamDigest> digests() const;
  tcp::endpoint data_endpoint() const;
  std::vector<udp::endpoint> status_destinations() const { return status_to_; }

  // Control (device_control.cpp).
  control::SonarStatus status(Time now) const;
  /// As recordings name it.
  RecordedSonar recorded() const;
  /// Empty when all is well.
  std::string trouble() const;
  /// As one more client would; nothing is changed when it is refused, with a sentence that says what the product can do.
  Result<void> ask(const control::SetSonar& asked, const std::string& who);
  /// Vehicle and mount, of a configuration that is otherwise the same.
  void use_place(const SonarConfig& config) { sonar_.move(config, context_.clock.now()); }
  void use_water(const Water& water);
  /// Closes connections whose peer has hung up. Now and then, and before a slot is given or refused: the listener may be ready
  /// before the reader of the one that left.
  void forget_who_left();

  void on_bytes(Session& from, protocol::BytesView bytes) override;
  Outbox::Message next_message(Session& to) override { return sonar_.next_message(to.id()); }
  void on_sent(Session& to, std::size_t bytes) override { sonar_.on_sent(to.id(), bytes); }
  void on_written(Session& to, const Outbox::Message& message) override;
  std::optional<std::chrono::milliseconds> longest_silence(const Session& of) const override;
  void on_finish(Session& session) override { sonar_.finish(session.id()); }
  void on_fault(Session& session, const std::string& what) override;
  void on_over(Session& session, const std::string& why) override;

 private:
  using SessionPointer = std::shared_ptr<Session>;
  struct Arrived {  // has no session yet
    tcp::socket socket;
    Admission::Place place;
    Role role = Role::client;
  };

  Result<void> open_observers();
  void keep_accepting(asio::awaitable<void> (Device::*accept)());
  asio::awaitable<void> accept_clients();
  asio::awaitable<void> accept_observers();
  void on_arrival(tcp::socket socket, Admission::Place place, Role role);
  asio::awaitable<void> turn_away(tcp::socket socket, Admission::Place place);
  void keep_announcing();
  asio::awaitable<void> announce();
  void arm();
  void report_fault(const std::string& what);
  void report_visit(Role role, VisitLog::Kind kind, const std::string& what, std::vector<LogField> fields);
  SessionPointer session_of(ConnectionId id) const;

  void perform(Actions actions);
  void carry_out(ComputePing& action);
  void carry_out(const Serve& action);
  void carry_out(const KeepWaiting& action);
  void carry_out(const TurnAway& action);
  void carry_out(const Wake& action);
  void carry_out(const Finish& action);
  void carry_out(const Reset& action);
  void carry_out(const Closed& action);
  void carry_out(const PingQueued& action);
  void carry_out(const Report& action);
  void carry_out(const EngineFailed& action);
  void publish_client(const std::string& peer, bool connected, const std::string& why) const;
  void publish_ping(const PingQueued& queued) const;

  DeviceContext& context_;
  Sonar sonar_;
  tcp::acceptor acceptor_, observer_acceptor_;
  udp::socket beacon_;
  asio::steady_timer beacon_timer_, timer_;
  std::optional<std::chrono::steady_clock::time_point> timer_at_;
  DatagramAnswers answers_;
  std::chrono::milliseconds beacon_period_{0};
  std::vector<udp::endpoint> status_to_;
  Endpoint observers_at_;

  ConnectionId last_connection_ = 0;
  std::map<ConnectionId, Arrived> arrived_;  // being decided upon, or waiting for a slot
  std::list<SessionPointer> sessions_;
  int turning_away_ = 0;

  std::shared_ptr<const SceneNames> computed_names_;  // of the scene the ping is computed in
  bool started_ = false, stopping_ = false, beacon_failed_ = false;
  std::array<LogLimiter, static_cast<std::size_t>(Report::Topic::topics)> limiters_;
  LogLimiter faults_, observer_visits_;
  VisitLog visits_;
  std::vector<StreamDigest> digests_;
};

}  // namespace sonar
