// Parses decimal numbers; the whole text must be a number. Used by the strict YAML cursors, command lines and grid files.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace sonar::text {

/// [+-] digits [. digits] [e [+-] digits], finite, no leading zeros (012), no hexadecimal.
std::optional<double> parse_decimal(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);
std::optional<std::uint64_t> parse_unsigned(std::string_view text);
/// inf, .inf and Inf with an optional sign; nothing else.
std::optional<double> parse_infinity(std::string_view text);
/// A hint, beginning with "; ", how to correct a text that parse_decimal() rejects; empty if there is none.
std::string_view number_hint(std::string_view text);

}  // namespace sonar::text
