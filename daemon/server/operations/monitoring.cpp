#include "daemon/server/operations/monitoring.hpp"

#include "daemon/server/control/prometheus.hpp"

namespace sonar {
namespace {

constexpr auto longest_ping = std::chrono::seconds(30);  // beyond: the simulation is stuck

std::string whole_seconds(std::chrono::nanoseconds t) {
  return std::to_string(std::chrono::duration_cast<std::chrono::seconds>(t).count()) + " s";
}

}  // namespace

std::string Monitoring::metrics() const {
  DaemonFigures f;
  f.version = SONARD_VERSION;
  f.uptime_s = seconds(std::chrono::steady_clock::now() - started_);
  for (const Device& d : fleet_.devices()) f.sonars.emplace_back(d.config().name, d.figures());
  for (const Device& d : fleet_.devices()) f.active_faults.emplace_back(d.config().name, d.sonar().faults().active_count());
  f.fault_injections.assign(faults_.injections().begin(), faults_.injections().end());
  f.poses = world_.counters();
  f.clients_now = admission_.now();
  f.turned_away_for_places = admission_.refused_for_places();
  f.turned_away_for_descriptors = admission_.refused_for_descriptors();
  f.process = figures_of_this_process();
  return metrics_text(f);
}

std::string Monitoring::problem() const {
  const auto under_way = simulator_.under_way_for();
  if (under_way > longest_ping) return "the simulation has been at one ping for " + whole_seconds(under_way);
  const std::string loading = slow_load();
  return loading.empty() ? fleet_.problem() : loading;
}

std::string Monitoring::slow_load() const {
  const auto loading = changes_.building_for();
  if (loading <= limits_.load) return {};
  return "a change of the scene has been loading for " + whole_seconds(loading) +
         ", longer than limits.load_s; reloads and changes of the scene wait for it";
}

}  // namespace sonar
