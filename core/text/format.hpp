// Texts with numbers in them, as printf writes them. Used wherever a line is made for people: banner, status, doctor, tables.
#pragma once

#include <string>

namespace sonar::text {

/// As std::printf, of any length.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Three digits that matter: "750 kHz", "2.1 MHz".
std::string frequency_text(double hz);

}  // namespace sonar::text
