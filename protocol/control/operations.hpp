// Requests to a running daemon, its status and events, as plain structs: the messages of control.proto, checked and in sonard's
// frames (world ENU, body FLU, SI). protocol/control converts from protobuf and JSON; daemon/server/operations.hpp executes
// requests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/geometry.hpp"
#include "protocol/control/pose_sample.hpp"

namespace sonar::control {

struct GetStatus {};

/// Fields that are not given keep their values. Finite numbers only; the daemon checks them against the product.
struct SetSonar {
  std::string sonar;  // empty = the only one there is
  std::optional<double> range_m, rate_hz, gain_percent;
  std::optional<std::uint32_t> mode, beams;
  std::optional<bool> transmit;
  std::optional<Pose> mount;  // sonar in vehicle, FLU
};
struct SetEnvironment {
  std::optional<double> temperature_c, salinity_psu, ph, sound_speed_mps;
};
struct LoadScene {
  std::string path;
};
struct AddObject {
  std::string name, like, material;
  Pose in_world;
  bool moving = false;
};
struct RemoveObject {
  std::string object;
};
struct SetObject {
  std::string object;
  std::optional<bool> visible;
  std::optional<Pose> in_world;
};
/// Playback of the trajectory of a vehicle or a moving object. Fields that are not given keep their values.
struct SetTrajectory {
  PoseSample::Of of = PoseSample::Of::vehicle;
  std::string name;  // empty = the only vehicle there is
  std::optional<bool> paused;
  std::optional<double> position_s, speed;
};
/// Advances a lockstep clock.
struct Step {
  double dt_s = 0;
};
/// Records the messages of a sonar into a new file in the configuration's recording.folder.
struct StartRecording {
  std::string file;
  std::string sonar = {};  // empty = the only one there is
};
struct StopRecording {
  std::string file;  // empty = all
};
struct Subscribe {
  bool pings = false, clients = false, poses = false, scene = false;
};

/// Requests that the daemon executes; Hello and Subscribe are handled by the connection.
using Operation = std::variant<GetStatus, PoseSample, SetSonar, SetEnvironment, LoadScene, AddObject, RemoveObject, SetObject,
                               SetTrajectory, Step, StartRecording, StopRecording>;

// ---- answers

struct ClientStatus {
  std::string address;
  std::uint64_t pings_written = 0, pings_dropped = 0, bytes_written = 0;
  double connected_s = 0;
};
struct SonarFigures {
  std::uint64_t pings = 0, refused = 0, served = 0, dropped = 0, skipped_ticks = 0, clients = 0, refused_clients = 0;
  double simulation_ms = 0, latency_ms_p50 = 0, latency_ms_p99 = 0, late_ms_p99 = 0;
};
struct SonarStatus {
  std::string name, profile, listens, advertised;
  std::string observers;        // address for connections that only receive, as `listens`; empty = none
  std::uint32_t observing = 0;  // such connections, now
  std::vector<std::string> status_to;
  bool pinging = false, transmits = true;
  double range_m = 0, rate_hz = 0, gain_db = 0, frequency_hz = 0;
  std::uint32_t beams = 0, rows = 0;
  Pose in_world;
  std::vector<ClientStatus> clients;
  SonarFigures figures;
};
struct TrajectoryStatus {
  std::string file;
  double position_s = 0, duration_s = 0, speed = 1;
  bool paused = false, loop = false;
};
struct VehicleStatus {
  std::string name, source;
  bool stale = false;
  Pose in_world;
  std::optional<TrajectoryStatus> trajectory = {};  // when it plays one
};
struct ObjectStatus {
  std::string name, material;
  bool moving = false, visible = true;
  std::uint32_t triangles = 0;
  Pose in_world;
  std::optional<TrajectoryStatus> trajectory = {};
};
struct PoseFigures {
  std::uint64_t accepted = 0, refused = 0, late = 0, replaced = 0, over_rate = 0;
};
struct RecordingStatus {
  std::string sonar, file;
  bool running = false;
  std::uint64_t pings = 0, messages = 0, bytes = 0;  // messages of the sonar, bytes of the file
  std::string why;                                   // reason of its end
};
/// A probable mistake of the configuration that is accepted, or a step that is still missing: a sentence, and what to change.
struct Note {
  std::string vehicle;  // the note's subject; empty = the scene or a sonar
  std::string text, cure;
};
struct DaemonStatus {
  std::string version, config, scene, clock, engine;
  std::uint64_t seed = 0;
  double uptime_s = 0, resident_mb = 0;
  std::vector<SonarStatus> sonars;
  std::vector<VehicleStatus> vehicles;
  std::vector<ObjectStatus> objects;
  PoseFigures poses;
  SetEnvironment environment;  // complete
  std::string control, http;   // addresses listened on; empty = not served
  std::int64_t now_ns = 0;     // the daemon's time
  std::vector<RecordingStatus> recordings;
  std::vector<Note> notes;
};
/// Result of a Step.
struct Stepped {
  std::int64_t now_ns = 0;
  std::uint64_t pings = 0;  // made meanwhile, by all sonars
};

// ---- events

struct PingEvent {
  std::string sonar;
  std::uint32_t number = 0;
  std::int64_t fired_at_ns = 0;
  Pose sonar_in_world;
  double range_m = 0;
  std::uint32_t beams = 0, rows = 0, clients = 0;
  double simulation_ms = 0;
};
struct ClientEvent {
  std::string sonar, client;
  bool connected = false;
  std::string why;
};
struct PoseEvent {
  std::string vehicle;
  bool stale = false;
  std::string text;
};
struct SceneEvent {
  std::string scene, text;
};
struct Event {
  std::variant<PingEvent, ClientEvent, PoseEvent, SceneEvent> what;
  std::uint64_t unsent = 0;  // events this subscriber was too slow for, before this one
};

}  // namespace sonar::control
