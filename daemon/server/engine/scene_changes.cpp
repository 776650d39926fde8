#include "daemon/server/engine/scene_changes.hpp"

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include "daemon/server/system/shortage.hpp"

namespace sonar {

SceneChanges::SceneChanges(asio::io_context& io, Simulator& simulator, ScenePointer scene, EngineFactory make_engine, int nice_by,
                           InUse in_use, std::function<void()> on_change)
    : io_(io),
      simulator_(simulator),
      scene_(std::move(scene)),
      make_engine_(std::move(make_engine)),
      in_use_(std::move(in_use)),
      on_change_(std::move(on_change)),
      pause_(io) {
  asio::post(thread_, [nice_by] {
    if (nice_by != 0 && ::nice(nice_by) == -1) return;  // if this fails, the thread keeps its priority
  });
}

SceneChanges::~SceneChanges() { thread_.join(); }

/// Stops. A running build continues, but finish() drops its result.
void SceneChanges::stop() {
  stopped_ = true;
  waiting_.clear();
  pause_.cancel();
}

std::chrono::steady_clock::duration SceneChanges::building_for() const {
  return building_ ? std::chrono::steady_clock::now() - building_since_ : std::chrono::steady_clock::duration{};
}

/// Changes take effect in the order of submission.
void SceneChanges::submit(Change change) {
  if (stopped_) return;
  if (!change.make && !busy()) return change.done({});
  waiting_.push_back(std::move(change));
  if (!under_way_) begin();
}

void SceneChanges::begin() {
  under_way_ = true;
  if (!waiting_.front().make) return finish(Built{scene_, nullptr, {{}}});
  const auto pause = pause_before_engine();
  if (pause.count() == 0) return build_next();
  pause_.expires_after(pause);
  pause_.async_wait([this](const error_code& ec) {
    if (!ec && !stopped_) build_next();
  });
}

/// While drivers are served, `most_at_once` engines may be built in a row, then one per `between_engines` (token bucket).
std::chrono::steady_clock::duration SceneChanges::pause_before_engine() {
  const auto now = std::chrono::steady_clock::now();
  if (!drivers_wait_ || !drivers_wait_()) return {};
  const auto due = std::max(engine_due_, now - (most_at_once - 1) * between_engines);
  engine_due_ = due + between_engines;
  return std::max(due - now, std::chrono::steady_clock::duration{});
}

/// Returns the first waiting change, and the changes directly after it that may share the engine.
std::vector<SceneChanges::Make> SceneChanges::next_makes() const {
  std::vector<Make> makes;
  for (const Change& change : waiting_) {
    if (!makes.empty() && !(change.shares_engine && change.make && waiting_.front().shares_engine)) break;
    makes.push_back(change.make);
  }
  return makes;
}

void SceneChanges::build_next() {
  building_ = true;
  building_since_ = std::chrono::steady_clock::now();
  // `done` stays on this thread, because objects that it owns (a connection) must not be destroyed on another thread.
  asio::post(thread_, [this, makes = next_makes(), now = scene_] {
    auto built = std::make_shared<Built>(build(makes, now));
    asio::post(io_, [this, built] { finish(std::move(*built)); });
  });
}

namespace {

/// Returns what `work` returns; an exception becomes an error.
auto caught(const auto& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return failure(ErrorKind::unavailable, std::string("cannot change the scene: ") + not_enough_memory);
  } catch (const std::exception& e) {
    if (is_short_of_threads(e))
      return failure(ErrorKind::unavailable, std::string("cannot change the scene: ") + not_enough_threads);
    return failure(ErrorKind::bug, std::string(e.what()) + " (this is a bug, please report it)");
  }
}

}  // namespace

/// Runs on the scene thread. Each change is applied to the result of the previous one; a failed change has no effect.
SceneChanges::Built SceneChanges::build(const std::vector<Make>& makes, const ScenePointer& now) const {
  Built built{now, nullptr, {}};
  for (const Make& make : makes) {
    const auto scene = caught([&] { return make(built.scene); });
    if (scene) built.scene = *scene;
    built.outcomes.push_back(scene ? Result<void>{} : tl::make_unexpected(scene.error()));
  }
  if (built.scene == now || is_same(*built.scene, *now)) return built;
  auto engine = caught([&] { return start_engine(make_engine_, built.scene); });
  if (engine) {
    built.engine = std::make_shared<std::unique_ptr<PingEngine>>(*std::move(engine));
    return built;
  }
  // If one change needs too much memory, other changes must not fail, so the first is tried alone.
  if (makes.size() > 1) return build({makes.front()}, now);
  return {now, nullptr, {tl::make_unexpected(engine.error())}};
}

/// Runs on the I/O thread. First the simulator gets the engine, then the world gets the bodies of the scene, and only then are
/// the changes reported as done.
void SceneChanges::finish(Built built) {
  building_ = false;
  if (stopped_) return;
  if (built.engine) {
    scene_ = built.scene;
    simulator_.use(std::move(*built.engine), [this](std::shared_ptr<PingEngine> before) {
      // The cells of the old engine may have a hundred megabytes, so the scene thread frees them to keep the I/O thread fast.
      if (!stopped_) asio::post(thread_, [before = std::move(before)]() mutable { before.reset(); });
    });
    in_use_(scene_);
  }
  for (const Result<void>& outcome : built.outcomes) {
    const auto done = std::move(waiting_.front().done);
    waiting_.pop_front();
    done(outcome);
    if (stopped_) break;  // after stop() no request waits for the result
  }
  under_way_ = false;
  if (!stopped_ && !waiting_.empty()) begin();
  on_change_();
}

}  // namespace sonar
