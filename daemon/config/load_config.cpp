#include "daemon/config/load_config.hpp"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <utility>
#include <vector>

#include "core/base/regular_file.hpp"
#include "core/text/decimal.hpp"
#include "core/text/strict_yaml.hpp"
#include "daemon/config/config_parts.hpp"
#include "daemon/config/products.hpp"
#include "daemon/config/scene_file.hpp"
#include "protocol/host.hpp"

namespace sonar {
namespace {

using text::Map;
using text::Node;
using text::Range;

Ipv4 read_ip(const Node& node, Ipv4 fallback = {}) {
  if (!node.present()) return fallback;
  const auto ip = parse_ipv4(node.text(64));
  if (!ip) node.fail(ip.error().text);
  return ip.value_or(fallback);
}

/// Reads the address of one computer, or 0.0.0.0.
Ipv4 read_host_ip(const Node& node, Ipv4 fallback = {}) {
  const Ipv4 ip = read_ip(node, fallback);
  if (const std::string why = why_not_of_a_computer(ip); !why.empty()) node.fail(why);
  return ip;
}

Ipv4 read_netmask(const Node& node) {
  const Ipv4 mask = read_ip(node);
  const std::uint32_t zeros = ~text::number_from_ipv4(mask);
  if (node.present() && (zeros & (zeros + 1)) != 0)  // true if a zero bit precedes a one
    node.fail(text_of(mask) + " is not a netmask: give ones followed by zeros, such as 255.255.255.0");
  return mask;
}

AddressRange read_range(const Node& node) {
  const std::string text = node.text(64);
  const std::size_t slash = text.find('/');
  const auto ip = parse_ipv4(std::string_view(text).substr(0, slash));
  const auto bits = slash == std::string::npos ? std::optional<std::int64_t>(32) : text::parse_integer(text.substr(slash + 1));
  if (!ip || !bits || *bits < 0 || *bits > 32) {
    node.fail("is not an address range; write it as 192.168.1.0/24");
    return {};
  }
  return {*ip, static_cast<int>(*bits)};
}

void read_world(Map map, Config& config, const std::filesystem::path& directory) {
  config.scene = read_scene_file(map.required("scene"), directory);
  config.seed = map.optional("seed").unsigned_integer_or(1);
  config.origin = read_origin(map.optional("origin"));
  config.water = read_water(map.optional("water"), &config.allow_hot);
}

/// Reads a name, which must fit into text lines and paths of HTTP requests.
std::string read_name_text(const Node& node, std::size_t longest) {
  std::string name = node.text(longest);
  const bool fits = name.find('/') == std::string::npos && std::none_of(name.begin(), name.end(), [](char c) {
                      return static_cast<unsigned char>(c) < ' ' || c == '\x7f';
                    });
  if (!fits) node.fail("a name has no \"/\" and no control characters such as line ends");
  return name;
}

/// Reads the name of one of several entries; `taken` contains the names of earlier entries.
Node read_name(Map& map, std::size_t longest, std::set<std::string>& taken, std::string& name) {
  const Node node = map.required("name");
  name = read_name_text(node, longest);
  if (!taken.insert(name).second && node.present()) node.fail("\"" + name + "\" is used twice");
  return node;
}

void read_vehicles(const Node& node, TrajectoryFiles& files, Config& config) {
  std::set<std::string> names;
  for (const Node& item : node.items(1, 64)) {
    Map map = item.map();
    VehicleConfig vehicle;
    read_name(map, 64, names, vehicle.name);
    const Node initial_pose = map.optional("initial_pose");
    vehicle.has_initial_pose = initial_pose.present();
    vehicle.initial_pose = read_world_pose(initial_pose);
    vehicle.plan = files.read_plan(map.optional("trajectory"), vehicle.name, &vehicle.orbits);
    config.vehicles.push_back(std::move(vehicle));
  }
}

void read_objects(const Node& node, TrajectoryFiles& files, Config& config) {
  std::set<std::string> names;
  for (const Node& item : node.items(0, 256)) {
    Map map = item.map();
    ObjectConfig object;
    const Node name = read_name(map, 256, names, object.name);
    object.place = name.location() + ": " + name.path();
    object.plan = files.read_plan(map.required("trajectory"), object.name);
    config.objects.push_back(std::move(object));
  }
}

std::size_t read_vehicle_of(Map& map, const Config& config) {
  const Node node = map.optional("vehicle");
  if (!node.present()) {
    if (config.vehicles.size() > 1) map.required("vehicle");
    return 0;
  }
  std::vector<std::string_view> names;
  for (const VehicleConfig& v : config.vehicles) names.push_back(v.name);
  return node.choice_index(std::move(names));
}

void read_addresses(Map& map, SonarConfig& sonar) {
  sonar.bind_ip = read_host_ip(map.required("bind_ip"));
  const bool any = sonar.bind_ip == Ipv4{};
  const Node advertise = any ? map.required("advertise_ip") : map.optional("advertise_ip");
  sonar.advertise_ip = read_host_ip(advertise, sonar.bind_ip);
  if (advertise.present() && sonar.advertise_ip == Ipv4{})
    advertise.fail("drivers cannot connect to 0.0.0.0; give the address of this computer in their network");
  const Node netmask = map.optional("netmask");
  sonar.has_own_netmask = netmask.present();
  sonar.netmask = read_netmask(netmask);
  for (const Node& to : map.optional("status_to").items(0, 16)) sonar.status_to.push_back(read_endpoint(to, false));
  sonar.has_own_status_to = !sonar.status_to.empty();
  for (const Node& group : map.optional("groups").items(0, 16)) sonar.groups.push_back(read_ip(group));
  derive_addresses(sonar);
}

/// Reads one sonar. After an error, which the document keeps, reading continues, and a value may be a default.
SonarConfig read_sonar(Map map, const Config& config, std::size_t index) {
  SonarConfig sonar;
  const Node name = map.required("name");
  sonar.name = read_name_text(name, 64);
  const Node profile_node = map.required("profile");
  const auto profile = protocol::find_profile(profile_node.text(64));
  if (!profile) profile_node.fail(profile.error().text);
  sonar.vehicle = read_vehicle_of(map, config);
  sonar.mount = read_mount(map.optional("mount"));
  read_addresses(map, sonar);
  sonar.device_id = static_cast<std::uint16_t>(map.optional("device_id").integer_or(7001 + static_cast<int>(index), 1, 65535));
  if (Node node = map.optional("clients")) {
    Map clients = node.map();
    sonar.max_clients =
        static_cast<int>(clients.optional("max").integer_or(profile ? profile->vendor->default_max_clients() : 1, 1, 16));
    sonar.when_full = read_enum(clients.optional("when_full"), sonar.when_full, when_clients_full_names);
  } else if (profile) {
    sonar.max_clients = profile->vendor->default_max_clients();
  }
  const int observers_of_product = profile ? default_max_observers(*profile->vendor) : 0;
  sonar.max_observers = observers_of_product;
  if (Node node = map.optional("observers")) {
    Map observers = node.map();
    sonar.max_observers = static_cast<int>(observers.optional("max").integer_or(observers_of_product, 0, 16));
    sonar.observer_port = static_cast<std::uint16_t>(observers.optional("port").integer_or(0, 0, 65535));
    // A product with several clients, or with pings over UDP, has no port for observers.
    if (observers_of_product == 0) sonar.max_observers = 0;
  }
  if (Node node = map.optional("outbox")) {
    Map outbox = node.map();
    sonar.outbox.depth = static_cast<int>(outbox.optional("depth").integer_or(1, 1, OutboxRules::deepest));
    sonar.outbox.when_full = read_enum(outbox.optional("full"), sonar.outbox.when_full, when_full_names);
  }
  sonar.overload = read_enum(map.optional("overload"), sonar.overload, overload_names);
  sonar.bearings = read_enum(map.optional("bearing"), sonar.bearings, bearings_names);
  const Node options = map.optional("options");
  if (profile) {
    sonar.profile = *profile;
    sonar.options = read_options(options, *profile->vendor, true);
    const auto tuned = profile->vendor->tuned(profile->model, sonar.options);
    if (!tuned) options.fail(tuned.error().text);
    sonar.profile.model = tuned.value_or(profile->model);
  } else if (options.present()) {
    // The product is unknown, which is already reported, so its options cannot be checked. This call prevents errors about
    // unknown keys.
    options.map().entries();
  }
  for (const SonarConfig& other : config.sonars) {  // present(): a missing key is not reported again as a duplicate
    if (name.present() && other.name == sonar.name) name.fail("\"" + sonar.name + "\" is used twice");
    if (map.has("bind_ip") && other.bind_ip == sonar.bind_ip)
      map.required("bind_ip").fail(text_of(sonar.bind_ip) + " is already used by sonar \"" + other.name +
                                   "\"; each sonar needs its own address");
    if (other.device_id == sonar.device_id)
      map.optional("device_id").fail(std::to_string(sonar.device_id) + " is already used by sonar \"" + other.name + "\"");
  }
  return sonar;
}

PoseListener read_listener(const Node& node, std::uint16_t default_port, bool has_ranges) {
  PoseListener listener{true, {{127, 0, 0, 1}, default_port}};
  if (!node.present()) return listener;
  if (node.text(64) == "off") return {false, {}};
  listener.at = read_endpoint(node, true);
  if (!is_loopback(listener.at.ip) && !has_ranges)
    node.fail("poses from other computers need poses.allow_from, e.g. allow_from: [192.168.1.0/24]");
  return listener;
}

void read_poses(const Node& node, const Config& config, PoseConfig& poses) {
  poses.protobuf.at = {{127, 0, 0, 1}, 14770};
  poses.json.at = {{127, 0, 0, 1}, 14771};
  if (!node.present()) return;
  Map map = node.map();
  for (const Node& range : map.optional("allow_from").items(0, 64)) poses.allow_from.push_back(read_range(range));
  poses.protobuf = read_listener(map.optional("protobuf"), 14770, !poses.allow_from.empty());
  poses.json = read_listener(map.optional("json"), 14771, !poses.allow_from.empty());
  poses.mavlink = read_mavlink(map.optional("mavlink"), !poses.allow_from.empty(), config);
  if (poses.protobuf.enabled && poses.protobuf == poses.json && poses.json.at.port != 0)
    map.optional("json").fail("the same address as poses.protobuf; give each its own port");
  poses.extrapolate_max_s = map.optional("extrapolate_max_s").number_or(poses.extrapolate_max_s, Range::between(0, 10));
  poses.stale_after_s = map.optional("stale_after_s").number_or(poses.stale_after_s, Range::between(0.01, 3600));
  poses.max_jump_m = map.optional("max_jump_m").number_or(poses.max_jump_m, Range::between(0.001, 1e7));
  poses.on_stale = read_enum(map.optional("on_stale"), poses.on_stale, on_stale_names);
}

void read_log(const Node& node, LogOptions& log) {
  if (!node.present()) return;
  Map map = node.map();
  log.level = read_enum(map.optional("level"), log.level, log_levels);
  log.json = map.optional("format").choice_or<bool>(false, {{"text", false}, {"json", true}});
}

RecordingConfig read_recording(const Node& node, const std::filesystem::path& directory) {
  if (!node.present()) return {};
  Map map = node.map();
  const Node folder = map.required("folder");
  const std::filesystem::path path = (directory / folder.text()).lexically_normal();
  if (const std::string why = folder.present() ? why_no_files_in(path) : ""; !why.empty())
    folder.fail(why + ": " + path.string() + "; recordings need an existing folder to which sonard can write");
  return {path};
}

Result<Config> read(const text::Document& document, const std::string& name, const std::filesystem::path& directory) {
  Config config;
  config.source = name;
  Map root = document.root();
  // For files of other kinds the error names the kind, which helps more than errors about keys.
  if (root.has("dataset") && !root.has("world"))
    return failure(ErrorKind::config, name + ": this is a data set's job, not a configuration: sonard dataset " + name +
                                          " --out DIR (docs/datasets.md)");
  if (root.has("scene") && !root.has("world"))
    return failure(ErrorKind::config,
                   name + ": this is a render file, not a configuration: sonard render " + name + " --out DIR (docs/render.md)");
  if (root.has("objects") && !root.has("world") && !root.has("vehicles") && !root.has("sonars"))
    return failure(ErrorKind::config, name +
                                          ": this looks like a scene, not a configuration, which names its scene: world: "
                                          "{scene: FILE} (docs/configuration.md)");
  read_world(root.required("world").map(), config, directory);
  // Vehicles are read first, because sonars and MAVLink links refer to them; faults are read after sonars.
  TrajectoryFiles files(directory);
  read_vehicles(root.required("vehicles"), files, config);
  read_objects(root.optional("objects"), files, config);
  std::size_t index = 0;
  for (const Node& item : root.required("sonars").items(1, 64)) config.sonars.push_back(read_sonar(item.map(), config, index++));
  read_poses(root.optional("poses"), config, config.poses);
  config.control = read_control(root.optional("control"), directory);
  config.engine = read_engine(root.optional("engine"));
  config.limits = read_limits(root.optional("limits"));
  config.recording = read_recording(root.optional("recording"), directory);
  config.faults = read_faults(root.optional("faults"), config.sonars, directory);
  const Node clock = root.optional("clock");
  config.clock = read_enum(clock, config.clock, clock_modes);
  config.clock_place = clock.present() ? clock.location() + ": " + clock.path() : name + ": clock";
  read_log(root.optional("log"), config.log);
  // Returns the first error of all keys, unknown keys included.
  if (auto error = document.finish()) return tl::make_unexpected(*error);
  return config;
}

/// Returns the configuration of the demo, with the demo product of the first make.
std::string demo_yaml() {
  std::string yaml = R"(world:
  scene: demo.yaml
  seed: 1
vehicles:
  - name: rov
    initial_pose: {frame: ENU_FLU, xyz_m: [-7, 0, -3]}
    trajectory: orbit
sonars:
  - name: front
    mount: {frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}
    bind_ip: 127.0.0.2
)";
  return yaml.append("    profile: ").append(protocol::makes().front().demo_profile).append("\n");
}

}  // namespace

