#include <utility>

#include "daemon/config/products.hpp"
#include "daemon/config/restart_keys.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/app.hpp"

namespace sonar {

/// A storm of them is as good as two: one now, one for all that come before its pause is over.
void App::on_hangup() {
  if (reload_waits_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now >= no_reload_before_) {
    no_reload_before_ = now + reload_pause;
    return reload();
  }
  reload_waits_ = true;
  reload_timer_.expires_at(no_reload_before_);
  reload_timer_.async_wait([this](const error_code& ec) {
    reload_waits_ = false;
    if (!ec && !stopping_) on_hangup();
  });
}

/// The file is read and its scene built on the scene thread; then everything changes at once on the I/O thread.
void App::reload() {
  if (!options_.read_config || !options_.load_scene) return log_.info("reload: there is no configuration file; nothing changed");
  if (changes_.is_full()) return log_.warning("reload: too many changes of the scene wait already; nothing changed");
  if (reloads_ == 2) return;  // one is under way; the other waits, and will read what the file says then
  ++reloads_;
  notify_.reloading();
  auto next = std::make_shared<Config>();
  changes_.submit({[read = options_.read_config, load = options_.load_scene, next](const ScenePointer&) -> Result<ScenePointer> {
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
                       take_over(std::move(*next));
                     else
                       log_.error("reload: " + outcome.error().text + "; the configuration stays as it was");
                     --reloads_;
                     notify_.ready(status_line());
                   }});
}

void App::take_over(Config next) {
  const std::vector<std::string> keys = keep_restart_keys(config_, next);
  const bool other_water = !(config_.water == next.water);
  std::swap(config_, next);  // devices read it through their context
  const Config& before = next;
  world_.use_rules(pose_rules(config_));
  world_.use_vehicles(vehicles_of(config_), clock_.now());
  world_.use_objects(bodies_of(scene(), config_), clock_.now());
  world_.show_again();
  notes_due_ = true;
  const Fleet::Change change = fleet_.take_over(before, config_);
  if (other_water)
    for (Device& d : fleet_.devices()) d.use_water(config_.water);

  for (const std::string& error : change.errors) log_.error("reload: " + error);
  std::string listed;
  for (const std::string& key : keys) listed += (listed.empty() ? "" : ", ") + key;
  if (!listed.empty()) log_.warning("reload: these need a restart and stay as they were: " + listed);
  for (const std::string& note : notes_of_options(config_)) log_.info("reload: " + note);
  log_.info("reloaded: " + change.summary, {{"scene", scene().name}});
  if (events_.heard()) events_.tell({control::SceneEvent{config_.scene.name(), "reloaded: " + change.summary}});
  on_change();
}

}  // namespace sonar
