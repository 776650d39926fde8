// Converts requests between protoc's classes of control.proto and plain structs. Only files of this folder include it;
// control.cpp and control_json.cpp convert to bytes and text.
#pragma once

#include <google/protobuf/message.h>

#include <optional>
#include <string>

#include "protocol/control/answers.hpp"

namespace sonar::control {

bool parse(google::protobuf::Message& message, BytesView bytes);
Bytes serialized(const google::protobuf::Message& message);
/// Turns off the library's log lines about ill-formed strings, with which untrusted clients could flood the log.
void keep_protobuf_quiet();

/// Returns the path of the first number that is NaN or infinite, such as "sonar.range_m".
std::optional<std::string> first_unreal_number(const google::protobuf::Message& message);
/// Returns the path of the first orientation whose length is not 1.
std::optional<std::string> first_bad_orientation(const google::protobuf::Message& message);
/// Makes all texts valid for protobuf and JSON: replaces bytes that are not UTF-8 with '?'.
void repair_texts(google::protobuf::Message& message);

// ---- poses (pose_messages.cpp)
Result<PoseSample> from(const v1::PoseUpdate& message);
Result<PoseSample> from(const v1::ObjectUpdate& message);
Result<Pose> from(const v1::Placement& message);
Result<MountChange> from(const v1::Mount& message);
void fill(v1::PoseUpdate& out, const PoseSample& sample);
void fill(v1::ObjectUpdate& out, const PoseSample& sample);
void fill(v1::Placement& out, const Pose& in_world);
void fill(v1::Mount& out, const MountChange& change);

// ---- requests (request_messages.cpp)
tl::expected<Request, RefusedRequest> from(const v1::Request& message);
void fill(v1::Request& out, const Request& request);

}  // namespace sonar::control
