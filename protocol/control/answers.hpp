// Status, events and answers: the classes that protoc generates from control.proto. The daemon fills them, clients read them.
// They take a second to compile, so headers outside of this folder do not include this one.
#pragma once

#include <string>

#include "control.pb.h"
#include "core/base/geometry.hpp"
#include "protocol/control/operations.hpp"

namespace sonar::control {

v1::Status status_of(StatusCode code, const std::string& text);
v1::Response response_of(std::uint64_t id, StatusCode code, const std::string& text = {});

void fill(v1::Vec3& out, Vec3d v);
void fill(v1::Quat& out, Quatd q);
/// Converts checked numbers to a Pose; a missing orientation is the identity.
Pose pose_from(const v1::Vec3& position, const v1::Quat& orientation);

/// Fills messages that have a position and an orientation in the world, ENU and FLU, metres.
void set_pose(auto& out, const Pose& in_world) {
  fill(*out.mutable_position(), in_world.position_m);
  fill(*out.mutable_orientation(), in_world.orientation);
}
Pose pose_of(const auto& message) { return pose_from(message.position(), message.orientation()); }

}  // namespace sonar::control
