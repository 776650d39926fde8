// JSON messages in schemas of sonard's own: ground truth, faults. Written into MCAP files by mcap_session.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/sonar/ping.hpp"
#include "core/sonar/ping_labels.hpp"

namespace sonar::recording::mcap {

struct JsonSchema {
  std::string name, text;
};
JsonSchema truth_schema();  // sonard.PingTruth
JsonSchema fault_schema();  // sonard.FaultEntry
JsonSchema label_schema();  // sonard.PingInstances

struct SceneNames {
  std::vector<std::string> objects;  // by BeamTruth::object
  std::vector<std::string> bodies;   // moving bodies, by PingRequest::bodies_in_world
  struct Instance {
    std::string name, of_class;
  };
  std::vector<Instance> instances = {};  // [instance - 1] of PingLabels
};

/// Ground truth of a ping: the poses of the sonar and of the moving bodies at transmission, and per beam the first object hit.
struct PingTruth {
  std::uint32_t ping = 0;
  Time fired_at{};
  Pose sonar_in_world;
  std::span<const BeamTruth> beams = {};       // beam 0 most to port
  std::span<const Pose> bodies_in_world = {};  // named by `names`, as objects are
  const SceneNames* names = nullptr;           // null: neither object names nor bodies are written
};
std::string truth_json(const PingTruth& truth);
/// The instances that the labels of a ping name.
std::string instances_json(const PingTruth& truth, const PingLabels& labels);

}  // namespace sonar::recording::mcap
