// Parses decimal numbers in YAML, on command lines and in grid files. The whole text must be a number.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace sonar::text {

/// Reads [+-] digits [. digits] [e [+-] digits], finite, no leading zeros (012), no hexadecimal.
std::optional<double> parse_decimal(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);
std::optional<std::uint64_t> parse_unsigned(std::string_view text);
/// Reads inf, .inf, Inf or .Inf with an optional sign.
std::optional<double> parse_infinity(std::string_view text);
/// Returns a hint for the correction of a text that parse_decimal() rejects. It begins with "; ". Empty if there is no hint.
std::string_view number_hint(std::string_view text);

}  // namespace sonar::text