Result<void> check_time_can_pass(const Config& config) {
  const bool has_control = config.control.stream.enabled || config.control.http.enabled;
  const bool has_poses = config.poses.protobuf.enabled || config.poses.json.enabled || !config.poses.mavlink.empty();
  const char* why = nullptr;
  if (config.clock == ClockMode::lockstep && !has_control)
    why = "lockstep advances time by control requests, and control.stream and control.http are off: leave one on";
  if (config.clock == ClockMode::follow && !has_control && !has_poses)
    why =
        "follow advances time by the stamps of poses, and poses.protobuf, poses.json, poses.mavlink and control are off: leave "
        "one on";
  return why == nullptr ? Result<void>{} : failure(ErrorKind::config, config.clock_place + ": " + why);
}

Result<Config> load_config(const std::filesystem::path& file) {
  const auto document = text::parse_yaml_file(file, {.error_kind = ErrorKind::config});
  if (!document) return tl::make_unexpected(document.error());
  return read(*document, file.string(), file.parent_path());
}

Result<Config> parse_config(std::string_view yaml, const std::string& name, const std::filesystem::path& directory) {
  const auto document = text::parse_yaml(yaml, name, {.error_kind = ErrorKind::config});
  if (!document) return tl::make_unexpected(document.error());
  return read(*document, name, directory);
}

