// The coordinate system of a grid by WKT and .prj files: degrees or lengths, and their units.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/regular_file.hpp"
#include "core/scene/files/height_values.hpp"

namespace sonar {
namespace {

constexpr double foot_m = 0.3048;

std::string upper(std::string_view s) {
  std::string out(s);
  for (char& c : out) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return out;
}

template <std::size_t N>
bool is_one_of(std::string_view word, const std::array<std::string_view, N>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}
constexpr std::array<std::string_view, 7> in_lengths{"PROJCS",   "PROJCRS", "PROJECTEDCRS",  "LOCAL_CS",
                                                     "LOCALCRS", "ENGCRS",  "ENGINEERINGCRS"};
constexpr std::array<std::string_view, 6> in_degrees{"GEOGCS", "GEOGCRS", "GEODCRS", "GEOGRAPHICCRS", "GEODETICCRS", "GEODCS"};
constexpr std::array<std::string_view, 4> of_heights{"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"};

bool is_unit(double v) { return v > 1e-4 && v < 1e5; }

/// "Projection UTM", "Units FEET": a word and its value a line.
CoordinateSystem system_of_lines(const std::string& text) {
  CoordinateSystem system;
  const auto unit_of = [](const std::string& value) {
    if (value == "FEET" || value == "FOOT") return foot_m;
    const auto in_a_metre = height_number(value);
    return in_a_metre && is_unit(1 / *in_a_metre) ? 1 / *in_a_metre : 1;
  };
  constexpr const char* blanks = " \t\r";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    at = end + 1;
    const std::size_t word = std::min(line.find_first_not_of(blanks), line.size()),
                      gap = std::min(line.find_first_of(blanks, word), line.size()),
                      from = std::min(line.find_first_not_of(blanks, gap), line.size()),
                      to = std::min(line.find_first_of(blanks, from), line.size());
    const std::string key = line.substr(word, gap - word), value = line.substr(from, to - from);
    if (key == "PROJECTION") system.geographic = value == "GEOGRAPHIC";
    if (key == "UNITS") system.unit_m = unit_of(value);
    if (key == "ZUNITS") system.height_unit_m = unit_of(value);
  }
  return system;
}

}  // namespace

CoordinateSystem system_of_wkt(std::string_view text) {
  CoordinateSystem system;
  struct Open {
    std::string word;
    int commas = 0;
    std::string second;  // its second value
  };
  std::vector<Open> open;
  constexpr std::size_t deepest = 64;
  const auto close = [&] {
    const Open unit = open.back();
    open.pop_back();
    if (unit.word != "UNIT" && unit.word != "LENGTHUNIT") return;
    std::size_t owner = open.size();
    while (owner > 0 && open[owner - 1].word == "AXIS") --owner;
    const auto metres = height_number(unit.second);
    if (owner == 0 || !metres || !is_unit(*metres)) return;
    if (is_one_of(open[owner - 1].word, in_lengths)) system.unit_m = *metres;
    if (is_one_of(open[owner - 1].word, of_heights)) system.height_unit_m = *metres;
  };
  std::string word;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '"') {
      const std::size_t end = std::min(text.find('"', at + 1), text.size());
      const std::string name = upper(text.substr(at + 1, end - at - 1));
      for (const char* mercator : {"PSEUDO-MERCATOR", "PSEUDO_MERCATOR", "MERCATOR_AUXILIARY_SPHERE", "POPULAR VISUALISATION"})
        system.web_mercator = system.web_mercator || name.find(mercator) != name.npos;
      at = end;
    } else if (c == '[' || c == '(') {
      if (open.size() == deepest) return system;
      open.push_back({upper(word), 0, {}});
      word.clear();
      const std::string& kind = open.back().word;  // a projected system contains a geographic one, behind its own name
      if (!system.geographic && is_one_of(kind, in_degrees)) system.geographic = true;
      if (!system.geographic && is_one_of(kind, in_lengths)) system.geographic = false;
    } else if (c == ',' || c == ']' || c == ')') {
      if (open.empty()) return system;
      if (open.back().commas == 1) open.back().second = word;
      ++open.back().commas;
      word.clear();
      if (c != ',') close();
    } else if (c > ' ') {
      word += c;
    }
  }
  return system;
}

CoordinateSystem system_by_prj(const std::filesystem::path& heights) {
  std::filesystem::path prj = heights;
  const auto text = read_regular(prj.replace_extension(".prj"), 65536);
  if (!text) return {};
  return text->find_first_of("[(") == std::string::npos ? system_of_lines(upper(*text)) : system_of_wkt(*text);
}

}  // namespace sonar
