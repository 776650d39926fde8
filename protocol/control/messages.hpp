// Converts between protoc's classes of control.proto and plain structs. Included by files of this folder only; control.cpp and
// control_json.cpp add bytes and text.
#pragma once

#include <google/protobuf/message.h>

#include <optional>
#include <string>

#include "control.pb.h"
#include "protocol/control/control.hpp"

namespace sonar::control {

bool parse(google::protobuf::Message& message, BytesView bytes);
Bytes serialized(const google::protobuf::Message& message);
/// Turns off the library's own log lines about ill-formed strings, which untrusted clients could flood.
void keep_protobuf_quiet();

/// Path of the first number that is NaN or infinite: "sonar.range_m".
std::optional<std::string> first_unreal_number(const google::protobuf::Message& message);
/// Path of the first orientation that is given and has another length than 1.
std::optional<std::string> first_bad_orientation(const google::protobuf::Message& message);
/// Texts become what protobuf and JSON allow: bytes that are no UTF-8 turn into '?'.
void repair_texts(google::protobuf::Message& message);

// ---- poses (pose_messages.cpp)
Result<PoseSample> from(const v1::PoseUpdate& message);
Result<PoseSample> from(const v1::ObjectUpdate& message);
Result<Pose> from(const v1::Placement& message);
Result<Pose> from(const v1::Mount& message);
void fill(v1::PoseUpdate& out, const PoseSample& sample);
void fill(v1::ObjectUpdate& out, const PoseSample& sample);
void fill(v1::Placement& out, const Pose& in_world);
void fill(v1::Mount& out, const Pose& in_vehicle);
void fill(v1::Vec3& out, Vec3d v);
void fill(v1::Quat& out, Quatd q);
/// Numbers that have been checked; an orientation that is not given is level.
Pose pose_from(const v1::Vec3& position, const v1::Quat& orientation);

// ---- requests (request_messages.cpp)
tl::expected<Request, RefusedRequest> from(const v1::Request& message);
void fill(v1::Request& out, const Request& request);

// ---- answers and events (status_messages.cpp, event_messages.cpp)
void fill(v1::Environment& out, const SetEnvironment& environment);
SetEnvironment from(const v1::Environment& message);
void fill(v1::DaemonStatus& out, const DaemonStatus& status);
DaemonStatus from(const v1::DaemonStatus& message);
void fill(v1::Stepped& out, const Stepped& stepped);
void fill(v1::Event& out, const Event& event);
Result<Event> from(const v1::Event& message);
void fill(v1::Status& out, StatusCode code, const std::string& text);
void fill(v1::Response& out, const Response& response);
Result<Response> from(const v1::Response& message);

}  // namespace sonar::control
