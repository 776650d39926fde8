// The configuration file as a tree of structs with defaults, read and validated once (docs/configuration.md). Options of the
// command line and environment variables override values in it.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/geodesy.hpp"
#include "core/base/geometry.hpp"
#include "core/base/result.hpp"
#include "core/motion/trajectory.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/sonar/water.hpp"
#include "daemon/config/addresses.hpp"
#include "daemon/config/faults/fault.hpp"
#include "daemon/config/runtime_options.hpp"
#include "daemon/config/scene_file.hpp"
#include "protocol/vendor.hpp"

namespace sonar {

// Enums, and the names of their values in a configuration (core/base/enum_names.hpp).
enum class WhenClientsFull { close_new, take_over, queue };
inline constexpr std::array<std::string_view, 3> when_clients_full_names = {"close_new", "take_over", "queue"};
enum class OnStale { hold, blank, stop };
inline constexpr std::array<std::string_view, 3> on_stale_names = {"hold", "blank", "stop"};
enum class Overload { slow, count };  // what ticks without a ping cause: a lower rate, or gaps in the ping numbers
inline constexpr std::array<std::string_view, 2> overload_names = {"slow", "count"};

struct VehicleConfig {
  std::string name;
  Pose initial_pose;  // pose in the world
  bool orbits = false;
  motion::Plan plan{};            // trajectory, if the vehicle does not orbit
  bool has_initial_pose = false;  // true: the file states the initial pose
};
/// A moving object of the scene that follows a trajectory.
struct ObjectConfig {
  std::string name;
  motion::Plan plan;
  std::string place;  // "file:line:col: key.path", for errors that are found with the scene
};
struct SonarConfig {
  std::string name;
  protocol::Profile profile;
  std::size_t vehicle = 0;  // index into Config::vehicles
  Pose mount;               // pose of the sonar in the vehicle, FLU
  Ipv4 bind_ip{}, advertise_ip{}, netmask{};
  std::vector<Endpoint> status_to;                          // port 0 = the port of the vendor
  bool has_own_netmask = false, has_own_status_to = false;  // true: the file states the value; false: derived from advertise_ip
  std::uint16_t device_id = 0;
  std::vector<Ipv4> groups;  // broadcast and multicast addresses that clients may name as receivers
  int max_clients = 1;
  WhenClientsFull when_full = WhenClientsFull::close_new;
  int max_observers = 4;            // limit of connections that only receive; 0 = none
  std::uint16_t observer_port = 0;  // 0 = any free port
  OutboxRules outbox;
  Overload overload = Overload::slow;
  Bearings bearings = Bearings::are_true;
  protocol::OptionValues options;  // including defaults
};
struct PoseListener {
  bool enabled = true;
  Endpoint at;
  bool operator==(const PoseListener&) const = default;
};
/// A MAVLink link for poses (docs/poses.md, "MAVLink").
struct MavlinkConfig {
  bool dials = false;  // true (udpout): sonard sends first, and accepts messages only from `at`
  Endpoint at;
  std::string vehicle;
  std::uint8_t system_id = 0, component_id = 0;  // 0 = the ids of the first message
  bool request_rates = false;                    // true: requests messages from the autopilot, at rate_hz
  double rate_hz = 50;
  bool distance_sensor = false;  // true: sends the distances of the vehicle's range finders
  bool operator==(const MavlinkConfig&) const = default;
};
struct PoseConfig {
  PoseListener protobuf, json;
  std::vector<MavlinkConfig> mavlink;
  std::vector<AddressRange> allow_from;  // empty = any sender (loopback only)
  double extrapolate_max_s = 0.2;
  double stale_after_s = 1.0;
  OnStale on_stale = OnStale::hold;
  double max_jump_m = 50;
};
/// A site whose pages may open the live view (docs/live-view.md), as in the Origin header: "https://example.com".
struct ViewOrigin {
  std::string origin;
  bool steer = false;  // false: pages of this origin cannot change anything
  bool operator==(const ViewOrigin&) const = default;
};
/// The control interfaces (docs/control.md).
struct ControlConfig {
  PoseListener stream{true, {{127, 0, 0, 1}, 14770}};  // TCP: the control stream
  PoseListener http{true, {{127, 0, 0, 1}, 8088}};
  bool stream_given = false,
       http_given = false;           // true: the file states the address; only then is an address in use an error
  std::filesystem::path token_file;  // empty = none; required if a listener is not on loopback
  std::vector<std::string> hosts;    // names that Host and Origin of HTTP may have, besides addresses and localhost
  std::vector<ViewOrigin> view_origins;
  bool operator==(const ControlConfig&) const = default;
};
/// Resource limits for clients.
struct LimitConfig {
  int clients = 256;         // limit for all sonars together; SonarConfig::max_clients (16) is the limit for one sonar
  int control_clients = 32;  // limit for clients of the stream, and separately for those of HTTP
  int viewers = 8;           // limit for the viewers of the live view among the clients of HTTP
  std::size_t input_bytes_per_s = 1u << 20;      // limit for one client; above it reading slows down
  std::size_t pose_bytes_per_s = 2u << 20;       // limit for all pose connections together
  std::size_t control_message_bytes = 1u << 20;  // limit for one message of the stream or one body of HTTP
  std::chrono::milliseconds stall{10000};        // a client that reads no byte for this time is reset
  std::chrono::milliseconds dead_peer{15000};    // a client whose computer does not answer is reset
  int spare_descriptors = 32;                    // file descriptors reserved for the daemon
  std::chrono::milliseconds load{120000};        // a scene that takes longer to load makes the daemon unhealthy
};
/// Recordings by control requests (docs/recording.md).
struct RecordingConfig {
  std::filesystem::path folder;  // must exist; empty = recording is off
  bool is_made = false;          // true in the demo: created when the first recording begins
};
/// Injected faults (docs/faults.md).
struct FaultConfig {
  bool armed = false;             // false: every request for a fault is refused
  std::filesystem::path journal;  // JSON lines are appended to it; empty = none
  std::vector<FaultRecord> plan;  // faults that are already checked
  std::string plan_place;         // "file:line:col: faults.plan", for errors that are found with the command line
  bool operator==(const FaultConfig&) const = default;
};
inline constexpr int most_fixed_rays = 100000;  // per column
/// Engines of pings (docs/cuda.md).
enum class EngineDevice { cpu, cuda, automatic };
inline constexpr std::array<std::string_view, 3> engine_device_names = {"cpu", "cuda", "auto"};

/// The switches of products: the canonical model with the side lobes of the elevation pattern. A sonar without a profile has the
/// defaults of Switches, with which the closed forms of the main lobe are valid.
inline constexpr Switches product_switches = [] {
  Switches s;
  s.side_lobes = true;
  return s;
}();

struct EngineConfig {
  int threads = 0;      // 0 = all cores
  int io_priority = 0;  // 1 to 99: the I/O thread is scheduled in real time (SCHED_FIFO); 0 = normally
  EngineDevice device = EngineDevice::cpu;
  SimdLevel simd = SimdLevel::automatic;
  Switches switches = product_switches;
};

struct Config {
  std::string source;  // name of the file, or "demo"
  SceneFile scene;     // result of find_scene()
  std::uint64_t seed = 1;
  std::optional<Geodetic> origin;  // origin of latitudes and longitudes
  Water water;
  bool allow_hot = false;  // true: accepts water of 30 C or more
  std::vector<VehicleConfig> vehicles;
  std::vector<ObjectConfig> objects;
  std::vector<SonarConfig> sonars;
  PoseConfig poses;
  ControlConfig control;
  LimitConfig limits;
  RecordingConfig recording;
  FaultConfig faults;
  EngineConfig engine;
  ClockMode clock = ClockMode::realtime;
  std::string clock_place;  // file:line:col: clock, for errors found with the command line
  bool previews = false;    // demo only: viewers see pings while no driver is connected (docs/live-view.md)
  LogOptions log;
};

/// Returns the names of the vehicle's sonars that measure a distance with each ping.
std::vector<std::string> range_finders_of(const Config& config, const std::string& vehicle);

/// Fills netmask and status_to from advertise_ip, unless the file gives them.
void derive_addresses(SonarConfig& sonar);
/// Returns the address to which drivers connect.
inline Ipv4 address_for_drivers(const SonarConfig& sonar) { return sonar.bind_ip == Ipv4{} ? sonar.advertise_ip : sonar.bind_ip; }
/// Moves the first sonar to another address, and changes all derived values. Errors are sentences about the option.
Result<void> rebind(Config& config, std::string_view address);

}  // namespace sonar