/// Unlike other configurations, the demo accepts faults, shows previews, and can record into a folder that it creates.
Result<Config> demo_config() {
  auto config = parse_config(demo_yaml(), "demo", {});
  if (!config) return config;
  config->scene = {"demo.yaml", true};  // always the built-in scene, even if a file has that name
  config->previews = config->faults.armed = true;
  config->recording = {std::filesystem::absolute("sonard-recordings"), true};
  return config;
}

namespace {

std::vector<std::filesystem::path> search_path() {
  std::vector<std::filesystem::path> places = {"./sonard.yaml"};
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    places.push_back(std::filesystem::path(home) / ".config/sonard/sonard.yaml");
  places.push_back("/etc/sonard/sonard.yaml");
  return places;
}

}  // namespace

Result<FoundConfig> find_config(const std::string& file, bool demo) {
  const auto found = [](Result<Config> config, std::string how, std::filesystem::path path = {}) -> Result<FoundConfig> {
    if (!config) return tl::make_unexpected(config.error());
    return FoundConfig{*std::move(config), std::move(how), std::move(path)};
  };
  if (demo) return found(demo_config(), "built-in demo");
  if (!file.empty()) return found(load_config(file), file, file);
  std::string searched;
  for (const auto& path : search_path()) {
    std::error_code error;
    (void)std::filesystem::symlink_status(path, error);
    const bool is_closed = error == std::errc::permission_denied;  // `sudo -u` may keep the HOME of another user
    if (!is_closed && !is_absent(path)) return found(load_config(path), path.string(), path);
    searched += (searched.empty() ? "" : ", ") + path.string();
  }
  return found(demo_config(), "none found (looked in " + searched + ") -> demo");
}

}  // namespace sonar
