// Messages that viewers understand, as JSON: pictures and poses under the names and fields of Foxglove's schemas, and ground
// truth under ours. Written into MCAP files by mcap_session.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/sonar/ping.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::recording::mcap {

struct JsonSchema {
  const char *name, *text;  // JSON Schema
};
JsonSchema image_schema();  // foxglove.RawImage
JsonSchema pose_schema();   // foxglove.PoseInFrame
JsonSchema truth_schema();  // sonard.PingTruth

/// Samples as sent, a row a range, row 0 the nearest, column 0 the beam most to port: mono8, 16UC1 or (24 and 32 bits) 32FC1.
std::string image_json(Time at, const std::string& frame, const oculus::DecodedPing& ping);
std::string pose_json(Time at, const std::string& frame, const Pose& pose);

/// The same of a ping of any vendor, from the samples that went into its message.
std::string image_json(Time at, const std::string& frame, const Ping& ping);

struct SceneNames {
  std::vector<std::string> objects;  // by BeamTruth::object
  std::vector<std::string> bodies;   // that move, by PingRequest::bodies_in_world
};

/// What a ping should show: where the sonar and everything that moves were when it was fired, and per beam the first thing in its
/// way.
struct PingTruth {
  std::uint32_t ping = 0;
  Time fired_at{};
  Pose sonar_in_world;
  std::span<const BeamTruth> beams = {};       // beam 0 most to port
  std::span<const Pose> bodies_in_world = {};  // named by `names`, as objects are
  const SceneNames* names = nullptr;           // null: nothing is named, and no bodies are told
};
std::string truth_json(const PingTruth& truth);

std::string base64(wire::BytesView bytes);

}  // namespace sonar::recording::mcap
