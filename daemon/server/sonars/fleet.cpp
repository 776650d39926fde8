#include "daemon/server/sonars/fleet.hpp"

#include <algorithm>

#include "daemon/emulator/reload_plan.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

constexpr int sweeps_before_it_goes = 3;

}  // namespace

Result<void> Fleet::open(const Config& config) {
  for (const SonarConfig& sonar : config.sonars) {
    devices_.emplace_back(network_, around_, sonar, static_cast<std::uint32_t>(devices_.size()), *this);
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

bool Fleet::has_clients() const {
  return std::any_of(devices_.begin(), devices_.end(), [](const Device& d) { return d.sonar().connections().has_audience(); });
}

std::uint64_t Fleet::served() const {
  std::uint64_t served = served_before_;
  for (const Device& d : devices_) served += d.sonar().served();
  for (const Retired& r : retired_) served += r.device.front().sonar().served();
  return served;
}

std::string Fleet::problem() const {
  if (!missing_.empty()) return missing_.front();
  for (const Device& d : devices_)
    if (std::string why = d.problem(); !why.empty()) return why;
  return {};
}

/// Returns the sonar's position in the configuration or, if another sonar has that index, the first free index.
std::uint32_t Fleet::free_index(std::size_t wanted, const std::vector<Opening>& given) const {
  const auto taken = [&](std::uint32_t index) {
    return std::any_of(devices_.begin(), devices_.end(), [&](const Device& d) { return d.sonar().index() == index; }) ||
           std::any_of(given.begin(), given.end(), [&](const Opening& o) { return o.index == index; });
  };
  auto index = static_cast<std::uint32_t>(wanted);
  if (taken(index)) index = 0;
  while (taken(index)) ++index;
  return index;
}

/// Stops a device and keeps it until its connections and handlers have ended (sweep).
void Fleet::retire(std::list<Device>::iterator device) {
  device->stop("the configuration changed");
  retired_.emplace_back();
  retired_.back().device.splice(retired_.back().device.end(), devices_, device);
}

/// Erases a device only after several successive calls have found it gone, because cancelled handlers still refer to the device
/// for a few turns of the event loop.
void Fleet::sweep() {
  for (auto it = retired_.begin(); it != retired_.end();) {
    const Device& device = it->device.front();
    it->sweeps_gone = device.gone() ? it->sweeps_gone + 1 : 0;
    if (it->sweeps_gone < sweeps_before_it_goes) {
      ++it;
      continue;
    }
    served_before_ += device.sonar().served();
    it = retired_.erase(it);
  }
}

bool Fleet::add(const SonarConfig& sonar, std::uint32_t index, Change& change) {
  devices_.emplace_back(network_, around_, sonar, index, *this);
  const auto opened = devices_.back().open();
  if (opened) {
    devices_.back().start();
    change.opened.push_back(&devices_.back());
    return true;
  }
  change.errors.push_back("sonar " + sonar.name + ": " + opened.error().text);
  retire(std::prev(devices_.end()));  // operations that the device began may still run
  return false;
}

/// True if a sonar uses this address. A sonar at 0.0.0.0 uses every address.
bool Fleet::is_held(Ipv4 ip) const {
  return std::any_of(devices_.begin(), devices_.end(), [&](const Device& d) {
    const Ipv4 held = d.config().bind_ip;
    return held == ip || held == Ipv4{} || ip == Ipv4{};
  });
}

/// Stops removed sonars, and sets mount and vehicle of the sonars that continue. Returns the sonars to open.
std::vector<Fleet::Opening> Fleet::sort_out(const Config& now, const Config& next, Outcomes& outcomes) {
  std::vector<Opening> openings;
  for (auto it = devices_.begin(); it != devices_.end();) {
    const auto device = it++;
    const SonarConfig& is = device->config();
    const SonarConfig* const wanted = sonar_named(next.sonars, is.name);
    const SonarChange change = sonar_change(is, now, next);
    if (change == SonarChange::removed) {
      outcomes[is.name] = "removed";
      retire(device);
    } else if (change == SonarChange::changed) {
      openings.push_back({wanted, device->sonar().index(), device});
    } else {
      outcomes[is.name] = change == SonarChange::untouched ? "untouched" : "moved";
      device->use_place(*wanted);
    }
  }
  for (std::size_t i = 0; i < next.sonars.size(); ++i)
    if (find(next.sonars[i].name) == nullptr) openings.push_back({&next.sonars[i], free_index(i, openings), devices_.end()});
  return openings;
}

/// Called if a changed sonar cannot be opened: the previous sonar continues if its vehicle still exists, else it ends.
void Fleet::stay(std::list<Device>::iterator device, const Config& now, const Config& next) {
  SonarConfig is = device->config();
  const auto vehicle = std::find_if(next.vehicles.begin(), next.vehicles.end(),
                                    [&](const VehicleConfig& v) { return v.name == now.vehicles[is.vehicle].name; });
  if (vehicle == next.vehicles.end()) return retire(device);
  is.vehicle = static_cast<std::size_t>(vehicle - next.vehicles.begin());
  device->use_place(is);
}

/// Replaces the sonars with those of the new configuration. A sonar that cannot be opened is an error in the result; other sonars
/// are opened nevertheless.
Fleet::Change Fleet::take_over(const Config& now, const Config& next) {
  Change change;
  Outcomes outcomes;
  std::vector<Opening> openings = sort_out(now, next, outcomes);
  std::vector<Opening> after;  // to be opened after the sonars that use their addresses are stopped
  // There are three passes, so that sonars can swap addresses and none is stopped needlessly: open sonars at free addresses,
  // while the previous sonars still serve; stop sonars whose addresses are needed; open the rest.
  for (const Opening& o : openings) {
    const bool changed = o.before != devices_.end();
    outcomes[o.sonar->name] = changed ? "changed" : "added";
    if (is_held(o.sonar->bind_ip)) {
      after.push_back(o);
    } else if (add(*o.sonar, o.index, change)) {
      if (changed) retire(o.before);
    } else {
      outcomes[o.sonar->name] = changed ? "as before" : "missing";
      if (changed) stay(o.before, now, next);
    }
  }
  for (const Opening& o : after)
    if (o.before != devices_.end()) retire(o.before);
  for (const Opening& o : after)
    if (!add(*o.sonar, o.index, change)) outcomes[o.sonar->name] = "missing";

  for (const SonarConfig& sonar : next.sonars) {  // in the configuration's order
    const auto device =
        std::find_if(devices_.begin(), devices_.end(), [&](const Device& d) { return d.config().name == sonar.name; });
    if (device != devices_.end()) devices_.splice(devices_.end(), devices_, device);
    change.summary += (change.summary.empty() ? "" : ", ") + sonar.name + " " + outcomes[sonar.name];
    outcomes.erase(sonar.name);
  }
  for (const auto& [name, outcome] : outcomes) change.summary += ", " + name + " " + outcome;
  missing_ = change.errors;
  return change;
}

// ---- pings and clients, passed on to the simulator, recordings and events

/// Requests a ping, with the additions that recordings and viewers need. The scene's names are stored for the ping, because
/// another scene may be in use when the ping is finished.
void Fleet::compute(const Device& of, PingRequest request, Simulator::Done done) {
  const std::string& name = of.config().name;
  request.switches.keep_truth = recordings_.wants_truth(name) || (tap_wants_truth_ && tap_wants_truth_(name));
  request.switches.keep_labels = recordings_.wants_labels(name);
  computed_names_[of.sonar().index()] = recordings_.names();
  simulator_.submit(std::move(request), std::move(done));
}

void Fleet::on_ping_queued(const Device& of, const PingQueued& queued) {
  const Time now = network_.clock.now();
  const std::string& name = of.config().name;
  if (recordings_.takes(name))
    recordings_.take(name, {now, queued.ping, queued.bytes, queued.datagrams, of.sonar().vendor().beacon(of.sonar().state(), now),
                            computed_names_[of.sonar().index()]});
  if (tap_) tap_(of, queued);
  if (handlers_.on_distance && of.sonar().vendor().measures_distance()) handlers_.on_distance(of.config(), queued);
  if (!events_.has_listeners()) return;
  v1::Event event;
  *event.mutable_ping() = of.event_of(queued);
  events_.publish(event);
}

void Fleet::on_client(const Device& of, const std::string& peer, bool connected, const std::string& why) {
  events_.publish_client(of.config().name, peer, connected, why);
}

}  // namespace sonar
