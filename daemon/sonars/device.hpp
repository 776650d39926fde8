// One emulated sonar: its listener, its clients, its settings and its rhythm, and the beacon that announces it.
// Owned by App; asks the World where it is and the Simulator for pings. I/O thread only.
#pragma once

#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/sonar/gain_assist.hpp"
#include "daemon/config/config.hpp"
#include "daemon/engine/simulator.hpp"
#include "daemon/operations.hpp"
#include "daemon/recording/recordings.hpp"
#include "daemon/sonars/admission.hpp"
#include "daemon/sonars/datagram_answers.hpp"
#include "daemon/sonars/metrics.hpp"
#include "daemon/sonars/observers.hpp"
#include "daemon/sonars/pacer.hpp"
#include "daemon/sonars/rate_watch.hpp"
#include "daemon/sonars/session.hpp"
#include "daemon/sonars/visit_log.hpp"
#include "daemon/system/asio.hpp"
#include "daemon/system/log.hpp"
#include "daemon/time/clock.hpp"
#include "daemon/world/world.hpp"

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

  /// Binds the TCP listener, then the socket of the beacon. Errors name the address and the next step.
  Result<void> open();
  void start();
  /// Stop accepting, stop pinging, let every client have its current message whole and a FIN.
  void stop(const std::string& why = "sonard stops");

  // Stepped time: App asks and tells.
  std::optional<Time> next_tick() const;
  /// When a conversation has something to do next, and when one will ask for a ping by itself.
  std::optional<Time> next_talk() const;
  std::optional<Time> next_wish() const;
  bool settled() const;  // no ping under way, every client has taken what it was sent
  void step(Time now);
  void tick_sessions();
  /// The clock jumps ahead: time that nobody lived.
  void skip(std::chrono::nanoseconds by);

  bool gone() const;  // after stop(): nothing is left
  const SonarConfig& config() const { return config_; }
  DeviceFigures figures() const;
  /// Of those: pings that at least one client has got.
  std::uint64_t served() const { return figures_.served; }
  /// Of those: pings that were made.
  std::uint64_t pings() const { return figures_.pings; }
  std::vector<StreamDigest> digests() const;
  tcp::endpoint data_endpoint() const;
  std::vector<udp::endpoint> status_destinations() const { return status_to_; }
  const protocol::DeviceState& state() const { return state_; }
  PingSettings initial_settings() const { return vendor_.initial_settings(state_).settings; }
  std::uint32_t index() const { return index_; }

  // What control may ask (device_control.cpp).
  control::SonarStatus status(Time now) const;
  /// As recordings name it.
  RecordedSonar recorded() const;
  /// Empty when all is well.
  std::string trouble() const;
  /// As one more client would have; nothing is changed when it is refused, with a sentence that says what the product can do.
  Result<void> ask(const control::SetSonar& asked, const std::string& who);
  /// Vehicle and mount, of a configuration that is else the same.
  void use_place(const SonarConfig& config);
  void use_water(const Water& water);
  /// Visitors that wait for a place and have hung up. Now and then, and before a place is given or refused.
  void forget_who_left();

  void on_event(Session& from, const protocol::Event& event) override;
  void on_written(Session& by, const Outbox::Message& message) override;
  void on_fault(Session& session, const std::string& what) override;
  void on_over(Session& session, const std::string& why) override;

 private:
  using SessionPointer = std::shared_ptr<Session>;

  void keep_accepting();
  void keep_announcing();
  asio::awaitable<void> accept();
  asio::awaitable<void> turn_away(tcp::socket socket, Admission::Place place);
  asio::awaitable<void> announce();
  void admit(tcp::socket socket, Admission::Place place);
  void say_fault(const std::string& what);
  void welcome(tcp::socket socket, Admission::Place place);
  void on_membership();
  void use_initial_settings();
  void change_settings(const protocol::ChangeSettings& change, const std::string& who);
  void tell_of_ping(const Ping& ping, double simulation_s) const;
  void record(const Simulator::Outcome& outcome, const std::shared_ptr<const protocol::Bytes>& bytes, Time now) const;
  void tell_of_client(const Session& session, bool connected, const std::string& why) const;
  void arm();
  void on_timer();
  bool wants_pings() const;
  bool waits_for_pose(Time at) const;
  std::optional<Time> earliest(std::optional<Time> (Session::*of)() const) const;
  void ping(Time at);
  PingNumber next_number();
  void on_ping(Simulator::Outcome outcome);
  void note_water(const PingRequest& computed);
  void update_state(Time now);
  void keep_figures_of(const Session& session);

  DeviceContext& context_;
  SonarConfig config_;
  const protocol::Vendor& vendor_;
  std::uint32_t index_;
  protocol::DeviceState state_;

  tcp::acceptor acceptor_;
  udp::socket beacon_;
  asio::steady_timer beacon_timer_, ping_timer_;
  DatagramAnswers answers_;
  Observers observers_;
  std::chrono::milliseconds beacon_period_{0};
  std::vector<udp::endpoint> status_to_;

  std::list<SessionPointer> sessions_;  // oldest first
  std::list<SessionPointer> leaving_;   // no longer counted as clients, still taking their last message
  struct Waiting {
    tcp::socket socket;
    Admission::Place place;
  };
  std::list<Waiting> queue_;  // connected, waiting for a place
  int turning_away_ = 0;

  Pacer pacer_;
  PingSettings settings_;
  GainAssist gain_assist_;
  std::uint64_t settings_id_ = 0;
  std::uint64_t under_way_settings_id_ = 0;            // of the ping that is being made
  bool under_way_blank_ = false;                       // so asked for
  std::shared_ptr<const SceneNames> under_way_names_;  // of the scene it is made in
  std::uint64_t oldest_wanted_id_ = 0;                 // pings of settings before it belong to clients that have gone
  std::map<std::uint64_t, protocol::Bytes> requests_;  // settings_id -> the client's own bytes, echoed in its pings
  bool asked_ = false;                                 // a client that is still connected has sent settings
  std::uint32_t ping_number_ = 0;
  std::uint64_t numbered_skips_ = 0;  // ticks that an overload has cost, as of the last ping
  bool transmits_ = true;             // as far as control is concerned
  bool in_air_ = false;               // at the last ping
  std::chrono::steady_clock::time_point air_said_{};
  bool busy_ = false, started_ = false, stopping_ = false, beacon_failed_ = false;

  DeviceFigures figures_;
  LogLimiter refusals_, changes_, notices_, faults_;
  VisitLog visits_;
  RateWatch rate_watch_;
  struct {
    std::uint32_t ping = 0;
    Time tick{}, at{};
  } last_served_;
  std::vector<StreamDigest> digests_;
};

}  // namespace sonar
