#include "daemon/emulator/reload_plan.hpp"

#include <algorithm>

namespace sonar {
namespace {

/// Compares the options of the vendor. A file may also have options of other vendors, which have no effect.
bool same_options(const SonarConfig& a, const SonarConfig& b) {
  const auto own = a.profile.vendor->options();
  return std::all_of(own.begin(), own.end(), [&](const protocol::Option& option) {
    const auto in_a = a.options.find(std::string(option.name)), in_b = b.options.find(std::string(option.name));
    return in_a == a.options.end() || in_b == b.options.end() ? in_a == a.options.end() && in_b == b.options.end()
                                                              : in_a->second == in_b->second;
  });
}

/// True if the sonars differ at most in their mount and vehicle.
bool is_same_device(const SonarConfig& a, const SonarConfig& b) {
  return a.name == b.name && a.profile.vendor == b.profile.vendor && a.profile.model->profile == b.profile.model->profile &&
         a.bind_ip == b.bind_ip && a.advertise_ip == b.advertise_ip && a.netmask == b.netmask && a.status_to == b.status_to &&
         a.groups == b.groups && a.device_id == b.device_id && a.max_clients == b.max_clients && a.when_full == b.when_full &&
         a.max_observers == b.max_observers && a.observer_port == b.observer_port && a.outbox == b.outbox &&
         a.overload == b.overload && a.bearings == b.bearings && same_options(a, b);
}

}  // namespace

const SonarConfig* sonar_named(const std::vector<SonarConfig>& sonars, const std::string& name) {
  const auto it = std::find_if(sonars.begin(), sonars.end(), [&](const SonarConfig& s) { return s.name == name; });
  return it == sonars.end() ? nullptr : &*it;
}

SonarChange sonar_change(const SonarConfig& running, const Config& now, const Config& next) {
  const SonarConfig* const wanted = sonar_named(next.sonars, running.name);
  if (wanted == nullptr) return SonarChange::removed;
  if (!is_same_device(running, *wanted)) return SonarChange::changed;
  const bool stays = now.vehicles[running.vehicle].name == next.vehicles[wanted->vehicle].name && running.mount == wanted->mount;
  return stays ? SonarChange::untouched : SonarChange::moved;
}

}  // namespace sonar
