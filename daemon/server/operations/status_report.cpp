#include "daemon/server/operations/status_report.hpp"

#include "daemon/server/system/process_figures.hpp"

namespace sonar {
namespace {

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

}  // namespace

control::DaemonStatus StatusReport::status() const {
  const Time now = clock_.now();
  control::DaemonStatus s;
  s.version = SONARD_VERSION;
  s.config = config_.source;
  s.scene = config_.scene.name();
  s.clock = name_of(config_.clock);
  s.now_ns = now.time_since_epoch().count();
  s.seed = config_.seed;
  s.uptime_s = seconds(std::chrono::steady_clock::now() - started_);
  s.resident_mb = static_cast<double>(figures_of_this_process().resident_bytes) / 1e6;
  for (const Device& d : fleet_.devices()) s.sonars.push_back(d.status(now));
  for (std::size_t v = 0; v < config_.vehicles.size(); ++v)
    s.vehicles.push_back({config_.vehicles[v].name, std::string(world_.source_of(v)), world_.is_stale(v, now),
                          world_.vehicle_at(v, now), world_.vehicle_plays(v, now)});
  s.objects = objects_of(*changes_.scene(), world_, now);
  const PoseCounters& p = world_.counters();
  s.poses = {p.accepted, p.refused, p.late, p.replaced, p.over_rate};
  s.environment = {config_.water.temperature_c, config_.water.salinity_psu, config_.water.ph, config_.water.sound_speed_mps};
  add_server_(s);
  return s;
}

}  // namespace sonar
