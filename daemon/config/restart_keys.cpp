#include "daemon/config/restart_keys.hpp"

namespace sonar {
namespace {

// Each function lists all members of a struct, so that a new member does not compile until it is listed here, either as kept or
// as changed by a reload.
class Keeper {
 public:
  explicit Keeper(std::vector<std::string>& changed) : changed_(changed) {}

  void poses(const PoseConfig& now, PoseConfig& next) {
    const auto& [protobuf, json, mavlink, allow_from, extrapolate_max_s, stale_after_s, on_stale, max_jump_m] = now;
    keep("poses.protobuf", protobuf, next.protobuf);
    keep("poses.json", json, next.json);
    keep("poses.mavlink", mavlink, next.mavlink);
  }
  void control(const ControlConfig& now, ControlConfig& next) {
    const auto& [stream, http, stream_given, http_given, token_file, hosts, view_origins] = now;
    next.stream_given = stream_given, next.http_given = http_given;  // a default address that the file now states is not a change
    keep("control", now, next);
  }
  void limits(const LimitConfig& now, LimitConfig& next) {
    const auto& [clients, control_clients, viewers, input_bytes_per_s, pose_bytes_per_s, control_message_bytes, stall, dead_peer,
                 spare_descriptors, load] = now;
    keep("limits.control_clients", control_clients, next.control_clients);
  }
  void engine(const EngineConfig& now, EngineConfig& next) {
    const auto& [threads, io_priority, device, simd, switches] = now;
    keep("engine.threads", threads, next.threads);
    keep("engine.io_priority", io_priority, next.io_priority);
    keep("engine.device", device, next.device);
    keep("engine.simd", simd, next.simd);
  }
  void log(const LogOptions& now, LogOptions& next) {
    const auto& [level, json, sink] = now;
    if (level != next.level || json != next.json) changed_.emplace_back("log");
    next = now;
  }
  void all(const Config& now, Config& next) {
    const auto& [source, scene, seed, origin, water, allow_hot, vehicles, objects, sonars, of_poses, of_control, of_limits,
                 recording, faults, of_engine, clock, clock_place, previews, of_log] = now;
    poses(of_poses, next.poses);
    keep("world.origin", origin, next.origin);
    control(of_control, next.control);
    limits(of_limits, next.limits);
    engine(of_engine, next.engine);
    keep("faults", faults, next.faults);
    keep("clock", clock, next.clock);
    log(of_log, next.log);
  }

 private:
  template <class T>
  void keep(const char* key, const T& now, T& next) {
    if (now == next) return;
    changed_.emplace_back(key);
    next = now;
  }
  std::vector<std::string>& changed_;
};

}  // namespace

std::vector<std::string> keep_restart_keys(const Config& now, Config& next) {
  std::vector<std::string> changed;
  Keeper(changed).all(now, next);
  return changed;
}

}  // namespace sonar
