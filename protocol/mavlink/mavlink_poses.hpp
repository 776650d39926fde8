// One MAVLink link as a source of poses: it selects the system and its messages, and makes the messages to send. The inputs are
// datagrams and arrival times; the outputs are poses for the daemon's World, reports and replies.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/geodesy.hpp"
#include "core/base/units.hpp"
#include "protocol/control/pose_sample.hpp"
#include "protocol/mavlink/distances.hpp"
#include "protocol/mavlink/frames.hpp"
#include "protocol/mavlink/paired_poses.hpp"

namespace sonar::mavlink {

/// Sources of poses, best first (docs/poses.md).
enum class Source { odometry, sim_state, mocap, vision, local, global, depth };
inline constexpr std::size_t source_count = 7;
std::string_view name_of(Source source);

struct Settings {
  std::string vehicle;             // a vehicle of the configuration; empty = the only one
  std::uint8_t system_id = 0;      // 0 = the first vehicle that sends
  std::uint8_t component_id = 0;   // 0 = the autopilot, or else the first component that sends a message
  bool request_rates = false;      // true: requests messages from the autopilot
  double rate_hz = 50;             // rate of the requested messages
  std::optional<Geodetic> origin;  // origin of the world; needed for latitudes and longitudes
  bool needs_time = false;         // true: messages without a time stamp are not used
  bool sends_distances = false;    // true: sends every distance of a range finder, until a command changes that
  Vec3d held_m = {};               // x and y (world, ENU) of a vehicle that sends a depth but no position
};

/// FAILURE_TYPE of common.xml.
enum class FailureType : std::uint8_t {
  ok = 0,  // ends the failure
  off = 1,
  stuck = 2,
  garbage = 3,
  wrong = 4,
  slow = 5,
  delayed = 6,
  intermittent = 7,
};
/// FAILURE_UNIT of common.xml that fits a sonar: FAILURE_UNIT_SENSOR_DISTANCE_SENSOR.
inline constexpr std::uint32_t distance_sensor = 7;
/// Carries out MAV_CMD_INJECT_FAILURE. `unit`: FAILURE_UNIT of common.xml; `instance`: 0 = all.
using InjectFailure = std::function<MavResult(std::uint32_t unit, FailureType type, std::uint32_t instance)>;

/// True if the vehicle has a range finder, whose distances can be sent.
using HasRangeFinder = std::function<bool()>;
/// True while the vehicle's poses come from a source other than MAVLink, so that this link need not receive any.
using HasOtherPoses = std::function<bool()>;

struct SourcedPose {
  control::PoseSample sample;
  std::string source;  // such as "system 1 ODOMETRY"
};
struct Reaction {
  std::vector<SourcedPose> poses;
  std::vector<std::string> refusals;  // errors of messages
  std::vector<std::string> notices;   // lines for the log
  std::vector<Bytes> replies;         // datagrams to send: from on_datagram() to the sender, from on_tick() to the vehicle
  bool from_vehicle = false;          // true: the datagram contained a frame of the selected system
};

class MavlinkPoses {
 public:
  static constexpr std::size_t largest_datagram = 8192;
  /// Own component id: an onboard computer, number 3 (MAV_COMP_ID_ONBOARD_COMPUTER3).
  static constexpr std::uint8_t own_component = 193;
  /// Silence after which another system, component or source is accepted.
  static constexpr std::chrono::nanoseconds system_silence = std::chrono::seconds(5);
  static constexpr std::chrono::nanoseconds source_silence = std::chrono::seconds(1);

  /// Without `inject` the command to inject a failure is answered as unsupported.
  /// Without `has_range_finder` the commands that request DISTANCE_SENSOR are answered as unsupported.
  explicit MavlinkPoses(
      Settings settings, InjectFailure inject = {}, HasRangeFinder has_range_finder = [] { return false; },
      HasOtherPoses has_other_poses = [] { return false; });
  /// `now` may have any origin, but must not decrease.
  Reaction on_datagram(BytesView datagram, Time now);
  /// Call it several times per second. Returns heartbeats and requests to send. Reports the selected system and the missing parts
  /// of a pose when poses start or stop, and at growing intervals while none arrive.
  Reaction on_tick(Time now);
  /// Returns one sentence with everything that is missing; empty while poses arrive, here or from another source.
  std::string health_error(Time now) const;
  /// Returns the notice about another system whose messages are ignored, until it has been silent for 5 s; else empty.
  std::string rival(Time now) const;

  /// True if the settings or a command request distances.
  bool wants_distances() const { return distances_.wanted(); }
  /// Returns the datagram of a distance; nullopt if distances are not requested, or if less than the requested interval has
  /// passed since the last datagram of the sensor.
  std::optional<Bytes> distance_message(const DistanceSensor& measured);

  const FrameCounts& counts() const { return counts_; }
  std::optional<std::uint8_t> system() const { return system_; }

 private:
  struct Arrival {
    std::uint8_t component = 0;
    Time at{};
  };
  struct GlobalPlace {
    std::int64_t at_ms = 0;
    Pose enu_in_world;  // ENU axes at the vehicle, in the world
    Vec3d ned_mps;
  };
  /// The depth of a vehicle that sends no position, such as a BlueROV2 without DVL.
  struct Depth {
    std::int64_t at_ms = 0;
    double down_m = 0, down_mps = 0;
    Time received{};
    std::uint32_t message = 0;
  };
  struct Moment {  // context of a message that is being handled
    Time now;
    Reaction& out;
  };

