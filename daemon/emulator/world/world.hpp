// The poses of vehicles and moving objects. Poses from senders are accepted by the rules of docs/poses.md, "Time and order"; the
// World then returns a pose for any time. Only the daemon's I/O thread uses it, and passes the time.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/motion/trajectory.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/control/operations.hpp"
#include "protocol/control/pose_sample.hpp"

namespace sonar {

// The poses of one body in the last two seconds, and its pose at any time: interpolated, extrapolated for a short time, or held.
// World has one history for each vehicle and moving object. Times are the sender's stamps; World converts our times to them.

class PoseHistory {
 public:
  struct Sample {
    Time at{};
    Pose pose;                                    // pose of the body in the world
    std::optional<Vec3d> velocity_mps;            // in body axes
    std::optional<Vec3d> angular_velocity_radps;  // in body axes
  };
  using Motion = motion::Motion;
  static constexpr std::chrono::nanoseconds length = std::chrono::seconds(2);
  static constexpr std::size_t most_samples = 2048;  // two seconds at the rate limit of 1 kHz

  void clear() { samples_.clear(); }
  bool empty() const { return samples_.empty(); }
  std::size_t size() const { return samples_.size(); }
  const Sample& newest() const { return samples_.back(); }

  /// Adds a sample. `sample.at` must not be before newest().at; an equal time replaces the newest sample.
  void put(const Sample& sample);
  /// Replaces newest(), for poses above the rate limit. `sample.at` must not be before newest().at; the history must not be
  /// empty.
  void replace_newest(const Sample& sample) { samples_.back() = sample; }
  /// Returns the pose at a time. Between samples it is interpolated (lerp, slerp); before the first sample it is held. After the
  /// last sample it is extrapolated for at most `extrapolate_max`, with the sample's velocity or else with the difference of the
  /// last two samples (unless that is a jump), and then held. The history must not be empty.
  Pose at(Time t, std::chrono::nanoseconds extrapolate_max) const;
  /// Returns the motion of the pose of at(): between samples, their difference per time; after the newest sample, its velocity;
  /// zero where the pose is held.
  Motion motion_at(Time t, std::chrono::nanoseconds extrapolate_max) const;

 private:
  using Samples = std::deque<Sample>;
  static Motion between(const Sample& before, const Sample& after);
  Motion newest_motion() const;
  /// Returns the first sample not before t.
  Samples::const_iterator not_before(Time t) const;
  Pose beyond_newest(std::chrono::nanoseconds ahead) const;
  Samples samples_;
};

using motion::rotation_between;
using motion::slerp;

struct PoseRules {
  std::chrono::nanoseconds extrapolate_max = std::chrono::milliseconds(200);
  std::chrono::nanoseconds stale_after = std::chrono::seconds(1);
  double max_jump_m = 50;
  bool stepped = false;      // simulated time: WALL stamps are of the sender's own clock, and the rate is not limited
  bool follows = false;      // simulated time that follows the stamps of the vehicles (world_sources.cpp)
  double most_per_s = 1000;  // stored poses of one body per second; further poses replace the newest
  double burst = 64;         // poses that may arrive at once, because networks deliver delayed packets together
};

/// A vehicle, or a moving object of the scene.
struct BodyStart {
  std::string name;
  Pose initial_pose;    // pose in the world
  bool orbits = false;  // true: circles about the world's z axis until the first accepted pose
  motion::Plan plan{};  // followed until the first accepted pose
};

/// Sender of a pose. A different `id` starts a new history; a different `source` is logged.
struct Sender {
  std::string id;      // such as "json udp 127.0.0.1:40123"
  std::string source;  // such as "json 127.0.0.1"
};

enum class PoseVerdict { accepted, late, unknown_name, bad_time };

struct PoseOutcome {
  PoseVerdict verdict = PoseVerdict::accepted;
  std::string refusal;  // one sentence if the pose is refused
  std::string notice;   // text for the log, such as that the source changed
  std::string body;     // the body to which the notice refers
};

struct PoseCounters {
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;    // malformed poses, unknown names, impossible times
  std::uint64_t late = 0;       // poses that are out of order or repeated
  std::uint64_t replaced = 0;   // poses with equal stamps
  std::uint64_t over_rate = 0;  // poses that replaced the newest because of the rate limit
  std::uint64_t jumps = 0;      // jumps farther than max_jump
  std::uint64_t resets = 0;     // changes of the reset counter
  std::uint64_t histories = 0;  // histories begun by a first pose, another sender, or after silence
  std::uint64_t stale = 0;      // how often a body's poses stopped
};

/// Returns the motion of a sonar mounted on a body, including the velocity at the lever arm because of the body's rotation.
Twist mounted_moves(const PoseHistory::Motion& body_moves, const Pose& body_in_world, const Pose& mount);

class World {
 public:
  World(PoseRules rules, std::vector<BodyStart> vehicles, std::vector<BodyStart> objects, Time start);

  // Call these when the configuration is read again or the scene changes. Bodies with the same name keep their poses, and equal
  // trajectories continue; other trajectories begin at `now`.
  void use_rules(const PoseRules& rules) { rules_ = rules; }
  void use_vehicles(std::vector<BodyStart> vehicles, Time now);
  void use_objects(std::vector<BodyStart> objects, Time now);

  PoseOutcome accept(const control::PoseSample& sample, const Sender& sender, Time now);
  void count_refused() { ++counters_.refused; }

