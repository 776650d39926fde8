// Random variations between the pings of a data set: named draws that depend only on (seed, ping, attempt, name), so that a
// ping does not depend on other pings (docs/datasets.md).
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/units.hpp"
#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"
#include "core/text/strict_yaml.hpp"
#include "daemon/commands/render/formula.hpp"

namespace sonar::dataset {

struct Variation {
  enum class Kind { uniform, normal, integer, choice, list };
  std::string name;
  Kind kind = Kind::uniform;
  double a = 0, b = 0;             // uniform, integer: from, to; normal: mean, deviation
  std::vector<std::string> words;  // choice, list: as written
};

/// The draws of one ping: words for the file and, if they are numbers, values for formulas.
struct Draws {
  std::map<std::string, std::string> words;
  render::Values numbers;
};

/// Reads `vary:` of a job; finish() of the document returns the errors.
std::vector<Variation> read_variations(const text::Node& node);

/// Returns the draws of a ping. Pings are counted from 1, attempts from 0.
Draws draw(const std::vector<Variation>& variations, Seed seed, std::uint64_t ping, std::uint32_t attempt);
/// Returns a random value in (0, 1) for a named decision; it depends only on the arguments.
double draw_uniform(Seed seed, std::uint64_t ping, std::uint32_t attempt, std::string_view name);

/// Replaces every $name of a draw with the draw's word; formulas handle other references.
std::string put_words(std::string_view text, const std::map<std::string, std::string>& words);

// Conditions for a drawn ping. They use only geometry and trace no rays, so occlusion is visible only in the labels.

struct Constraints {
  // Names or labels of objects; above_bed may also contain "sonar".
  std::vector<std::string> in_view, above_bed, no_overlap;
  std::string bed;  // the object that is the bed for above_bed
  std::uint32_t tries = 100;
};

/// True if `name` is the object's name, the name that instances share, or the label.
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

/// Returns whether the ping meets all constraints. in_view: for each name, the centre of a visible object's box is in the fan.
/// above_bed: the centres of all visible objects with the names, and the sonar if it is named, are above the bed. no_overlap: the
/// boxes of these objects, along the world's axes, do not overlap. Hidden objects satisfy every constraint.
bool meets(const Constraints& constraints, const PingRequest& request, const Scene& scene, Unmet& unmet);

}  // namespace sonar::dataset
