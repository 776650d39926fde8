// Finds the valid name (key, choice, material) nearest to a mistyped one, for "did you mean" errors.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace sonar::text {

/// Returns the candidate with the fewest edits to `name`. The limit is a third of the name's length, but at least one edit. A
/// swap of neighbouring letters is one edit; case is ignored, and '-', '_' and ' ' are the same. Empty if no candidate is near.
std::string_view nearest(std::string_view name, std::span<const std::string_view> candidates);
/// Returns `; did you mean "x"?` if a candidate is near, else `; <label>: a, b, c` (at most 20 names); empty without
/// candidates.
std::string suggestion(std::string_view name, std::span<const std::string_view> candidates, std::string_view label);

}  // namespace sonar::text
