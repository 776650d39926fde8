#include "daemon/config/config_parts.hpp"

#include <cmath>

#include "core/base/regular_file.hpp"
#include "daemon/config/products.hpp"
#include "daemon/config/scene_file.hpp"

namespace sonar {
namespace {

using text::Map;
using text::Node;
using text::Range;

constexpr Range finite_place{.min = -1e7, .max = 1e7};
/// Reads the value of an option; errors state the position in the file.
std::string read_option(const Node& value, const protocol::Option& option) {
  if (option.allowed.empty()) {
    const std::string text = value.text(64);
    if (text == option.default_value || (!option.word.empty() && text == option.word)) return text;
    if (option.whole)
      value.integer(static_cast<std::int64_t>(option.lowest), static_cast<std::int64_t>(option.highest));
    else
      value.number(Range::between(option.lowest, option.highest));
  } else {
    value.choice_index(option.allowed);
  }
  return value.text(64);
}

constexpr double hot_c = 30;  // a widely used driver warns from here on, and commands standby later
constexpr const char* effect_of_heat = "from 30 C on a real driver warns, at 35 C it commands standby; ";

Pose pose_from(const std::array<double, 3>& xyz_m, const std::array<double, 3>& rpy_deg) {
  return {{xyz_m[0], xyz_m[1], xyz_m[2]},
          quat_from_rpy({rad_from_deg(rpy_deg[0]), rad_from_deg(rpy_deg[1]), rad_from_deg(rpy_deg[2])})};
}

}  // namespace

Pose read_world_pose(const Node& node) {
  if (!node.present()) return {};
  Map map = node.map();
  const bool ned = map.required("frame").choice<bool>({{"ENU_FLU", false}, {"NED_FRD", true}});
  const auto xyz_m = map.required("xyz_m").numbers<3>(finite_place);
  const auto rpy_deg = map.optional("rpy_deg").numbers_or<3>({0, 0, 0}, Range::between(-360, 360));
  const Pose pose = pose_from(xyz_m, rpy_deg);
  return ned ? enu_flu_from_ned_frd(pose) : pose;
}

Pose read_mount(const Node& node) {
  if (!node.present()) return {};
  Map map = node.map();
  const bool frd = map.required("frame").choice<bool>({{"FLU", false}, {"FRD", true}});
  const auto xyz_m = map.optional("xyz_m").numbers_or<3>({0, 0, 0}, Range::between(-1000, 1000));
  const auto rpy_deg = map.optional("rpy_deg").numbers_or<3>({0, 0, 0}, Range::between(-360, 360));
  const Pose pose = pose_from(xyz_m, rpy_deg);
  return frd ? flu_from_frd(pose) : pose;
}

SceneFile read_scene_file(const Node& node, const std::filesystem::path& directory) {
  const std::string given = node.text();
  if (auto found = find_scene(given, directory)) return *std::move(found);
  if (const auto place = directory / given; !given.empty() && !is_absent(place))
    if (const auto opened = open_regular(place); !opened) {
      node.fail(opened.error().text);
      return {given};
    }
  const std::string near = nearest_scene(given, directory);
  const std::string meant = near.empty() ? "; looked in " : "; did you mean \"" + near + "\"? Looked in ";
  node.fail("no such file: \"" + given.substr(0, 256) + "\"" + meant + scene_folders(directory));
  return {given};
}

Water read_water(const Node& node, bool* allow_hot) {
  Water water;
  if (!node.present()) return water;
  Map map = node.map();
  const Node temperature = map.optional("temperature_c");
  water.temperature_c = temperature.number_or(water.temperature_c, Range::between(-2, 40));
  water.salinity_psu = map.optional("salinity_psu").number_or(water.salinity_psu, Range::between(0, 42));
  water.ph = map.optional("ph").number_or(water.ph, Range::between(6, 9));
  water.sound_speed_mps = map.optional("sound_speed_mps").number_or(0, Range::between(0, 2000));
  if (water.sound_speed_mps != 0 && water.sound_speed_mps < 1000)
    map.optional("sound_speed_mps").fail("must be 0 (computed from the rest) or from 1000 to 2000");
  const bool hot_is_meant = map.optional("allow_hot").boolean_or(false);
  if (allow_hot != nullptr) *allow_hot = hot_is_meant;
  if (!hot_is_meant && water.temperature_c >= hot_c)
    temperature.fail(std::string(effect_of_heat) + "add allow_hot: true if that is what you want");
  return water;
}

std::string why_no_water(const Water& water, bool allow_hot) {
  if (!(water.temperature_c >= -2 && water.temperature_c <= 40)) return "temperature_c must be from -2 to 40";
  if (!(water.salinity_psu >= 0 && water.salinity_psu <= 42)) return "salinity_psu must be from 0 to 42";
  if (!(water.ph >= 6 && water.ph <= 9)) return "ph must be from 6 to 9";
  if (water.sound_speed_mps != 0 && !(water.sound_speed_mps >= 1000 && water.sound_speed_mps <= 2000))
    return "sound_speed_mps must be 0 (computed from the rest) or from 1000 to 2000";
  if (water.temperature_c >= hot_c && !allow_hot)
    return std::string(effect_of_heat) + "world.water.allow_hot: true in the configuration allows it";
  return {};
}

protocol::OptionValues read_options(const Node& node, const protocol::Vendor& vendor, bool others_too) {
  protocol::OptionValues given, of_others;
  Map map = node.map();
  for (const protocol::Option& option : vendor.options())
    if (const Node value = map.optional(option.name)) given[std::string(option.name)] = read_option(value, option);
  // Options of other makes are checked and kept, so that a configuration stays valid when its profile is replaced by one of
  // another make.
  if (others_too)
    for (const protocol::Vendor* other : protocol::vendors())
      for (const protocol::Option& option : other->options())
        if (map.has(option.name) && !given.contains(std::string(option.name)))
          of_others[std::string(option.name)] = read_option(map.optional(option.name), option);
  auto complete = check_options(vendor, given);
  if (!complete) node.fail(complete.error().text);
  protocol::OptionValues all = complete.value_or(protocol::OptionValues{});
  all.merge(of_others);
  return all;
}

EngineConfig read_engine(const Node& node, const Switches& defaults) {
  EngineConfig engine;
  engine.switches = defaults;
  if (!node.present()) return engine;
  Map map = node.map();
  engine.threads = static_cast<int>(map.optional("threads").integer_or(0, 0, 256));
  engine.io_priority = static_cast<int>(map.optional("io_priority").integer_or(0, 0, 99));
  engine.device = read_enum(map.optional("device"), engine.device, engine_device_names);
  engine.simd = read_enum(map.optional("simd"), engine.simd, simd_level_names);
  engine.switches.expected_power = map.optional("expected_power").boolean_or(false);
  engine.switches.mode = read_enum(map.optional("mode"), engine.switches.mode, mode_names);
  engine.switches.fixed_fan = static_cast<int>(map.optional("fixed_fan").integer_or(0, 0, most_fixed_rays));
  for (const NamedSwitch& part : named_switches) {
    bool& is_on = engine.switches.*part.is_on;
    const Node given = map.optional(part.name);
    is_on = given.choice_or<bool>(is_on, {{"on", true}, {"off", false}});
    // A switch is refused if the mode or fixed_fan, which are read before the switches, makes it ineffective.
    const std::string why = why_without_effect(engine.switches, part);
    if (given.present() && is_on && !why.empty()) given.fail("has no effect: " + why + "; leave out one of them");
  }
  return engine;
}

LimitConfig read_limits(const Node& node) {
  LimitConfig limits;
  if (!node.present()) return limits;
  Map map = node.map();
  const auto whole = [&map](const char* key, auto& value, std::int64_t least, std::int64_t most) {
    value = static_cast<std::remove_reference_t<decltype(value)>>(
        map.optional(key).integer_or(static_cast<std::int64_t>(value), least, most));
  };
  const auto seconds = [&map](const char* key, std::chrono::milliseconds& value, double least) {
    const double s = map.optional(key).number_or(std::chrono::duration<double>(value).count(), Range::between(least, 3600));
    value = std::chrono::milliseconds(std::llround(1e3 * s));
  };
  whole("clients", limits.clients, 1, 65536);
  whole("control_clients", limits.control_clients, 1, 1024);
  whole("viewers", limits.viewers, 0, 1024);
  whole("input_bytes_per_s", limits.input_bytes_per_s, 1024, std::int64_t{1} << 40);
  whole("pose_bytes_per_s", limits.pose_bytes_per_s, 1024, std::int64_t{1} << 40);
  whole("control_message_bytes", limits.control_message_bytes, 1024, 1 << 20);
  seconds("stall_s", limits.stall, 0.1);
  seconds("dead_peer_s", limits.dead_peer, 3);
  whole("spare_descriptors", limits.spare_descriptors, 0, 65536);
  seconds("load_s", limits.load, 1);
  return limits;
}

}  // namespace sonar
