// Finds the nearest valid name to a mistyped one, for "did you mean" errors. All readers of names (keys, choices, materials)
// use it.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace sonar::text {

/// The nearest candidate, at most a third of the name's length in edits away (at least one edit is allowed; a swap counts as
/// one; case and - _ are ignored); or empty.
std::string_view nearest(std::string_view name, std::span<const std::string_view> candidates);
/// `; did you mean "x"?` if a candidate is near, else `; <label>: a, b, c` (at most twelve names); empty without candidates.
std::string suggestion(std::string_view name, std::span<const std::string_view> candidates, std::string_view label);

}  // namespace sonar::text
