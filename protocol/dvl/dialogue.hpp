// The part that the dialogues in JSON and on the serial line share: the commands of clients, triggered pings and the times of
// reports.
#pragma once

#include <nlohmann/json.hpp>

#include "protocol/dvl/settings.hpp"
#include "protocol/held_settings.hpp"

namespace sonar::dvl {

using Json = nlohmann::ordered_json;

/// An outcome without an error is a success.
struct Outcome {
  Json result = nullptr;
  std::string error = {};
};
/// Carries out a command except trigger_ping, which is part of the session; commands that set values change `settings`. Returns
/// nullopt if there is no such command.
std::optional<Outcome> carry_out(const std::string& command, const Json& parameters, const protocol::DeviceState& device,
                                 Time now, Settings& settings);
/// Returns the answer to get_version_info. The version contains "sonard", so that a log shows that the device was emulated.
Json version_info(const protocol::DeviceState& device);
protocol::Bytes response_line(const std::string& to, const Outcome& outcome);

/// Every client gets all reports. With acoustics enabled the device pings without triggers, and trigger_ping is refused; with
/// acoustics disabled it pings only for triggers, of which each client has its own queue.
class Session : public protocol::Dialogue {
 public:
  /// `device` must outlive the object.
  Session(const protocol::DeviceState& device, Time now) : device_(device), due_(next_report_after(now)) {}

  protocol::Reaction on_tick(Time now, bool ping_pending) override;
  Time next_tick() const override { return due_; }
  void on_ping_queued(Time) override {}
  protocol::Delivery on_ping(const VendorSettings*, std::size_t, Time now) override;

 protected:
  /// Returns the report of dead reckoning with this stamp; empty = none.
  virtual protocol::Bytes position_report(Time stamp) const = 0;

  const protocol::DeviceState& device() const { return device_; }
  /// Returns the stamp of a ping that is fired now.
  Time stamp_of(Time now) const { return now + device_.skipped; }
  Settings settings() const { return settings_from(device_.settings.get()); }
  /// Returns the settings after the daemon has carried out `reaction`.
  Settings settings_after(const protocol::Reaction& reaction) const {
    return settings_from(protocol::settings_after(reaction, device_.settings.get()));
  }
  /// Executes a command and adds its events. Returns nullopt if the command is unknown.
  std::optional<Outcome> execute(const std::string& command, const Json& parameters, Time now, protocol::Reaction& reaction);

 private:
  static Time next_report_after(Time now);
  Outcome trigger(Settings s, Time now, protocol::Reaction& reaction);

  const protocol::DeviceState& device_;
  Time due_;             // time of the next report of dead reckoning
  int waiting_ = 0;      // triggered pings that this client has not received yet
  Time requested_at_{};  // time at which the first waiting ping was requested
};

}  // namespace sonar::dvl
