// Formats numbers and lists for output to users: banner, status, doctor, tables.
#pragma once

#include <concepts>
#include <functional>
#include <string>
#include <string_view>

namespace sonar::text {

/// Formats like std::printf; the text may have any length.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Formats three significant digits: "750 kHz", "2.1 MHz".
std::string frequency_text(double hz);

// Formats a number with its noun.

/// Returns "1 beam" or "2 beams".
template <std::integral N>
std::string counted(N count, std::string_view what) {
  return std::to_string(count).append(" ").append(what).append(count == 1 ? "" : "s");
}

// Formats lists.

/// Returns "a, b, c". `text_of` returns the text of an element.
template <class TextOf = std::identity>
std::string joined(const auto& elements, std::string_view between = ", ", TextOf text_of = {}) {
  std::string all;
  for (const auto& element : elements) all.append(all.empty() ? "" : between).append(std::invoke(text_of, element));
  return all;
}

// Makes text from outside printable on a terminal. Bytes that are not UTF-8, move the cursor or change the terminal's state
// become \xNN.

std::string printable(std::string_view text);

}  // namespace sonar::text
