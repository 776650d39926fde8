// Variations of a data set from ping to ping: named draws, each a function of (seed, ping, attempt, name) alone, so that a ping
// is the same whether or not the others were made (docs/datasets.md).
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

/// Draws of one ping: words as they are put into the file, and those that are numbers for formulas.
struct Draws {
  std::map<std::string, std::string> words;
  render::Values numbers;
};

/// Reads `vary:` of a job; the finish() of the document returns its errors.
std::vector<Variation> read_variations(const text::Node& node);

/// Draws for a ping, from 1; attempts count from 0.
Draws draw(const std::vector<Variation>& variations, Seed seed, std::uint64_t ping, std::uint32_t attempt);
/// Returns a value in (0, 1), a function of the same arguments, for decisions with a name.
double draw_uniform(Seed seed, std::uint64_t ping, std::uint32_t attempt, std::string_view name);

/// The text with every $name of a word replaced; other references are left to the formulas.
std::string put_words(std::string_view text, const std::map<std::string, std::string>& words);

}  // namespace sonar::dataset
