#include "daemon/reload.hpp"

#include <algorithm>
#include <utility>

#include "daemon/app.hpp"
#include "daemon/config/products.hpp"
#include "daemon/world/world_parts.hpp"

namespace sonar {
namespace {

bool same(const PoseListener& a, const PoseListener& b) {
  return a.enabled == b.enabled && a.at.ip == b.at.ip && a.at.port == b.at.port;
}
bool same(const MavlinkConfig& a, const MavlinkConfig& b) {
  return a.dials == b.dials && a.at.ip == b.at.ip && a.at.port == b.at.port && a.vehicle == b.vehicle &&
         a.system_id == b.system_id && a.component_id == b.component_id && a.request_rates == b.request_rates &&
         a.rate_hz == b.rate_hz;
}
bool same(const std::vector<MavlinkConfig>& a, const std::vector<MavlinkConfig>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const MavlinkConfig& x, const MavlinkConfig& y) { return same(x, y); });
}
bool same(const std::optional<Geodetic>& a, const std::optional<Geodetic>& b) {
  if (!a || !b) return !a && !b;
  return a->latitude_rad == b->latitude_rad && a->longitude_rad == b->longitude_rad && a->altitude_m == b->altitude_m;
}
bool same(const ControlConfig& a, const ControlConfig& b) {
  return same(a.stream, b.stream) && same(a.http, b.http) && a.token_file == b.token_file && a.hosts == b.hosts;
}
bool same(const LogOptions& a, const LogOptions& b) { return a.level == b.level && a.json == b.json; }
template <class T>
bool same(const T& a, const T& b) {
  return a == b;
}

}  // namespace

bool is_same(const Water& a, const Water& b) {
  return a.temperature_c == b.temperature_c && a.salinity_psu == b.salinity_psu && a.ph == b.ph &&
         a.sound_speed_mps == b.sound_speed_mps;
}

std::vector<std::string> keep_what_needs_a_restart(const Config& now, Config& next) {
  std::vector<std::string> keys;
  const auto keep = [&keys](const char* key, const auto& is, auto& wanted) {
    if (!same(is, wanted)) keys.emplace_back(key);
    wanted = is;
  };
  keep("poses.protobuf", now.poses.protobuf, next.poses.protobuf);
  keep("poses.json", now.poses.json, next.poses.json);
  keep("poses.mavlink", now.poses.mavlink, next.poses.mavlink);
  keep("world.origin", now.origin, next.origin);
  keep("control", now.control, next.control);
  keep("limits.control_clients", now.limits.control_clients, next.limits.control_clients);
  keep("engine.threads", now.engine.threads, next.engine.threads);
  keep("engine.io_priority", now.engine.io_priority, next.engine.io_priority);
  keep("engine.device", now.engine.device, next.engine.device);
  keep("engine.simd", now.engine.simd, next.engine.simd);
  keep("clock", now.clock, next.clock);
  keep("log", now.log, next.log);
  return keys;
}

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

/// The file is read and its scene made ready where nobody waits for it; then everything changes in one moment.
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
  const std::vector<std::string> keys = keep_what_needs_a_restart(config_, next);
  const bool other_water = !is_same(config_.water, next.water);
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
