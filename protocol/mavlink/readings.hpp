// Contents of single messages as control::RawPose: north-east-down world, forward-right-down body.
// protocol/mavlink/mavlink_poses.hpp selects the messages to use.
#pragma once

#include <optional>

#include "core/base/geodesy.hpp"
#include "core/base/result.hpp"
#include "protocol/control/pose_sample.hpp"
#include "protocol/mavlink/messages.hpp"

namespace sonar::mavlink {

/// Attitude of the body (FRD) in NED, at a moment of the sender's clock.
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

/// The position, sent as degrees times 1e7; nullopt for 0, 0, which autopilots send without a fix. Errors: a latitude or
/// longitude beyond the globe's.
Result<std::optional<Geodetic>> geodetic_of(const GlobalPositionInt& m);
Result<std::optional<Geodetic>> geodetic_of(const GpsGlobalOrigin& m);
/// The position from the integers of the message; if they are 0, from the floats.
Result<std::optional<Geodetic>> geodetic_of(const SimState& m);

control::RawPose raw_pose(const AttitudeReading& attitude, const PlaceReading& place);
/// Attitude and velocities. The position stays 0, because geodetic_of() reads it.
control::RawPose raw_pose(const SimState& m);
control::RawPose raw_pose(const AttPosMocap& m);
control::RawPose raw_pose(const VisionPositionEstimate& m);
/// Errors: an unsupported frame_id or child_frame_id.
Result<control::RawPose> raw_pose(const Odometry& m);

/// True if the message has its position in the integer extensions, which version 1 cannot contain.
bool has_exact_position(const SimState& m);

}  // namespace sonar::mavlink
