// The daemon's sonars: a Device for each, and the Devices that are closing after a reload. App owns the fleet. A sonar that a
// reload does not change continues with its clients and keeps its index, which is part of the key of random numbers. The fleet
// passes requests, pings and events of the sonars to the simulator, recordings and subscribers.
#pragma once

#include <functional>
#include <list>
#include <map>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/server/api/events.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/sonars/device.hpp"

namespace sonar {

class Fleet final : public DeviceParent {
 public:
  struct Handlers {
    std::function<void()> on_change;  // called after a change for which stepped time or the shutdown may wait
    std::function<void(const Error& why)> on_engine_failure;  // called when the daemon must end
    /// Called for each ping of a range finder; the distance is absent if a fault withholds the ping.
    std::function<void(const SonarConfig& of, const PingQueued& ping)> on_distance = {};
  };
  /// The arguments must outlive the fleet.
  Fleet(DeviceNetwork network, const Config& config, const World& world, Simulator& simulator, Recordings& recordings,
        Events& events, FaultJournal& faults, Handlers handlers)
      : network_(network),
        around_{config, world, &faults},
        simulator_(simulator),
        recordings_(recordings),
        events_(events),
        handlers_(std::move(handlers)) {}

  /// Opens the listeners of all sonars of the configuration. Errors name the address and the next step.
  Result<void> open(const Config& config);
  void start();
  void stop();

  struct Change {
    std::string summary;  // such as "front untouched, left changed, right added"
    std::vector<const Device*> opened;
    std::vector<std::string> errors;  // errors of sonars that could not be opened; the previous sonar continues if possible
  };
  /// Stops, starts and keeps sonars according to the configuration `next`. The World must already have its vehicles.
  Change take_over(const Config& now, const Config& next);

  /// Erases stopped sonars without work in progress. Call it periodically.
  void sweep();

  const std::list<Device>& devices() const { return devices_; }
  std::list<Device>& devices() { return devices_; }
  Device* find(const std::string& name);
  const Device* find(const std::string& name) const { return const_cast<Fleet*>(this)->find(name); }
  /// Called with each ping that is queued for clients; empty = none.
  using PingTap = std::function<void(const Device& of, const PingQueued& ping)>;
  /// `wants_truth` returns whether the tap needs the ground truth of a sonar's next ping.
  using WantsTruth = std::function<bool(const std::string& sonar)>;
  void tap_pings(PingTap tap, WantsTruth wants_truth = {}) {
    tap_ = std::move(tap);
    tap_wants_truth_ = std::move(wants_truth);
  }
  /// Computes a ping of a Preview, which drivers and recordings do not get.
  void compute_preview(PingRequest request, Simulator::Done done) { simulator_.submit(std::move(request), std::move(done)); }
  bool gone() const;  // after stop(): no device has work left
  std::uint64_t served() const;
  bool has_clients() const;
  /// Returns a sentence about a problem, or an empty text.
  std::string problem() const;

 private:
  struct Retired {
    std::list<Device> device;  // exactly one
    int sweeps_gone = 0;
  };
  struct Opening {
    const SonarConfig* sonar = nullptr;
    std::uint32_t index = 0;
    std::list<Device>::iterator before;  // the device that it replaces, or end()
  };
  /// The effect of the reload on each sonar, as a word in the summary. Key: name of the sonar.
  using Outcomes = std::map<std::string, std::string>;
  bool is_held(Ipv4 ip) const;
  std::vector<Opening> sort_out(const Config& now, const Config& next, Outcomes& outcomes);
  void stay(std::list<Device>::iterator device, const Config& now, const Config& next);
  std::uint32_t free_index(std::size_t wanted, const std::vector<Opening>& given) const;
  void retire(std::list<Device>::iterator device);
  bool add(const SonarConfig& sonar, std::uint32_t index, Change& change);

  void compute(const Device& of, PingRequest request, Simulator::Done done) override;
  void on_ping_queued(const Device& of, const PingQueued& ping) override;
  void on_client(const Device& of, const std::string& peer, bool connected, const std::string& why) override;
  void on_stop(const Device& of, const std::string& why) override { recordings_.end_of(of.config().name, why); }
  void on_change() override { handlers_.on_change(); }
  void on_engine_failure(const Error& why) override { handlers_.on_engine_failure(why); }

  DeviceNetwork network_;
  Sonar::Surroundings around_;
  Simulator& simulator_;
  Recordings& recordings_;
  Events& events_;
  Handlers handlers_;
  PingTap tap_;
  WantsTruth tap_wants_truth_;
  std::map<std::uint32_t, std::shared_ptr<const SceneNames>>
      computed_names_;         // key: index of the sonar; names of the scene in which its ping is computed
  std::list<Device> devices_;  // in the configuration's order
  std::list<Retired> retired_;
  std::uint64_t served_before_ = 0;   // pings served by erased devices
  std::vector<std::string> missing_;  // errors of sonars that could not be opened
};

}  // namespace sonar
