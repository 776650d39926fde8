// The coordinate system of a grid by WKT, .prj files and EPSG codes: degrees or lengths, their units, and the zone of UTM.
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

/// Datums that agree with WGS 84 within 2 m, as names of systems have them, without blanks and underscores.
constexpr std::array<std::string_view, 13> modern_datums{"WGS84",   "WGS1984", "ETRS89",  "ETRS1989", "NAD83",
                                                         "NAD1983", "GDA94",   "GDA1994", "GDA2020",  "SIRGAS2000",
                                                         "SIRGAS",  "RGF93",   "NZGD2000"};

/// From names like "WGS 84 / UTM zone 33N", "NAD_1983_UTM_Zone_10N" and "GDA94 / MGA zone 55" in capitals.
std::optional<UtmZone> utm_of_name(std::string name) {
  std::erase_if(name, [](char c) { return c == ' ' || c == '_' || c == '/'; });
  const bool modern = std::any_of(modern_datums.begin(), modern_datums.end(),
                                  [&](std::string_view datum) { return name.find(datum) != name.npos; });
  for (const std::string_view kind : {"UTMZONE", "MGAZONE"}) {
    const std::size_t at = name.find(kind);
    if (!modern || at == name.npos) continue;
    const std::size_t from = at + kind.size(), letter = std::min(name.find_first_not_of("0123456789", from), name.size());
    return utm_zone_from(name.substr(from, letter - from) + (kind == "MGAZONE" ? "S" : name.substr(letter, 1)));
  }
  return std::nullopt;
}

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
  std::string datum, zone;
  bool is_utm = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    at = end + 1;
    const std::size_t word = std::min(line.find_first_not_of(blanks), line.size()),
                      gap = std::min(line.find_first_of(blanks, word), line.size()),
                      from = std::min(line.find_first_not_of(blanks, gap), line.size()),
                      to = std::min(line.find_first_of(blanks, from), line.size());
    const std::string key = line.substr(word, gap - word), value = line.substr(from, to - from);
    if (key == "PROJECTION") system.geographic = value == "GEOGRAPHIC", is_utm = value == "UTM";
    if (key == "DATUM") datum = value;
    if (key == "ZONE") zone = value;
    if (key == "UNITS") system.unit_m = unit_of(value);
    if (key == "ZUNITS") system.height_unit_m = unit_of(value);
  }
  if (is_utm)  // zones of the south have a sign
    system.utm = utm_of_name(datum + " UTM ZONE " + (zone.starts_with('-') ? zone.substr(1) + "S" : zone + "N"));
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
      if (!system.utm && !open.empty() && open.back().commas == 0 &&
          (open.size() == 1 || is_one_of(open.back().word, in_lengths)))
        system.utm = utm_of_name(name);
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

std::optional<UtmZone> utm_of_epsg(std::uint32_t code) {
  struct Row {
    std::uint32_t first, last;
    UtmZone zone;  // of the first
  };
  static constexpr std::array<Row, 9> rows{{{32601, 32660, {1, false}},   // WGS 84
                                            {32701, 32760, {1, true}},    //
                                            {25828, 25838, {28, false}},  // ETRS89
                                            {26901, 26923, {1, false}},   // NAD83
                                            {6330, 6348, {1, false}},     // NAD83(2011)
                                            {31965, 31976, {11, false}},  // SIRGAS 2000
                                            {31977, 31985, {17, true}},   //
                                            {28348, 28358, {48, true}},   // GDA94
                                            {7846, 7859, {46, true}}}};   // GDA2020
  for (const Row& row : rows)
    if (code >= row.first && code <= row.last)
      return UtmZone{row.zone.number + static_cast<int>(code - row.first), row.zone.south};
  return std::nullopt;
}

CoordinateSystem system_by_prj(const std::filesystem::path& heights) {
  std::filesystem::path prj = heights;
  const auto text = read_regular(prj.replace_extension(".prj"), 65536);
  if (!text) return {};
  return text->find_first_of("[(") == std::string::npos ? system_of_lines(upper(*text)) : system_of_wkt(*text);
}

}  // namespace sonar
