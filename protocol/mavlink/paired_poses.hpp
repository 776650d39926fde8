// Joins attitudes and positions, which arrive in different messages, to whole poses with the time stamps of the sender.
// protocol/mavlink/mavlink_poses.hpp has one queue for local and one for satellite positions; both use the same attitudes.
#pragma once

#include <deque>
#include <optional>

#include "core/base/geodesy.hpp"
#include "core/base/result.hpp"
#include "protocol/control/pose_sample.hpp"
#include "protocol/mavlink/messages.hpp"

namespace sonar::mavlink {

// Converts single messages to control::RawPose: north-east-down world, forward-right-down body.
// protocol/mavlink/mavlink_poses.hpp selects the messages to use.

/// Attitude of the body (FRD) in NED, at a time of the sender's clock.
struct AttitudeReading {
  std::int64_t at_ms = 0;
  Quatd frd_in_ned;
  Vec3d rates_radps;  // about the body's axes
};
AttitudeReading attitude_of(const Attitude& m);
AttitudeReading attitude_of(const AttitudeQuaternion& m);

/// A position and the velocity, both north, east, down [m, m/s].
struct PlaceReading {
  std::int64_t at_ms = 0;
  Vec3d ned_m;
  Vec3d ned_mps;
};
PlaceReading place_of(const LocalPositionNed& m);

/// Returns the position, which is sent as degrees times 1e7; nullopt for 0, 0, which autopilots send without a fix. Errors: an
/// impossible latitude, longitude or altitude.
Result<std::optional<Geodetic>> geodetic_of(const GlobalPositionInt& m);
Result<std::optional<Geodetic>> geodetic_of(const GpsGlobalOrigin& m);
/// Returns the position from the integers of the message; if they are 0, from the floats.
Result<std::optional<Geodetic>> geodetic_of(const SimState& m);

control::RawPose raw_pose(const AttitudeReading& attitude, const PlaceReading& place);
/// Returns attitude and velocities. The position is 0, because geodetic_of() reads it.
control::RawPose raw_pose(const SimState& m);
control::RawPose raw_pose(const AttPosMocap& m);
control::RawPose raw_pose(const VisionPositionEstimate& m);
/// Returns the pose. Errors: an unsupported frame_id or child_frame_id.
Result<control::RawPose> raw_pose(const Odometry& m);

/// True if the message has its position in the integer extensions, which version 1 cannot contain.
bool has_exact_position(const SimState& m);

/// The newest attitudes, in order of the sender's time.
class Attitudes {
 public:
  /// Between two attitudes with a larger difference in time there is no interpolation; a position between them gets no attitude.
  static constexpr std::int64_t longest_gap_ms = 1000;
  /// The newest attitude is extrapolated with its angular rates for at most this time.
  static constexpr std::int64_t longest_carry_ms = 20;

  /// `later`: the attitude is unknown until a newer reading arrives. `never`: the time is before the first reading, or in a gap
  /// that is too long.
  enum class Answer { known, later, never };
  void put(const AttitudeReading& reading);
  void clear() { readings_.clear(); }
  bool empty() const { return readings_.empty(); }
  /// Finds the attitude at a time, interpolated between two readings or extrapolated from the newest. `out` is set only for the
  /// result `known`.
  Answer at(std::int64_t at_ms, AttitudeReading& out) const;

 private:
  static constexpr std::size_t most = 64;
  std::deque<AttitudeReading> readings_;
};

/// Positions that wait for an attitude at their time, oldest first.
template <class Place>
class PairedPlaces {
 public:
  struct Paired {
    AttitudeReading attitude;
    Place place;
  };
  void put(const Place& place) {
    waiting_.push_back(place);
    if (waiting_.size() > most) waiting_.pop_front();
  }
  void clear() { waiting_.clear(); }
  /// Returns the next position, in order of arrival, whose attitude is known. Drops positions whose attitude will never be known.
  std::optional<Paired> next(const Attitudes& attitudes) {
    while (!waiting_.empty()) {
      Paired paired;
      const Attitudes::Answer answer = attitudes.at(waiting_.front().at_ms, paired.attitude);
      if (answer == Attitudes::Answer::later) return std::nullopt;
      paired.place = waiting_.front();
      waiting_.pop_front();
      if (answer == Attitudes::Answer::known) return paired;
    }
    return std::nullopt;
  }

 private:
  static constexpr std::size_t most = 16;
  std::deque<Place> waiting_;
};

}  // namespace sonar::mavlink
