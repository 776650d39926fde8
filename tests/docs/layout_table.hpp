// A layout as a Markdown table: offset, type and name of each field from fields(), and in words its meaning.
#pragma once

#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

#include "protocol/wire/wire.hpp"

namespace sonar::docs {

/// The meaning of fields by name. A name without dots stands for the field at the end of every path.
using Meanings = std::map<std::string, std::string, std::less<>>;

/// The rows of `M` whose names do not begin with a prefix of `left_out`. Throws if no field has the name of a meaning, so that a
/// renamed field does not lose its meaning.
template <class M>
std::string layout_table(const Meanings& meanings, std::initializer_list<std::string_view> left_out = {}) {
  wire::Namer namer;
  const M message{};
  fields(namer, message);
  std::string text = "| offset | type | field | meaning |\n|---|---|---|---|\n";
  std::size_t used = 0;
  for (const wire::Namer::Row& row : namer.rows) {
    bool wanted = true;
    for (const std::string_view prefix : left_out) wanted = wanted && !row.name.starts_with(prefix);
    if (!wanted) continue;
    auto meaning = meanings.find(row.name);
    if (meaning == meanings.end()) meaning = meanings.find(row.name.substr(row.name.rfind('.') + 1));
    if (meaning != meanings.end()) ++used;
    text += "| " + std::to_string(row.offset) + " | " + row.type + " | " + row.name + " | " +
            (meaning == meanings.end() ? "" : meaning->second) + " |\n";
  }
  if (used < meanings.size()) throw std::logic_error("no field has the name of one of the meanings\n" + text);
  return text + "\n";
}

}  // namespace sonar::docs
