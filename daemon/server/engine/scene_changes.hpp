// Loads and changes the scene while pings continue. Changes are made in sequence: a separate thread makes the new scene and
// builds an engine, which then replaces the old engine. Waiting edits share one engine. App owns this object; all functions
// except Change::make are called on the I/O thread.
//
// Pings use the old scene until the new one is ready. Then the simulator gets the new engine and the world gets the new moving
// bodies in one step, so that the bodies of a request always belong to the scene with which it is computed. Stepped time waits
// for the new scene before its next step.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "daemon/config/scene_file.hpp"
#include "daemon/emulator/world/edit_scene.hpp"
#include "daemon/server/engine/simulator.hpp"
#include "daemon/server/engine/start_engine.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

/// May be called on any thread. Empty = scenes cannot be loaded.
using LoadScene = std::function<Result<ScenePointer>(const SceneFile&)>;

class SceneChanges {
 public:
  /// Called on the separate thread with the present scene; returns the new scene, or the present one if nothing changes.
  using Make = std::function<Result<ScenePointer>(const ScenePointer& now)>;
  struct Change {
    Make make;  // empty: the change only waits for earlier changes
    /// Called on the I/O thread when the new scene is in use, or if nothing was changed. Never called after stop().
    std::function<void(const Result<void>& outcome)> done;
    bool shares_engine = false;  // true: shares an engine with other such changes; `done` is called when all are in use
  };
  /// Called when a new scene is in use, before its Change is done.
  using InUse = std::function<void(const ScenePointer& scene)>;
  static constexpr std::size_t most_waiting = 64;
  /// Limits while drivers are served, because with each new engine a driver at 40 Hz loses one or two pings.
  static constexpr int most_at_once = 2;
  static constexpr std::chrono::milliseconds between_engines{1500};

  /// `nice_by` is added to the niceness of the thread; `on_change` is called when a Change is done.
  SceneChanges(asio::io_context& io, Simulator& simulator, ScenePointer scene, EngineFactory make_engine, int nice_by,
               InUse in_use, std::function<void()> on_change);
  /// Waits until the engine is built.
  ~SceneChanges();
  SceneChanges(const SceneChanges&) = delete;
  SceneChanges& operator=(const SceneChanges&) = delete;

  /// Call it before the first change. The function returns whether drivers are served now, in real time.
  void pace_while(std::function<bool()> drivers_wait) { drivers_wait_ = std::move(drivers_wait); }
  /// Submits a change. If `make` is empty and no change waits, the change is done before this call returns.
  void submit(Change change);
  bool busy() const { return under_way_ || !waiting_.empty(); }
  bool is_full() const { return waiting_.size() >= most_waiting; }
  /// Returns the duration of the present change so far; 0 = none.
  std::chrono::steady_clock::duration building_for() const;
  void stop();

  const ScenePointer& scene() const { return scene_; }

 private:
  struct Built {
    ScenePointer scene;
    std::shared_ptr<std::unique_ptr<PingEngine>> engine;  // empty: the scene does not change
    std::vector<Result<void>> outcomes;                   // outcome of each change
  };
  void begin();
  void build_next();
  std::chrono::steady_clock::duration pause_before_engine();
  /// Returns the waiting changes that share the next engine; at least the first one.
  std::vector<Make> next_makes() const;
  Built build(const std::vector<Make>& makes, const ScenePointer& now) const;
  void finish(Built built);

  asio::io_context& io_;
  Simulator& simulator_;
  ScenePointer scene_;
  EngineFactory make_engine_;
  InUse in_use_;
  std::function<void()> on_change_;
  std::deque<Change> waiting_;  // begins with the changes that are being made
  bool under_way_ = false;      // true until `done`, which may submit another change, has returned
  bool stopped_ = false, building_ = false;
  std::chrono::steady_clock::time_point building_since_{}, engine_due_{};
  std::function<bool()> drivers_wait_;
  asio::steady_timer pause_;
  asio::thread_pool thread_{1};
};

}  // namespace sonar
