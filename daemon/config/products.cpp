#include "daemon/config/products.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/geodesy.hpp"
#include "core/text/format.hpp"
#include "protocol/host.hpp"

namespace sonar {
namespace {

constexpr double most_apart_m =
    1;  // distance between the origins of a trajectory and of the world; converters round degrees to 1 mm

bool has_option(const protocol::Vendor& vendor, std::string_view name) {
  const auto options = vendor.options();
  return std::any_of(options.begin(), options.end(), [name](const protocol::Option& o) { return o.name == name; });
}

std::string all_products() {
  std::string names;
  for (const protocol::Vendor* vendor : protocol::vendors())
    for (const auto& model : vendor->models()) names.append(names.empty() ? "" : ", ").append(model->profile);
  return names;
}

}  // namespace

std::string title_of(const protocol::Vendor& vendor) {
  const std::string& product = vendor.models().front()->name;
  return product.substr(0, product.find(' '));
}

int default_max_observers(const protocol::Vendor& vendor) {
  return vendor.default_max_clients() > 1 || vendor.pings_by() == protocol::PingsBy::datagrams ? 0 : 4;
}

std::vector<std::string> notes_of_config(const Config& config) {
  std::vector<std::string> notes;
  for (const SonarConfig& sonar : config.sonars)
    for (const auto& [name, value] : sonar.options) {
      if (has_option(*sonar.profile.vendor, name)) continue;
      for (const protocol::Vendor* vendor : protocol::vendors())
        if (has_option(*vendor, name))
          notes.push_back("sonar " + sonar.name + ": options." + name + " is for " + title_of(*vendor) +
                          " sonars: without effect on " + sonar.profile.model->name);
    }
  for (const VehicleConfig& vehicle : config.vehicles) {
    if (!config.origin || !vehicle.plan.origin) continue;
    const Vec3d away = enu_in_enu_of(*config.origin, *vehicle.plan.origin).position_m;
    const double away_m = std::hypot(away.x, away.y);
    if (away_m > most_apart_m)
      notes.push_back(
          "vehicle " + vehicle.name + ": " + vehicle.plan.file +
          text::format(" states an origin that is %.0f m from world.origin, so its positions are off by that: write it "
                       "again with --origin %.8g,%.8g,0 (python3 -m sonard_client.convert)",
                       away_m, deg_from_rad(config.origin->latitude_rad), deg_from_rad(config.origin->longitude_rad)));
  }
  return notes;
}

/// Resets everything that depends on the product: options, clients, observers, and the mount of the demo.
Result<void> use_product(Config& config, std::string_view profile) {
  auto found = protocol::find_profile(profile);
  if (!found) return failure(ErrorKind::usage, found.error().text + "; there are " + all_products());
  auto options = protocol::check_options(*found->vendor, {});
  if (!options) return tl::make_unexpected(options.error());
  auto model = found->vendor->tuned(found->model, *options);
  if (!model) return tl::make_unexpected(model.error());
  SonarConfig& sonar = config.sonars.front();
  sonar.profile = {found->vendor, *std::move(model)};
  sonar.options = *std::move(options);
  sonar.max_clients = found->vendor->default_max_clients();
  sonar.max_observers = default_max_observers(*found->vendor);
  if (const auto mount = protocol::make_of_profile(profile).demo_mount) sonar.mount.orientation = quat_from_rpy(*mount);
  return {};
}

std::string why_without_effect(const Switches& switches, const NamedSwitch& part) {
  if (switches.mode != Mode::canonical)
    return std::string("mode ") + (switches.mode == Mode::paper ? "paper" : "raster") + " leaves out " + part.name;
  if (switches.fixed_fan > 0 && part.is_on == &Switches::multipath) return "a fixed fan leaves out multipath";
  return {};
}

Switches effective_switches(Switches switches) {
  for (const NamedSwitch& part : named_switches)
    if (!why_without_effect(switches, part).empty()) switches.*part.is_on = false;
  return switches;
}

std::string note_of_parts_left_out(const Switches& switches) {
  std::string note;
  for (const NamedSwitch& part : named_switches)
    if (const std::string why = why_without_effect(switches, part); switches.*part.is_on && !why.empty())
      note += note.empty() ? why : std::string(", ") + part.name;
  return note.empty() ? note : note + " (docs/acoustics.md, section 8)";
}

}  // namespace sonar
