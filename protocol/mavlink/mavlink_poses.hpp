// One MAVLink link as a source of poses: which system is meant, which of its messages count, and what it must be sent.
// No socket and no clock: datagrams and their arrival come in, poses for the daemon's World, sentences and replies go out.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/geodesy.hpp"
#include "core/base/units.hpp"
#include "protocol/control/pose_sample.hpp"
#include "protocol/mavlink/frames.hpp"
#include "protocol/mavlink/paired_poses.hpp"

namespace sonar::mavlink {

/// Where poses can come from, the best first (docs/autopilots.md).
enum class Source { odometry, sim_state, mocap, vision, local, global };
inline constexpr std::size_t source_count = 6;
std::string_view name_of(Source source);

struct Settings {
  std::string vehicle;                           // of the configuration; empty = the only one
  std::uint8_t system_id = 0, component_id = 0;  // 0 = the first that speaks
  bool request_rates = false;                    // ask the autopilot for its messages
  double rate_hz = 50;                           // so often
  std::optional<Geodetic> origin;                // of the world; without it latitudes and longitudes mean nothing
  bool needs_time = false;                       // what bears no time is no source
};

struct SourcedPose {
  control::PoseSample sample;
  std::string source;  // "system 1 ODOMETRY"
};
struct Reaction {
  std::vector<SourcedPose> poses;
  std::vector<std::string> refusals;  // what was wrong, one sentence each
  std::vector<std::string> notices;   // worth a line in the log
  std::vector<Bytes> replies;         // datagrams for whoever sends to us
  bool heard = false;                 // something of the system that is meant was in the datagram
};

class MavlinkPoses {
 public:
  static constexpr std::size_t largest_datagram = 8192;
  /// Component we speak as: an onboard computer, number 3 (MAV_COMP_ID_ONBOARD_COMPUTER3).
  static constexpr std::uint8_t own_component = 193;
  /// After so long without a word another system, component or source may take over.
  static constexpr std::chrono::nanoseconds system_silence = std::chrono::seconds(5);
  static constexpr std::chrono::nanoseconds source_silence = std::chrono::seconds(1);

  explicit MavlinkPoses(Settings settings);
  /// `now` never runs backwards, whatever its origin.
  Reaction on_datagram(BytesView datagram, Time now);
  /// To be called some times a second: heartbeats, requests, and the sentence about who was found and what of a pose is missing:
  /// when it changes whether poses come, and while none come again and again, ever more seldom.
  Reaction on_tick(Time now);
  /// Empty while poses come; else one sentence that names all that is missing.
  std::string trouble(Time now) const;

  const FrameCounts& counts() const { return counts_; }
  std::optional<std::uint8_t> system() const { return system_; }

 private:
  struct Heard {
    std::uint8_t component = 0;
    Time at{};
  };
  struct GlobalPlace {
    std::int64_t at_ms = 0;
    Pose enu_in_world;  // at the vehicle
    Vec3d ned_mps;
  };
  struct Moment {  // what a handler needs beside its message
    Time now;
    Reaction& out;
  };

  bool is_meant(const Frame& frame, Time now);
  bool is_heard(const Frame& frame, Time now);
  void begin(std::uint8_t system, Time now);
  void begin_histories();
  void on_frame(const Frame& frame, Moment at);
  void take(const Heartbeat& m, const Frame& frame);
  void take(const AttitudeReading& reading, Moment at);
  void take(const LocalPositionNed& m, Moment at);
  void take(const GlobalPositionInt& m, Moment at);
  void take(const GpsGlobalOrigin& m, Moment at);
  void take(const VisionPositionEstimate& m, Moment at);
  void take(const SimState& m, Moment at);
  void take(const AttPosMocap& m, Moment at);
  void take(const Odometry& m, Moment at);

  void join_pairs(Moment at);
  void offer(Source source, const control::RawPose& raw, control::Stamp stamp, const Pose& enu_in_world, Moment at);
  std::optional<Pose> placed(std::string_view message, const Result<std::optional<Geodetic>>& place, Moment at);
  control::Stamp stamp_of(Source source, std::uint64_t time_us);
  void on_reset_counter(Source source, std::uint8_t counter);
  void note_boot_time(std::int64_t ms);
  void refuse(std::string_view message, const std::string& why, Moment at);
  void judge(const FrameCounts& counts, Reaction& out);
  void tell(Time now, Reaction& out);
  std::string report(Time now) const;
  std::string what_is_missing(Time now) const;
  bool hears(std::uint32_t message, Time now) const { return has_come(message, now, system_silence); }
  bool has_come(std::uint32_t message, Time now, std::chrono::nanoseconds within) const;
  bool has_poses(Time now) const;
  void pass_over(const Frame& frame) {
    if (frame.component != own_component) passed_over_ = {frame.system, frame.component};
  }
  void request_messages(Reaction& out);

  Settings settings_;
  Speaker us_;
  FrameCounts counts_;
  std::optional<std::uint8_t> system_;
  std::uint8_t autopilot_ = 0, autopilot_component_ = 1;
  bool has_autopilot_ = false, sim_state_is_coarse_ = false;
  bool global_has_fix_ = false, sim_state_has_fix_ = false;
  Time found_at_{}, last_heard_{}, next_heartbeat_{}, next_request_{}, next_reminder_{};
  std::optional<Time> begun_;  // first tick
  std::optional<bool> told_;   // that poses come, or that they do not
  std::chrono::nanoseconds reminder_period_{0};
  std::optional<std::pair<int, int>> passed_over_;  // system and component that spoke last and are not meant
  std::map<std::uint32_t, Heard> heard_;

  Attitudes attitudes_;
  PairedPlaces<PlaceReading> local_;
  PairedPlaces<GlobalPlace> global_;
  std::optional<Pose> local_in_world_;  // where the autopilot's local axes begin; absent: where ours do
  std::int64_t newest_boot_ms_ = 0;
  std::array<std::int64_t, source_count> newest_ns_{};
  std::array<std::optional<Time>, source_count> yielded_{};
  std::array<bool, source_count> timeless_{};  // and the log says so
  std::array<std::optional<std::uint8_t>, source_count> reset_counter_{};
  std::uint32_t resets_ = 0;
};

}  // namespace sonar::mavlink
