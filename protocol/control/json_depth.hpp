// Measures how deep JSON text is nested. Parsers are recursive, so the depth is limited before they run.
#pragma once

#include <string_view>

namespace sonar::control {

/// True if brackets outside strings nest deeper than `most`; other syntax is not checked.
inline bool nests_deeper(std::string_view json, int most) {
  int depth = 0;
  bool in_string = false, escaped = false;
  for (const char c : json) {
    if (in_string) {
      if (escaped)
        escaped = false;
      else if (c == '\\')
        escaped = true;
      else if (c == '"')
        in_string = false;
      continue;
    }
    if (c == '"') in_string = true;
    if ((c == '{' || c == '[') && ++depth > most) return true;
    if (c == '}' || c == ']') --depth;
  }
  return false;
}

}  // namespace sonar::control
