// A received pose, checked and converted to our frames: world ENU, body FLU, SI units, int64 nanoseconds. protocol/control
// makes these from protobuf and JSON, protocol/mavlink from MAVLink; daemon/emulator/world/world.hpp keeps them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/geometry.hpp"
#include "core/base/result.hpp"

namespace sonar::control {

/// Returns the error with which readers of the control protocol refuse their input.
inline tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::bad_data, std::move(text)); }

/// An orientation quaternion whose length differs from 1 by more than this is refused.
inline constexpr double largest_norm_error = 1e-3;

/// The clock of a time stamp (docs/poses.md, "Time and order").
enum class ClockDomain {
  wall,     // UNIX time of a computer whose clock agrees with ours
  sim,      // the sender's own clock, with any origin
  arrival,  // no stamp: the time of arrival is used
};
/// About 142 years before and after 1970; sums and differences of such stamps fit int64 nanoseconds.
inline constexpr std::int64_t largest_stamp_ns = 4'500'000'000'000'000'000;
struct Stamp {
  ClockDomain domain = ClockDomain::arrival;
  std::int64_t ns = 0;
};
/// The axes of a sender's poses: axes of the world, and of the body.
enum class Frame { ned_frd, enu_flu };
std::string_view name_of(Frame frame);  // returns a name such as "NED/FRD"

struct PoseSample {
  enum class Of { vehicle, object };
  Of of = Of::vehicle;
  std::string name;       // name of the vehicle or object; empty = the only one there is
  std::uint64_t seq = 0;  // 0 = the sender does not number its poses
  Stamp stamp;
  Pose pose;                                    // pose of the body (FLU) in the world (ENU)
  std::optional<Vec3d> velocity_mps;            // in body axes, FLU
  std::optional<Vec3d> angular_velocity_radps;  // in body axes, FLU
  std::uint32_t reset_counter = 0;              // after a change, do not interpolate from the previous pose
  bool hidden = false;                          // objects only; true: the object is hidden until the next pose with false
  RollPitchYaw sent_angles = {};                // sent angles in radians, not wrapped; 0 if a quaternion was sent
  Frame sent_in = Frame::enu_flu;               // frame of the message, for the log
  std::string fields;                           // names of the fields of the message, for the log
};

/// The numbers of a message before checked() has validated them. Velocities are in the body axes of `frame`.
struct RawPose {
  std::optional<Frame> frame;
  std::array<double, 3> position_m{};
  std::array<double, 4> orientation_wxyz{};
  std::optional<std::array<double, 3>> velocity_mps;
  std::optional<std::array<double, 3>> angular_velocity_radps;
  RollPitchYaw sent_angles = {};  // as in PoseSample
};
/// Fills pose and velocities of `sample` from `raw`, or returns an error in one sentence: no frame, NaN or infinity, an absurd
/// size, or a quaternion whose norm differs from 1 by more than 1e-3 (smaller errors are corrected).
Result<PoseSample> checked(PoseSample sample, const RawPose& raw);

}  // namespace sonar::control
