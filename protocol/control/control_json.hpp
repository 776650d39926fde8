// Checks JSON text: its depth, and whether it is the JSON form of a control message. Our own check finds the field and value of
// a mistake: protobuf 3.21 states them only in an English sentence, because its status has one code for all mistakes, and the
// interface that reports them is not installed.
#pragma once

#include <string>
#include <string_view>

namespace google::protobuf {
class Descriptor;
}

namespace sonar::control {

/// Returns the text in quotes, on one line; long texts are cut.
std::string in_quotes(const std::string& name);

/// Returns the first mistake in valid JSON that protobuf has refused for a message of this type, such as "\"mount.xyz_m\":
/// unknown key"; empty if none was found.
std::string mistake_in(std::string_view json, const google::protobuf::Descriptor& type);

// Measures how deep JSON text is nested. Parsers are recursive, so the depth is limited before they run.

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
