// Formulas in render files: scene values that depend on a swept value.
// A formula has + - * / ^, parentheses, pi, named values, and log10 ln exp sqrt abs sin cos tan asin acos atan deg rad.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace sonar::render {

using Values = std::map<std::string, double, std::less<>>;

/// Evaluates a formula; angles are in radians, deg() and rad() convert. Errors: the formula cannot be parsed, or its value is not
/// finite.
Result<double> evaluate(std::string_view formula, const Values& values);

/// Returns the text with every $name and $(formula) replaced by its number. Errors start with `name`:line; the text begins at
/// first_line.
Result<std::string> substitute(std::string_view text, const Values& values, const std::string& name, int first_line = 1);

}  // namespace sonar::render
