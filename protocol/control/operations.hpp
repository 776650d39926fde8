// Requests to a running daemon as plain structs: the messages of control.proto, checked and in sonard's frames (world ENU, body
// FLU, SI). protocol/control converts from protobuf and JSON; daemon/server/operations carries them out. Answers and
// events are protobuf classes (protocol/control/answers.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/base/geometry.hpp"
#include "protocol/control/pose_sample.hpp"

namespace sonar::control {

// A fault as users write it: in the configuration, over HTTP, on the control stream, in sonarctl and in Python. The daemon
// checks it (daemon/config/faults/fault.hpp).

struct FaultRecord {
  std::string name;  // unique among the faults of the daemon; empty = made from `what`
  std::string what;  // code or name of a kind, or of a trouble: "L05", "silent-open", "power-cycle"
  std::map<std::string, std::string> with;
  std::string sonar;   // empty = all
  std::string client;  // "" or all, newest, oldest, an ordinal counted from 1, an address, a prefix 10.0.0.0/8
  struct At {          // trigger: at most one member is set; none = the fault begins at once
    std::optional<std::uint64_t> ping, every;
    std::uint64_t phase = 0;  // remainder, with `every`
    std::optional<double> time_s, probability;
    std::string on;  // name of an Occasion
    bool operator==(const At&) const = default;
  } at;
  struct For {  // duration; all members are optional (see Span)
    std::optional<double> seconds;
    std::optional<std::uint64_t> pings, count;
    bool operator==(const For&) const = default;
  } lasts;
  bool operator==(const FaultRecord&) const = default;
};

struct GetStatus {};

/// Pose of the sonar on the vehicle, FLU. Unset parts keep their values.
struct MountChange {
  std::optional<Vec3d> position_m;
  std::optional<Quatd> orientation;
};

/// Unset fields keep their values. Numbers must be finite; the daemon checks them against the product.
struct SetSonar {
  std::string sonar;  // empty = the only one there is
  std::optional<double> range_m, rate_hz, gain_percent;
  std::optional<std::uint32_t> mode, beams;
  std::optional<bool> transmit;
  std::optional<MountChange> mount;
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
/// Playback of the trajectory of a vehicle or a moving object. Unset fields keep their values.
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
  bool labels = false;
};
struct StopRecording {
  std::string file;  // empty = all
};
struct AddFault {
  FaultRecord fault;
};
struct EndFaults {
  std::string name;  // empty = all
};
struct GetFaults {
  bool kinds = false;               // also lists the catalogue
  std::uint64_t journal_after = 0;  // also lists the journal's entries after this number
};
struct Subscribe {
  bool pings = false, clients = false, poses = false, scene = false, faults = false;
};

/// Requests that the daemon executes. The connection handles Hello and Subscribe.
using Operation = std::variant<GetStatus, PoseSample, SetSonar, SetEnvironment, LoadScene, AddObject, RemoveObject, SetObject,
                               SetTrajectory, Step, StartRecording, StopRecording, AddFault, EndFaults, GetFaults>;

using Bytes = std::vector<std::byte>;
using BytesView = std::span<const std::byte>;

inline constexpr std::uint32_t protocol_version = 1;
inline constexpr std::size_t largest_datagram = 1200;
inline constexpr std::size_t largest_json = std::size_t{1} << 20;

struct Hello {
  std::uint32_t protocol_version = control::protocol_version;
  std::string name;
  std::string token = {};  // the content of control.token_file
};
struct Unsupported {  // an unknown request, for example of a newer client
};
struct Request {
  std::uint64_t id = 0;
  std::variant<Unsupported, Hello, PoseSample, GetStatus, SetSonar, SetEnvironment, LoadScene, AddObject, RemoveObject, SetObject,
               SetTrajectory, Step, StartRecording, StopRecording, AddFault, EndFaults, GetFaults, Subscribe>
      op;
};
/// Numbers of v1::Status::Code.
enum class StatusCode { ok = 1, refused, unsupported, failed, unauthenticated };

struct RefusedRequest {  // a refused message, with the id that the Response repeats
  std::uint64_t id = 0;
  std::string why;
  bool pose = false;        // true for a malformed pose
  bool is_protobuf = true;  // true: a Request with wrong content; false: the bytes cannot be parsed
};

}  // namespace sonar::control
