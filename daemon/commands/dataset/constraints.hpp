// Conditions for a drawn ping. They use only geometry and trace no rays, so occlusion is visible only in the labels.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar::dataset {

struct Constraints {
  // Names or labels of objects; above_bed also takes "sonar".
  std::vector<std::string> in_view, above_bed, no_overlap;
  std::string bed;  // the bed of above_bed
  std::uint32_t tries = 100;
};

/// Compares the name, the name that instances share, and the label.
bool is_named(const Object& object, const std::string& name);
/// Returns all names that is_named() accepts in a scene.
std::set<std::string> names_of(const Scene& scene);
/// Returns a sentence about a name that the scene does not have; empty if all are known.
std::string why_unknown(const Constraints& constraints, const std::vector<std::string>& targets, const Scene& scene);

/// Counts how often each constraint was not met.
struct Unmet {
  int in_view = 0, above_bed = 0, no_overlap = 0;
  std::string sentence() const;
};

/// in_view: for each name, the box of some visible object has its middle in the fan. above_bed: the middles of all visible
/// objects with the names, and the sonar, are above the bed. no_overlap: the boxes of these objects, along the world's axes, do
/// not overlap. Hidden objects satisfy every constraint.
bool meets(const Constraints& constraints, const PingRequest& request, const Scene& scene, Unmet& unmet);

}  // namespace sonar::dataset
