// Reads the configuration again when asked to: the file is read and its scene built on the scene thread, then everything changes
// at once on the I/O thread. Owned by App; I/O thread only.
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
  /// Shortest time from the beginning of one reload to that of the next, however often it is asked for.
  static constexpr std::chrono::milliseconds pause{500};

  /// Steps of a reload, in this order.
  struct Steps {
    std::function<void()> begin;
    std::function<Result<Config>()> read_config;  // any thread; empty: there is no configuration file
    LoadScene load_scene;
    std::function<void(Config next)> take_over;  // the new scene is in use; not called after an error
    std::function<void()> end;
  };
  Reload(asio::io_context& io, SceneChanges& changes, Log& log, Steps steps)
      : changes_(changes), log_(log), steps_(std::move(steps)), timer_(io) {}

  /// Begins now or after the pause; many requests are as good as two: one now, one for all that come before the pause is over.
  void request();
  void stop();

 private:
  void begin();

  SceneChanges& changes_;
  Log& log_;
  Steps steps_;
  asio::steady_timer timer_;
  int under_way_ = 0;   // begun, or waiting for one that is under way
  bool waits_ = false;  // for the pause to be over
  bool stopped_ = false;
  std::chrono::steady_clock::time_point not_before_{};
};

}  // namespace sonar
