// The whole daemon, top down: the world, the pose listeners and one Device per sonar, run by one I/O thread until told to stop.
// main.cpp and the tests make one; the engine factory is the seam where tests put a fake one.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/admission.hpp"
#include "daemon/asio.hpp"
#include "daemon/clock.hpp"
#include "daemon/config.hpp"
#include "daemon/device.hpp"
#include "daemon/log.hpp"
#include "daemon/notify.hpp"
#include "daemon/pose_server.hpp"
#include "daemon/simulator.hpp"
#include "daemon/start_engine.hpp"
#include "daemon/world.hpp"

namespace sonar {

struct AppOptions {
  std::uint64_t exit_after_pings = 0;  // served, over all sonars; 0 = never
  bool digest = false;                 // SHA-256 of every client's stream
  bool handle_signals = false;         // SIGINT and SIGTERM stop gracefully, a second one at once; SIGHUP does nothing yet
  NotifyPlace service_manager;         // is told when we are ready, stop, and that we are alive
};

class App {
 public:
  App(Config config, std::shared_ptr<const Scene> scene, const EngineFactory& make_engine, AppOptions options, Log& log);

  /// Opens every listener; errors name the address and the next step.
  Result<void> open();
  /// Serves until stopped; returns 0, or an exit code when the engine failed.
  int run();
  /// From any thread.
  void request_stop();

  const Config& config() const { return config_; }
  const Scene& scene() const { return *scene_; }
  const PingEngine& engine() const { return simulator_.engine(); }
  const PoseServer& poses() const { return pose_server_; }
  const std::deque<Device>& devices() const { return devices_; }
  const Admission& admission() const { return admission_; }
  /// After run().
  const World& world() const { return world_; }

 private:
  void stop(const std::string& why);
  void on_change();
  void look();  // after a change: end, or take the next step of stepped time
  void step_time();
  bool enough_served() const;
  void wait_for_signal();
  std::string status_line() const;
  asio::awaitable<void> keep_house();

  Config config_;
  std::shared_ptr<const Scene> scene_;
  AppOptions options_;
  Log& log_;
  asio::io_context io_{1};
  Clock clock_;
  World world_;
  Simulator simulator_;
  Admission admission_;
  PoseServer pose_server_;
  DeviceContext context_;
  std::deque<Device> devices_;
  asio::signal_set signals_;
  asio::steady_timer house_timer_;
  Notify notify_;
  bool look_posted_ = false, stopping_ = false;
  int exit_code_ = 0;
};

}  // namespace sonar
