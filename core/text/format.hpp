// Texts with numbers, formatted by printf. Used for output to users: banner, status, doctor, tables.
#pragma once

#include <string>

namespace sonar::text {

/// Formats as std::printf does, with any length.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Three significant digits: "750 kHz", "2.1 MHz".
std::string frequency_text(double hz);

}  // namespace sonar::text
