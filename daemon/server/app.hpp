// The whole daemon: the world, the pose listeners and a Device for each sonar, run by one I/O thread until it must stop. `sonard
// run` and the tests create one; tests pass a factory of fake engines.
#pragma once

#include <functional>
#include <list>
#include <string>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/control/control_server.hpp"
#include "daemon/server/engine/scene_changes.hpp"
#include "daemon/server/engine/simulator.hpp"
#include "daemon/server/engine/start_engine.hpp"
#include "daemon/server/faults/fault_log.hpp"
#include "daemon/server/operations/app_operations.hpp"
#include "daemon/server/poses/mavlink_server.hpp"
#include "daemon/server/poses/pose_intake.hpp"
#include "daemon/server/poses/pose_server.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/reload.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/stepper.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/system/notify.hpp"
#include "daemon/server/view/view_feed.hpp"

namespace sonar {

struct AppOptions {
  std::uint64_t exit_after_pings = 0;  // stop after this many served pings of all sonars; 0 = never
  bool digest = false;                 // true: computes the SHA-256 of every client's stream
  bool handle_signals = false;  // SIGINT and SIGTERM stop gracefully, a second signal at once; SIGHUP reloads the configuration
  /// Reads the configuration again and applies the options of the command line; any thread may call it. Empty if there is no
  /// configuration file (the demo).
  std::function<Result<Config>()> read_config;
  LoadScene load_scene;
  NotifyTarget service_manager;  // gets a message when the daemon is ready, when it stops and, periodically, while it is alive
};

class App {
 public:
  /// run() returns within this time after stop(), even if a ping or a scene is still being computed; only the writing of files
  /// may take longer. The rest of the documented 2 s is a margin for a busy machine.
  static constexpr std::chrono::milliseconds stop_limit{1100};

  /// `make_engine` is copied, and also makes the engines of later scenes, on another thread. Objects to which it refers must
  /// outlive the App.
  App(Config config, ScenePointer scene, const EngineFactory& make_engine, AppOptions options, Log& log);

  /// Opens every listener; errors name the address and the next step.
  Result<void> open();
  /// Serves until stopped. Returns 0, or an exit code if the engine failed.
  int run();
  /// May be called from any thread.
  void request_stop();
  /// Runs `work` on the I/O thread. May be called from any thread.
  void post(std::function<void()> work) { asio::post(io_, std::move(work)); }

  const Config& config() const { return config_; }
  const Scene& scene() const { return *changes_.scene(); }
  const std::string& engine_description() const { return simulator_.engine_description(); }
  /// True if all requested files are written.
  bool files_are_written() const { return recordings_.idle() && writer_.idle(); }
  const PoseServer& poses() const { return pose_server_; }
  const MavlinkServer& mavlink() const { return mavlink_server_; }
  const ControlServer& control() const { return control_; }
  const std::list<Device>& devices() const { return fleet_.devices(); }
  /// For servers of the control protocol, on the I/O thread.
  Operations& operations() { return operations_; }
  Events& events() { return events_; }
  const ViewFeed& view() const { return view_; }
  const Admission& admission() const { return admission_; }
  /// Call it after run().
  const World& world() const { return world_; }

 private:
  void stop(const std::string& why);
  void on_change();
  void look();  // called after a change: ends the daemon, or makes the next step of stepped time
  bool enough_served() const;
  void log_new_notes();
  void run_range_finders();
  void wait_for_signal();
  Reload::Steps reload_steps();
  void take_over(Config next);  // applies a reloaded configuration
  std::string status_line() const;
  asio::awaitable<void> housekeeping();

  Config config_;
  AppOptions options_;
  Log& log_;
  asio::io_context io_{1};
  Clock clock_;
  Events events_;
  World world_;
  Plausibility plausibility_;
  SteppedTime stepped_time_;
  Simulator simulator_;
  WriterThread writer_;
  Recordings recordings_;
  SceneChanges changes_;
  Admission admission_;
  PoseIntake pose_intake_;
  PoseServer pose_server_;
  MavlinkServer mavlink_server_;
  FaultLog fault_log_;
  Fleet fleet_;
  Stepper stepper_;
  SceneOperations scene_operations_;
  SonarOperations sonar_operations_;
  TimeOperations time_operations_;
  Monitoring monitoring_;
  FaultOperations fault_operations_;
  AppOperations operations_;
  ViewFeed view_;
  ControlServer control_;
  asio::signal_set signals_;
  asio::steady_timer housekeeping_timer_, stop_timer_;
  Notify notify_;
  Reload reload_;
  bool look_posted_ = false, stopping_ = false;
  bool slow_load_logged_ = false, clock_note_logged_ = false;
  bool notes_due_ = true;  // the configuration or the scene has changed since notes were last logged
  int exit_code_ = 0;
};

}  // namespace sonar
