// Random variations between the pings of a data set: named draws that depend only on (seed, ping, attempt, name), so that a
// ping does not depend on other pings (docs/datasets.md).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/units.hpp"
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

/// The draws of one ping: as words for the file and, if they are numbers, as values for formulas.
struct Draws {
  std::map<std::string, std::string> words;
  render::Values numbers;
};

/// Reads `vary:` of a job; the finish() of the document returns its errors.
std::vector<Variation> read_variations(const text::Node& node);

/// The draws of a ping, counted from 1; attempts count from 0.
Draws draw(const std::vector<Variation>& variations, Seed seed, std::uint64_t ping, std::uint32_t attempt);
/// A value in (0, 1) for a named decision, a function of the same arguments.
double draw_uniform(Seed seed, std::uint64_t ping, std::uint32_t attempt, std::string_view name);

/// Replaces every $name of a draw by its word; formulas handle other references.
std::string put_words(std::string_view text, const std::map<std::string, std::string>& words);

}  // namespace sonar::dataset