  /// A sender that was reported as ignored: the text of the notice, and the time of its last message.
  struct Ignored {
    std::string text;
    Time last{};
  };

  static constexpr std::size_t most_reported = 16;                                       // limit of reported_ignored_
  static constexpr std::chrono::nanoseconds forgotten_after = std::chrono::seconds(60);  // silence of a sender that leaves it
  /// True if only vehicles or their simulators, not ground stations, send this message.
  static bool contains_pose(std::uint32_t id);
  /// True if only a vehicle sends this frame: the heartbeat of an autopilot, or a pose.
  static bool identifies_vehicle(const Frame& frame);
  /// True if system_id or component_id select other senders.
  bool is_excluded(const Frame& frame) const {
    return (settings_.system_id != 0 && frame.system != settings_.system_id) ||
           (settings_.component_id != 0 && frame.component != settings_.component_id);
  }
  bool is_from_vehicle(const Frame& frame, Time now);
  bool is_selected_component(const Frame& frame, Time now);
  void select_vehicle(std::uint8_t system, Time now);
  void clear_histories();
  void on_frame(const Frame& frame, Moment at);
  void on_command(const CommandLong& command, const Frame& frame, Reaction& out);
  MavResult ask_for_distances(const CommandLong& command);
  void handle(const Heartbeat& m, const Frame& frame);
  void handle(const AttitudeReading& reading, Moment at);
  void handle(const LocalPositionNed& m, Moment at);
  void handle(const GlobalPositionInt& m, Moment at);
  void handle(const GpsGlobalOrigin& m, Moment at);
  void handle(const VfrHud& m, Moment at);
  void handle(const VisionPositionEstimate& m, Moment at);
  void handle(const SimState& m, Moment at);
  void handle(const AttPosMocap& m, Moment at);
  void handle(const Odometry& m, Moment at);

  void join_pairs(Moment at);
  void add_pose_of_depth(const AttitudeReading& reading, Moment at);
  void add_pose(Source source, const control::RawPose& raw, control::Stamp stamp, const Pose& enu_in_world, Moment at);
  std::optional<Pose> placed(std::string_view message, const Result<std::optional<Geodetic>>& place, Moment at);
  control::Stamp stamp_of(Source source, std::uint64_t time_us);
  void on_reset_counter(Source source, std::uint8_t counter);
  void note_boot_time(std::int64_t ms);
  void refuse(std::string_view message, const std::string& why, Moment at);
  void add_counts(const FrameCounts& counts, Reaction& out);
  void report_changes(Time now, Reaction& out);
  std::string report(Time now) const;
  std::string held_text() const;
  std::string missing_inputs(Time now) const;
  bool receives(std::uint32_t message, Time now) const { return received_within(message, now, system_silence); }
  bool received_within(std::uint32_t message, Time now, std::chrono::nanoseconds within) const;
  bool has_poses(Time now) const;
  void note_ignored(const Frame& frame, Moment at);
  void report_ignored(const Frame& frame, Moment at);
  void request_messages(Reaction& out);

  Settings settings_;
  InjectFailure inject_;
  HasRangeFinder has_range_finder_;
  HasOtherPoses has_other_poses_;
  DistanceRequests distances_;
  Identity self_;
  FrameCounts counts_;
  static constexpr std::uint8_t first_autopilot = 1;  // MAV_COMP_ID_AUTOPILOT1
  std::optional<std::uint8_t> system_;
  std::uint8_t autopilot_ = 0, autopilot_component_ = first_autopilot;
  bool has_autopilot_ = false, is_submarine_ = false, sim_state_is_coarse_ = false;
  bool global_has_fix_ = false, sim_state_has_fix_ = false;
  Time found_at_{}, last_received_{}, next_heartbeat_{}, next_request_{}, next_reminder_{};
  std::optional<Time> first_tick_;  // time of the first tick
  std::optional<bool> reported_;    // true: the last report said that poses arrive
  std::chrono::nanoseconds reminder_period_{0};
  std::optional<std::pair<int, int>> ignored_;  // system and component of the last message that is not from the vehicle
  std::map<std::pair<int, int>, Ignored> reported_ignored_;  // by system and component, since the vehicle was selected
  std::pair<int, int> rival_{};                              // the last of these senders that is not in the vehicle's system
  std::map<std::uint32_t, Arrival> received_;

  Attitudes attitudes_;
  PairedPlaces<PlaceReading> local_;
  PairedPlaces<GlobalPlace> global_;
  std::optional<Depth> depth_;
  std::optional<Pose> local_in_world_;  // origin of the autopilot's local axes; nullopt = the world's origin
  std::int64_t newest_boot_ms_ = 0;
  std::array<std::int64_t, source_count> newest_ns_{};
  std::array<std::optional<Time>, source_count> last_pose_{};
  std::array<bool, source_count> timeless_{};  // true: the log has the notice that messages have no time stamp
  std::array<std::optional<std::uint8_t>, source_count> reset_counter_{};
  std::uint32_t resets_ = 0;
};

}  // namespace sonar::mavlink
