// Converts ASCII capitals to small letters; the locale has no effect.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace sonar {

constexpr char small_letter(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

inline std::string small_letters(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(), small_letter);
  return small;
}

/// True if both texts are equal when the case of ASCII letters is ignored.
inline bool same_letters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return small_letter(x) == small_letter(y); });
}

}  // namespace sonar
