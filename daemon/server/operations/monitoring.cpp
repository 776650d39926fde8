#include "daemon/server/operations/monitoring.hpp"

#include <cmath>

#include "daemon/server/control/prometheus.hpp"
#include "daemon/server/operations/fault_operations.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

constexpr auto longest_ping = std::chrono::seconds(30);  // if a ping takes longer, the simulation hangs
constexpr double largest_wall_difference_s = 2;          // more than a leap second

std::string whole_seconds(std::chrono::nanoseconds t) {
  return std::to_string(std::chrono::duration_cast<std::chrono::seconds>(t).count()) + " s";
}

/// Fills in the trajectory of a vehicle or an object.
void set_trajectory(auto& out, const std::optional<World::Played>& played, Time now) {
  if (!played) return;
  const motion::Playback& playback = played->playback;
  v1::TrajectoryStatus& t = *out.mutable_trajectory();
  t.set_file(played->file);
  t.set_position_s(seconds(playback.place(now).at));
  t.set_duration_s(seconds(playback.duration()));
  t.set_speed(playback.rules().speed.factor());
  t.set_paused(playback.paused());
  t.set_loop(playback.rules().loop);
}

void add_vehicles(v1::DaemonStatus& out, const Config& config, const World& world, Time now) {
  for (std::size_t i = 0; i < config.vehicles.size(); ++i) {
    v1::VehicleStatus& v = *out.add_vehicles();
    v.set_name(config.vehicles[i].name);
    v.set_source(std::string(world.source_of(i)));
    v.set_stale(world.is_stale(i, now));
    control::set_pose(v, world.vehicle_at(i, now));
    set_trajectory(v, world.vehicle_plays(i), now);
  }
}

void add_objects(v1::DaemonStatus& out, const Scene& scene, const World& world, Time now) {
  const std::vector<Pose> bodies = world.objects_at(now);
  for (const Object& o : scene.objects) {
    if (o.name.empty()) continue;  // the object was removed
    v1::ObjectStatus& object = *out.add_objects();
    object.set_name(o.name);
    object.set_moving(body_named(scene, o.name) >= 0);
    object.set_visible(o.visible && (o.body < 0 || !world.is_hidden(static_cast<std::size_t>(o.body))));
    object.set_triangles(static_cast<std::uint32_t>(o.mesh->triangles.size()));
    if (!o.mesh->material.empty()) object.set_material(scene.materials.at(o.mesh->material.front()).name);
    control::set_pose(object, scene.in_world(o, bodies));
    if (o.body >= 0) set_trajectory(object, world.object_plays(static_cast<std::size_t>(o.body)), now);
  }
}

void fill(v1::PoseFigures& out, const PoseCounters& counters) {
  out.set_accepted(counters.accepted);
  out.set_refused(counters.refused);
  out.set_late(counters.late);
  out.set_replaced(counters.replaced);
  out.set_over_rate(counters.over_rate);
}

void fill(v1::Environment& out, const Water& water) {
  out.mutable_temperature_c()->set_value(water.temperature_c);
  out.mutable_salinity_psu()->set_value(water.salinity_psu);
  out.mutable_ph()->set_value(water.ph);
  out.mutable_sound_speed_mps()->set_value(water.sound_speed_mps);
}

void add_notes(v1::DaemonStatus& out, const std::vector<Note>& notes) {
  for (const Note& n : notes) {
    v1::Note& note = *out.add_notes();
    note.set_vehicle(n.vehicle);
    note.set_text(n.text);
    note.set_cure(n.cure);
  }
}

void add_links(v1::DaemonStatus& out, const std::vector<LinkFigures>& links) {
  for (const LinkFigures& of : links) {
    v1::LinkStatus& link = *out.add_links();
    link.set_endpoint(of.endpoint);
    link.set_vehicle(of.vehicle);
    link.set_distances_sent(of.sent);
    link.set_distances_dropped(of.dropped());
  }
}

void add_viewers(v1::DaemonStatus& out, const std::vector<ViewerFigures>& viewers) {
  for (const ViewerFigures& v : viewers) {
    v1::ViewerStatus& viewer = *out.add_viewers();
    viewer.set_address(v.address);
    viewer.set_may_steer(v.may_steer);
    viewer.mutable_dropped()->insert(v.dropped.begin(), v.dropped.end());
  }
}

