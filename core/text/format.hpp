// Formats numbers for output to users: banner, status, doctor, tables.
#pragma once

#include <string>

namespace sonar::text {

/// Formats like std::printf; the text may have any length.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Formats three significant digits: "750 kHz", "2.1 MHz".
std::string frequency_text(double hz);

}  // namespace sonar::text
