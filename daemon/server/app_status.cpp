// How the daemon is: everything that GetStatus answers, the figures for /metrics, and what is wrong.
#include "daemon/server/app_operations.hpp"
#include "daemon/server/control/control_server.hpp"
#include "daemon/server/control/prometheus.hpp"
#include "daemon/server/poses/mavlink_server.hpp"

namespace sonar {
namespace {

constexpr auto longest_ping = std::chrono::seconds(30);  // beyond: the simulation is stuck

std::vector<control::ObjectStatus> objects_of(const Scene& scene, const World& world, Time now) {
  std::vector<control::ObjectStatus> all;
  const std::vector<Pose> bodies = world.objects_at(now);
  for (const Object& o : scene.objects) {
    if (o.name.empty()) continue;  // the place of one that was removed
    control::ObjectStatus object;
    object.name = o.name;
    object.moving = body_named(scene, o.name) >= 0;
    object.visible = o.visible && (o.body < 0 || !world.is_hidden(static_cast<std::size_t>(o.body)));
    object.triangles = static_cast<std::uint32_t>(o.mesh->triangles.size());
    if (!o.mesh->material.empty()) object.material = scene.materials.at(o.mesh->material.front()).name;
    object.in_world = scene.in_world(o, bodies);
    if (o.body >= 0) object.trajectory = world.object_plays(static_cast<std::size_t>(o.body), now);
    all.push_back(std::move(object));
  }
  return all;
}

/// Empty = no listener.
std::string served_at(Endpoint at) { return at.port == 0 ? std::string() : text_of(at); }

}  // namespace

std::string AppOperations::metrics() const {
  DaemonFigures f;
  f.version = SONARD_VERSION;
  f.uptime_s = seconds(std::chrono::steady_clock::now() - started_);
  for (const Device& d : parts_.fleet.devices()) f.sonars.emplace_back(d.config().name, d.figures());
  f.poses = parts_.world.counters();
  f.clients_now = parts_.admission.now();
  f.turned_away_for_places = parts_.admission.refused_for_places();
  f.turned_away_for_descriptors = parts_.admission.refused_for_descriptors();
  f.process = figures_of_this_process();
  return metrics_text(f);
}

std::string AppOperations::trouble() const {
  const auto under_way = parts_.simulator.under_way_for();
  if (under_way > longest_ping)
    return "the simulation has been at one ping for " +
           std::to_string(std::chrono::duration_cast<std::chrono::seconds>(under_way).count()) + " s";
  const std::string loading = slow_load();
  return loading.empty() ? parts_.fleet.trouble() : loading;
}

std::string AppOperations::slow_load() const {
  const auto loading = parts_.changes.building_for();
  if (loading <= parts_.config.limits.load) return {};
  return "a change of the scene has been loading for " +
         std::to_string(std::chrono::duration_cast<std::chrono::seconds>(loading).count()) +
         " s, longer than limits.load_s; reloads and changes of the scene wait for it";
}

control::DaemonStatus AppOperations::status() const {
  const Config& config = parts_.config;
  const Scene& scene = *parts_.changes.scene();
  const World& world = parts_.world;
  const Time now = parts_.clock.now();
  control::DaemonStatus s;
  s.version = SONARD_VERSION;
  s.config = config.source;
  s.scene = config.scene.name();
  s.clock = name_of(config.clock);
  s.now_ns = now.time_since_epoch().count();
  s.engine = parts_.simulator.engine_description();
  s.seed = config.seed;
  s.uptime_s = seconds(std::chrono::steady_clock::now() - started_);
  s.resident_mb = static_cast<double>(figures_of_this_process().resident_bytes) / 1e6;
  for (const Device& d : parts_.fleet.devices()) s.sonars.push_back(d.status(now));
  for (std::size_t v = 0; v < config.vehicles.size(); ++v)
    s.vehicles.push_back({config.vehicles[v].name, std::string(world.source_of(v)), world.is_stale(v, now),
                          world.vehicle_at(v, now), world.vehicle_plays(v, now)});
  s.objects = objects_of(scene, world, now);
  const PoseCounters& p = world.counters();
  s.poses = {p.accepted, p.refused, p.late, p.replaced, p.over_rate};
  s.environment = {config.water.temperature_c, config.water.salinity_psu, config.water.ph, config.water.sound_speed_mps};
  s.control = served_at(parts_.control.stream());
  s.http = served_at(parts_.control.http());
  s.recordings = parts_.recordings.status();
  s.notes = parts_.plausibility.all();
  for (control::Note& note : parts_.mavlink.notes()) s.notes.push_back(std::move(note));
  return s;
}

}  // namespace sonar
