#include "daemon/server/reload.hpp"

#include <memory>
#include <utility>

#include "daemon/emulator/world/world_parts.hpp"

namespace sonar {

/// Begins at most one reload per `pause`. A request within the pause waits for the end of the pause; further requests join it.
void Reload::request() {
  if (waits_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now >= not_before_) {
    not_before_ = now + pause;
    return begin();
  }
  waits_ = true;
  timer_.expires_at(not_before_);
  timer_.async_wait([this](const error_code& ec) {
    waits_ = false;
    if (!ec && !stopped_) request();
  });
}

void Reload::stop() {
  stopped_ = true;
  timer_.cancel();
}

/// Reads the file on the scene thread, as a change of the scene, so that configuration and scene take effect together.
void Reload::begin() {
  if (!steps_.read_config || !steps_.load_scene) return log_.info("reload: there is no configuration file; nothing changed");
  if (changes_.is_full()) return log_.warning("reload: too many changes of the scene wait already; nothing changed");
  if (under_way_ == 2) return;  // one reload runs, and the next one, which waits, will read the file when it begins
  ++under_way_;
  steps_.begin();
  auto next = std::make_shared<Config>();
  changes_.submit({[read = steps_.read_config, load = steps_.load_scene, next](const ScenePointer&) -> Result<ScenePointer> {
                     auto config = read();
                     if (!config) return tl::make_unexpected(config.error());
                     *next = *std::move(config);
                     auto scene = load(next->scene);
                     if (scene)
                       if (const std::string why = why_not_movable(**scene, *next); !why.empty())
                         return failure(ErrorKind::config, why);
                     return scene;
                   },
                   [this, next](const Result<void>& outcome) {
                     if (outcome)
                       steps_.take_over(std::move(*next));
                     else
                       log_.error("reload: " + outcome.error().text + "; the configuration stays as it was");
                     --under_way_;
                     steps_.end();
                   }});
}

}  // namespace sonar