  /// Pauses, resumes, seeks a trajectory or changes its speed, from `now` on. Returns one sentence if that is not possible,
  /// else an empty text.
  std::string steer(const control::SetTrajectory& asked, Time now);
  /// The trajectory that a body follows; valid until the World changes.
  struct Played {
    const std::string& file;
    const motion::Playback& playback;
  };
  std::optional<Played> vehicle_plays(std::size_t vehicle) const { return plays(vehicles_[vehicle]); }
  std::optional<Played> object_plays(std::size_t object) const { return plays(objects_[object]); }

  Pose vehicle_at(std::size_t vehicle, Time t) const { return pose_at(vehicles_[vehicle], t); }
  /// Returns the motion of vehicle_at() at this time; zero if it is implausibly fast.
  PoseHistory::Motion vehicle_moves(std::size_t vehicle, Time t) const;
  std::vector<Pose> objects_at(Time t) const;
  Pose object_at(std::size_t object, Time t) const { return pose_at(objects_[object], t); }
  bool is_hidden(std::size_t object) const { return objects_[object].hidden; }
  /// Hides an object until its next pose, or until show_again().
  void hide(std::size_t object, bool hidden) { objects_[object].hidden = objects_[object].hidden_for_now = hidden; }
  /// Shows objects that hide() has hidden; objects that poses have hidden stay hidden.
  void show_again();
  /// True if poses had arrived and then stopped for longer than the rules allow.
  bool is_stale(std::size_t vehicle, Time now) const { return is_stale(vehicles_[vehicle], now); }
  struct Stale {
    std::string vehicle, sentence;
  };
  /// Returns the vehicles whose poses stopped since the last call.
  std::vector<Stale> newly_stale(Time now);

  // The following functions are for time that follows the vehicles' stamps.
  /// Returns the limit of time: the minimum of the vehicles' newest stamps, ignoring vehicles that lag by more than stale_after;
  /// nullopt before the first pose.
  std::optional<Time> followed_until() const;
  /// Returns the time that stamps have skipped since the last call, for example at the first pose. Orbits and trajectories do not
  /// advance by this time.
  std::chrono::nanoseconds take_skipped();

  std::string_view source_of(std::size_t vehicle) const { return vehicles_[vehicle].source; }
  const PoseCounters& counters() const { return counters_; }

 private:
  struct Track {
    BodyStart body;
    PoseHistory history;
    motion::Playback playback{};  // playback of body.plan
    std::string sender_id, source;
    std::string earlier_sender_id;  // the sender before the last change; empty after silence
    bool rival_reported = false;    // true: a notice that two senders alternate was made
    std::uint64_t seq = 0;
    std::uint32_t reset_counter = 0;
    control::ClockDomain domain{};
    Time last_arrival{};
    std::chrono::nanoseconds offset{0};  // our time = sender's time + offset
    bool hidden = false, hidden_for_now = false, stale_reported = false;
    double allowance = 0;  // number of poses that may be stored now; increases with time
    Time allowance_at{};
  };
  using Ns = std::chrono::nanoseconds;

  std::vector<Track> taken_over(std::vector<Track>& old, std::vector<BodyStart>& bodies, Time now) const;
  Track* find(control::PoseSample::Of kind, const std::string& name, std::string& refusal);
  /// True for WALL stamps in real time, which use the common clock.
  bool has_shared_clock(const control::PoseSample& sample) const {
    return sample.stamp.domain == control::ClockDomain::wall && !rules_.stepped;
  }
  /// True for stamps of the sender's own clock: SIM stamps and, in stepped time, WALL stamps.
  bool has_own_clock(const control::PoseSample& sample) const {
    return sample.stamp.domain != control::ClockDomain::arrival && !has_shared_clock(sample);
  }
  /// Returns one sentence if the time stamp cannot be accepted, else empty.
  std::string why_bad_time(const control::PoseSample& sample, Time at, Time now) const;
  bool continues(const Track& track, const control::PoseSample& sample, const Sender& sender, Time at, Time now) const;
  /// Returns whether the pose continues the history. Refuses late poses, and clears the history at a jump.
  bool is_next(Track& track, const control::PoseSample& sample, Time at, PoseOutcome& out);
  bool has_rival(Track& track, const Sender& sender, Time now) const;
  void keep(Track& track, const control::PoseSample& sample, const Sender& sender, Time at, Time now);
  /// Returns our time minus the time of the sender's clock, which stamped a pose with `at`.
  Ns offset_for(const Track& track, Time at, Time now, bool goes_on);
  Ns followed_offset_for(const Track& track, Time at, Time now);
  bool is_followed(const Track& track, Time newest) const;
  bool over_rate(Track& track, Time now) const;
  bool is_stale(const Track& track, Time now) const;
  Time last_news(const Track& track) const;
  Pose pose_at(const Track& track, Time t) const;
  Pose orbit(const Pose& initial, Time t) const;
  /// Returns pose and motion of a body that follows its trajectory at the speed of the playback.
  static motion::Moment played(const Track& track, Time t);
  static std::optional<Played> plays(const Track& track) {
    if (!track.body.plan || !track.history.empty()) return std::nullopt;
    return Played{track.body.plan.file, track.playback};
  }

  PoseRules rules_;
  std::vector<Track> vehicles_, objects_;
  Time start_;
  std::optional<Time> newest_followed_;  // in our time
  Ns skipped_{0};
  PoseCounters counters_;
};

}  // namespace sonar
