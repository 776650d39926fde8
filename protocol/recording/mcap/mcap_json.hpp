// Makes sonard's own JSON schemas (ground truth, faults, labels), and the messages of truth and labels. mcap_session writes them
// into MCAP files.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/sonar/ping.hpp"

namespace sonar::recording::mcap {

struct JsonSchema {
  std::string name, text;
};
JsonSchema truth_schema();  // schema of sonard.PingTruth
JsonSchema fault_schema();  // schema of sonard.FaultEntry
JsonSchema label_schema();  // schema of sonard.PingInstances

struct SceneNames {
  std::vector<std::string> objects;  // names of the objects; BeamTruth::object is an index into them
  std::vector<std::string> bodies;   // names of the moving bodies, in the order of PingRequest::bodies_in_world
  struct Instance {
    std::string name, of_class;
  };
  std::vector<Instance> instances = {};  // instance n of PingLabels is the element n - 1
};

/// Ground truth of a ping: the poses of the sonar and of the moving bodies at transmission, and per beam the first object hit.
struct PingTruth {
  std::uint32_t ping = 0;
  Time fired_at{};
  Pose sonar_in_world;
  std::span<const BeamTruth> beams = {};       // beam 0 farthest to port
  std::span<const Pose> bodies_in_world = {};  // `names` has their names
  const SceneNames* names = nullptr;           // null: no names and no bodies are written
};
std::string truth_json(const PingTruth& truth);
/// Returns the JSON of the instances that occur in the labels of a ping.
std::string instances_json(const PingTruth& truth, const PingLabels& labels);

}  // namespace sonar::recording::mcap