/// Returns the address as text; empty if there is no listener.
std::string address(Endpoint at) { return at.port == 0 ? std::string() : text_of(at); }

}  // namespace

std::shared_ptr<const v1::DaemonStatus> Monitoring::status() const {
  const Time now = of_.clock.now();
  const auto status = std::make_shared<v1::DaemonStatus>();
  v1::DaemonStatus& s = *status;
  s.set_version(SONARD_VERSION);
  s.set_config(of_.config.source);
  s.set_scene(of_.config.scene.name());
  s.set_clock(std::string(name_of(of_.config.clock)));
  s.set_now_ns(now.time_since_epoch().count());
  s.set_seed(of_.config.seed);
  s.set_uptime_s(uptime_s());
  s.set_resident_mb(static_cast<double>(figures_of_this_process().resident_bytes) / 1e6);
  // All parts describe the same time, `now`, because nothing else runs on this thread meanwhile.
  for (const Device& d : of_.fleet.devices()) *s.add_sonars() = d.status(now);
  add_vehicles(s, of_.config, of_.world, now);
  add_objects(s, *of_.changes.scene(), of_.world, now);
  fill(*s.mutable_poses(), of_.world.counters());
  fill(*s.mutable_environment(), of_.config.water);
  s.set_engine(of_.simulator.engine_description());
  s.set_control(address(of_.control.stream()));
  s.set_http(address(of_.control.http()));
  for (v1::RecordingStatus& recording : of_.recordings.status()) *s.add_recordings() = std::move(recording);
  add_notes(s, of_.plausibility.all());
  add_notes(s, of_.mavlink.notes());
  add_notes(s, of_.faults.notes());
  add_notes(s, notes_on_clock());
  s.set_wall_ahead_s(wall_ahead_s());
  s.set_faults_armed(of_.config.faults.armed);
  for (v1::FaultStatus& fault : fault_statuses(of_.fleet, now, false)) *s.add_faults() = std::move(fault);
  add_viewers(s, of_.view.viewers());
  add_links(s, of_.mavlink.figures());
  return status;
}

std::string Monitoring::metrics() const {
  DaemonFigures f;
  f.version = SONARD_VERSION;
  f.uptime_s = uptime_s();
  for (const Device& d : of_.fleet.devices()) f.sonars.emplace_back(d.config().name, d.figures());
  for (const Device& d : of_.fleet.devices()) f.active_faults.emplace_back(d.config().name, d.sonar().faults().active_count());
  f.fault_injections.assign(of_.faults.injections().begin(), of_.faults.injections().end());
  f.fault_entries_lost = of_.faults.lost();
  f.poses = of_.world.counters();
  f.links = of_.mavlink.figures();
  f.clients_now = of_.admission.now();
  f.refused_for_places = of_.admission.refused_for_places();
  f.refused_for_descriptors = of_.admission.refused_for_descriptors();
  f.viewers = of_.view.viewers();
  f.process = figures_of_this_process();
  return metrics_text(f);
}

/// Returns the first problem of these: the simulation hangs, a scene takes too long, a sonar does not listen.
std::string Monitoring::problem() const {
  const auto under_way = of_.simulator.under_way_for();
  if (under_way > longest_ping) return "the simulation has computed one ping for " + whole_seconds(under_way);
  const std::string loading = slow_load();
  return loading.empty() ? of_.fleet.problem() : loading;
}

std::string Monitoring::slow_load() const {
  const auto loading = of_.changes.building_for();
  if (loading <= of_.config.limits.load) return {};
  return "a change of the scene has been loading for " + whole_seconds(loading) +
         ", longer than limits.load_s; reloads and changes of the scene wait for it";
}

std::vector<Note> Monitoring::notes_on_clock() const {
  const double ahead_s = wall_ahead_s();
  if (std::abs(ahead_s) < largest_wall_difference_s) return {};
  return {{"",
           "the computer's clock was set, or the computer slept: it is " + std::to_string(std::llround(std::abs(ahead_s))) +
               " s " + (ahead_s > 0 ? "ahead of" : "behind") +
               " sonard's, which stamps pings, recordings and events and never jumps",
           "restart sonard; to start it only once the clock is set: systemctl enable systemd-time-wait-sync"}};
}

}  // namespace sonar
