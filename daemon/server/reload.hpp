// Reads the configuration again on request. The scene thread reads the file and builds the scene; then the I/O thread changes
// everything in one step. App owns the object, and only the I/O thread uses it.
#pragma once

#include <chrono>
#include <functional>

#include "daemon/config/config.hpp"
#include "daemon/server/engine/scene_changes.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

class Reload {
 public:
  /// Shortest time between the beginnings of two reloads.
  static constexpr std::chrono::milliseconds pause{500};

  /// Steps of a reload, in this order.
  struct Steps {
    std::function<void()> begin;
    std::function<Result<Config>()> read_config;  // may be called on any thread; empty: there is no configuration file
    LoadScene load_scene;
    std::function<void(Config next)> take_over;  // called when the new scene is in use, but not after an error
    std::function<void()> end;
  };
  Reload(asio::io_context& io, SceneChanges& changes, Log& log, Steps steps)
      : changes_(changes), log_(log), steps_(std::move(steps)), timer_(io) {}

  /// Begins a reload, now or after the pause. All requests until then cause only one reload.
  void request();
  void stop();

 private:
  void begin();

  SceneChanges& changes_;
  Log& log_;
  Steps steps_;
  asio::steady_timer timer_;
  int under_way_ = 0;   // number of reloads that run or wait for the running one
  bool waits_ = false;  // true: a reload waits for the end of the pause
  bool stopped_ = false;
  std::chrono::steady_clock::time_point not_before_{};
};

}  // namespace sonar
