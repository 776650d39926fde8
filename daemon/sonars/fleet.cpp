#include "daemon/sonars/fleet.hpp"

#include <algorithm>

namespace sonar {
namespace {

constexpr int sweeps_before_it_goes = 3;

bool same_endpoint(const Endpoint& a, const Endpoint& b) { return a.ip == b.ip && a.port == b.port; }
bool same(const Pose& a, const Pose& b) {
  return a.position_m.x == b.position_m.x && a.position_m.y == b.position_m.y && a.position_m.z == b.position_m.z &&
         a.orientation.w == b.orientation.w && a.orientation.x == b.orientation.x && a.orientation.y == b.orientation.y &&
         a.orientation.z == b.orientation.z;
}

/// Those of the vendor: a file may also have options of others, which are without effect.
bool same_options(const SonarConfig& a, const SonarConfig& b) {
  const auto own = a.profile.vendor->options();
  return std::all_of(own.begin(), own.end(), [&](const protocol::Option& option) {
    const auto in_a = a.options.find(std::string(option.name)), in_b = b.options.find(std::string(option.name));
    return in_a == a.options.end() || in_b == b.options.end() ? in_a == a.options.end() && in_b == b.options.end()
                                                              : in_a->second == in_b->second;
  });
}

const SonarConfig* named(const std::vector<SonarConfig>& sonars, const std::string& name) {
  const auto it = std::find_if(sonars.begin(), sonars.end(), [&](const SonarConfig& s) { return s.name == name; });
  return it == sonars.end() ? nullptr : &*it;
}

}  // namespace

bool goes_on(const SonarConfig& a, const SonarConfig& b) {
  return a.name == b.name && a.profile.vendor == b.profile.vendor && a.profile.model->profile == b.profile.model->profile &&
         a.bind_ip == b.bind_ip && a.advertise_ip == b.advertise_ip && a.netmask == b.netmask &&
         std::equal(a.status_to.begin(), a.status_to.end(), b.status_to.begin(), b.status_to.end(), same_endpoint) &&
         a.device_id == b.device_id && a.max_clients == b.max_clients && a.when_full == b.when_full &&
         a.max_observers == b.max_observers && a.observer_port == b.observer_port && a.outbox.depth == b.outbox.depth &&
         a.outbox.when_full == b.outbox.when_full && a.overload == b.overload && same_options(a, b);
}

Result<void> Fleet::open(const Config& config) {
  for (const SonarConfig& sonar : config.sonars) {
    devices_.emplace_back(context_, sonar, static_cast<std::uint32_t>(devices_.size()));
    if (auto r = devices_.back().open(); !r) return r;
  }
  return {};
}

void Fleet::start() {
  for (Device& d : devices_) d.start();
}
void Fleet::stop() {
  for (Device& d : devices_) d.stop();
}

Device* Fleet::find(const std::string& name) {
  const auto it = std::find_if(devices_.begin(), devices_.end(), [&](const Device& d) { return d.config().name == name; });
  return it == devices_.end() ? nullptr : &*it;
}

bool Fleet::gone() const {
  const auto is_gone = [](const Device& d) { return d.gone(); };
  return std::all_of(devices_.begin(), devices_.end(), is_gone) &&
         std::all_of(retired_.begin(), retired_.end(), [&](const Retired& r) { return is_gone(r.device.front()); });
}

std::uint64_t Fleet::served() const {
  std::uint64_t served = served_before_;
  for (const Device& d : devices_) served += d.served();
  for (const Retired& r : retired_) served += r.device.front().served();
  return served;
}

std::string Fleet::trouble() const {
  if (!missing_.empty()) return missing_.front();
  for (const Device& d : devices_)
    if (std::string why = d.trouble(); !why.empty()) return why;
  return {};
}

/// The place in the configuration, unless a sonar has it that goes on or was given it just now.
std::uint32_t Fleet::free_index(std::size_t wanted, const std::vector<Opening>& given) const {
  const auto taken = [&](std::uint32_t index) {
    return std::any_of(devices_.begin(), devices_.end(), [&](const Device& d) { return d.index() == index; }) ||
           std::any_of(given.begin(), given.end(), [&](const Opening& o) { return o.index == index; });
  };
  auto index = static_cast<std::uint32_t>(wanted);
  if (taken(index)) index = 0;
  while (taken(index)) ++index;
  return index;
}

void Fleet::retire(std::list<Device>::iterator device) {
  device->stop("the configuration changed");
  retired_.emplace_back();
  retired_.back().device.splice(retired_.back().device.end(), devices_, device);
}

/// Handlers that were cancelled by stop() still refer to the device: they were all queued then, and have run after a few turns.
void Fleet::sweep() {
  for (auto it = retired_.begin(); it != retired_.end();) {
    const Device& device = it->device.front();
    it->sweeps_gone = device.gone() ? it->sweeps_gone + 1 : 0;
    if (it->sweeps_gone < sweeps_before_it_goes) {
      ++it;
      continue;
    }
    served_before_ += device.served();
    it = retired_.erase(it);
  }
}

bool Fleet::add(const SonarConfig& sonar, std::uint32_t index, std::vector<std::string>& errors) {
  devices_.emplace_back(context_, sonar, index);
  const auto opened = devices_.back().open();
  if (opened) {
    devices_.back().start();
    return true;
  }
  errors.push_back("sonar " + sonar.name + ": " + opened.error().text);
  retire(std::prev(devices_.end()));  // what it had begun may still be under way
  return false;
}

bool Fleet::is_held(Ipv4 ip) const {
  return std::any_of(devices_.begin(), devices_.end(), [&](const Device& d) {
    const Ipv4 held = d.config().bind_ip;
    return held == ip || held == Ipv4{} || ip == Ipv4{};
  });
}

/// Sonars that live on move to where the new configuration has them; what is to be opened anew is returned.
std::vector<Fleet::Opening> Fleet::sort_out(const Config& now, const Config& next, Fates& fates) {
  std::vector<Opening> openings;
  for (auto it = devices_.begin(); it != devices_.end();) {
    const auto device = it++;
    const SonarConfig& is = device->config();
    const SonarConfig* const wanted = named(next.sonars, is.name);
    if (wanted == nullptr) {
      fates[is.name] = "removed";
      retire(device);
    } else if (goes_on(is, *wanted)) {
      const bool stays = now.vehicles[is.vehicle].name == next.vehicles[wanted->vehicle].name && same(is.mount, wanted->mount);
      fates[is.name] = stays ? "untouched" : "moved";
      device->use_place(*wanted);
    } else {
      openings.push_back({wanted, device->index(), device});
    }
  }
  for (std::size_t i = 0; i < next.sonars.size(); ++i)
    if (find(next.sonars[i].name) == nullptr) openings.push_back({&next.sonars[i], free_index(i, openings), devices_.end()});
  return openings;
}

/// The one before goes on, if its vehicle does.
void Fleet::stay(std::list<Device>::iterator device, const Config& now, const Config& next) {
  SonarConfig is = device->config();
  const auto vehicle = std::find_if(next.vehicles.begin(), next.vehicles.end(),
                                    [&](const VehicleConfig& v) { return v.name == now.vehicles[is.vehicle].name; });
  if (vehicle == next.vehicles.end()) return retire(device);
  is.vehicle = static_cast<std::size_t>(vehicle - next.vehicles.begin());
  device->use_place(is);
}

Fleet::Change Fleet::take_over(const Config& now, const Config& next) {
  Change change;
  Fates fates;
  std::vector<Opening> openings = sort_out(now, next, fates);
  std::vector<Opening> after;  // at an address that a sonar still holds which will be stopped
  for (const Opening& o : openings) {
    const bool changed = o.before != devices_.end();
    fates[o.sonar->name] = changed ? "changed" : "added";
    if (is_held(o.sonar->bind_ip)) {
      after.push_back(o);
    } else if (add(*o.sonar, o.index, change.errors)) {
      if (changed) retire(o.before);
    } else {
      fates[o.sonar->name] = changed ? "as before" : "missing";
      if (changed) stay(o.before, now, next);
    }
  }
  for (const Opening& o : after)
    if (o.before != devices_.end()) retire(o.before);
  for (const Opening& o : after)
    if (!add(*o.sonar, o.index, change.errors)) fates[o.sonar->name] = "missing";

  for (const SonarConfig& sonar : next.sonars) {  // the configuration's order
    const auto device =
        std::find_if(devices_.begin(), devices_.end(), [&](const Device& d) { return d.config().name == sonar.name; });
    if (device != devices_.end()) devices_.splice(devices_.end(), devices_, device);
    change.summary += (change.summary.empty() ? "" : ", ") + sonar.name + " " + fates[sonar.name];
    fates.erase(sonar.name);
  }
  for (const auto& [name, fate] : fates) change.summary += ", " + name + " " + fate;
  missing_ = change.errors;
  return change;
}

}  // namespace sonar
