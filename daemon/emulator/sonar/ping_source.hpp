// Manages the settings and pings of an emulated sonar: the time of each ping, the request to the engine, and the effect of the
// result on the device.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/sonar/gain_assist.hpp"
#include "daemon/emulator/connections/pacer.hpp"
#include "daemon/emulator/sonar/audience.hpp"
#include "daemon/emulator/sonar/sonar_data.hpp"

namespace sonar {

// Detects that a sonar does not reach the requested rate because pings take too long to compute. PingSource passes the figures
// and gets one sentence to report.

class RateWatch {
 public:
  /// Call it after each ping. `ticks`: ticks since the start; `busy`: SkippedTicks::busy; `ping_s`: computing time of
  /// this ping; `rate_hz`: rate of the ticks; `has_others`: other sonars use the same engine. Returns a sentence at most once.
  std::optional<std::string> look(std::uint64_t ticks, std::uint64_t busy, double ping_s, double rate_hz, bool has_others);

 private:
  void begin(std::uint64_t ticks, std::uint64_t busy, double rate_hz);

  bool warned_ = false;
  int to_pass_over_ = 5;  // number of first pings to ignore, which take longer because they fill caches
  double rate_hz_ = 0;
  std::uint64_t ticks_before_ = 0, busy_before_ = 0;
  int pings_ = 0;
  double ping_s_ = 0, longest_s_ = 0;  // computing time of the counted pings: sum and longest
};

class PingSource {
 public:
  /// The arguments must outlive the object.
  PingSource(SonarData& sonar, Audience& audience, const Faults& faults);

  // ---- settings

  const PingSettings& settings() const { return settings_; }
  /// Returns the client that last changed the settings; empty if no client did.
  const std::string& asked_by() const { return asked_by_; }
  /// Call it when the last client has left: drops pings that were requested, and restores the initial settings unless the device
  /// keeps its settings.
  void forget_clients();
  /// Applies settings. `who`: the client, for the log and asked_by(); empty = the device itself.
  void change_settings(const protocol::ChangeSettings& change, const std::string& who, Time now, Actions& actions);
  /// Sets whether the sonar transmits. Returns whether the value changed.
  bool set_transmit(bool on) { return std::exchange(transmits_, on) != on; }
  bool transmits() const { return transmits_; }
  void use_water(const Water& water, Time now);

  // ---- when pings are due

  bool wants_pings() const;
  /// Sets whether the sonar pings without a client, at the rate of its settings.
  void run_itself(bool on, Time now);
  /// True while the sonar pings without a client.
  bool runs_itself() const { return runs_itself_ && !audience_.stopping() && !audience_.has_audience(); }
  /// Starts or stops the pacer: it runs while pings are requested, at the requested rate times the factor of faults.
  void update_pacer(Time now);
  const Pacer& pacer() const { return pacer_; }
  std::optional<Time> next_ping() const;
  /// True if the vehicle's poses are stale and the configuration forbids pings with stale poses.
  bool waits_for_pose(Time at) const;
  /// Requests one ping now. With `joins`, a ping with these settings that is being computed serves this request too.
  void trigger(const protocol::RequestPing& request, Time now);
  Actions tick(Time now);
  void skip(std::chrono::nanoseconds by) { pacer_.skip(by); }
  void stop() {
    pacer_.stop();
    drop_unsent();
  }
  // Effects of faults.
  void forget_settings(Time now);
  /// Restarts the device's clock. Unless `clock_only`, ping numbers begin at 1 again and the settings become the initial ones.
  void restart(bool clock_only, Time now);
  void override_settings(const protocol::SettingsOverride& wanted, Time now, Actions& actions);

  // ---- pings

  /// True while a ping is being computed.
  bool busy() const { return busy_; }
  /// See Sonar::preview_request.
  std::optional<PingRequest> preview_request(PingNumber number, Time at) const;
  /// Handles the engine's result. Returns whether clients get the ping.
  bool on_ping(const PingOutcome& outcome, Time now, Actions& actions);
  /// Requests the ping of a tick that has waited for the last ping. Call it after the delivery of the last ping.
  void catch_up(Actions& actions);
  /// Keeps a ping that a slow device sends later. Returns false if the ping must be sent now.
  bool keep_unsent(PingOutcome& outcome, Time now);
  std::optional<Time> next_unsent() const;
  /// Returns the next kept ping that is due.
  std::optional<PingOutcome> take_unsent(Time now);

 private:
  void use_initial_settings();
  /// Drops the pings that were requested and not sent yet.
  void drop_pings();
  PingRequest request_at(Time at, const protocol::RequestPing& aim) const;
  void request_ping(Time at, Actions& actions);
  PingNumber next_number();
  /// Drops pings that wait to be sent, because the clients that requested them have left.
  void drop_unsent();
  void follow_water();
  void note_water(const PingRequest& computed, Time now, Actions& actions);

  SonarData& sonar_;
  Audience& audience_;
  const Faults& faults_;

  Pacer pacer_;
  PingSettings settings_;
  protocol::RequestPing aim_;  // the last request
  GainAssist gain_assist_;
  bool asked_ = false;  // true: settings were requested since the first client or receiver connected
  std::string asked_by_;
  bool transmits_ = true, runs_itself_ = false;

  // The ping that is being computed.
  bool busy_ = false;
  std::shared_ptr<const VendorSettings> busy_settings_;
  bool busy_blank_ = false;     // true: the request was for noise only
  bool busy_unwanted_ = false;  // true: the clients that requested the ping have left

  std::deque<std::pair<Time, PingOutcome>> unsent_;  // in the order of the times at which a slow device sends them

  std::uint32_t ping_number_ = 0;
  std::uint64_t numbered_skips_ = 0;  // ticks lost to overload before the last ping
  bool in_air_ = false;               // true: the sonar was above the water at the last ping
  std::optional<Time> air_reported_;
  RateWatch rate_watch_;
};

}  // namespace sonar
