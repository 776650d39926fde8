// The coordinate system of a grid by WKT and .prj files: degrees or lengths, their units, and the zone of UTM.
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

std::string without_blanks(std::string name) {
  std::erase_if(name, [](char c) { return c == ' ' || c == '_'; });
  return name;
}

/// Datums that agree with WGS 84 within 2 m. The names are those in names of systems, without blanks and underscores.
constexpr std::array<std::string_view, 16> modern_datums{"WGS84",    "WGS1984", "ETRS89",  "ETRS1989",   "NAD83",  "NAD1983",
                                                         "GDA94",    "GDA1994", "GDA2020", "SIRGAS2000", "SIRGAS", "RGF93",
                                                         "NZGD2000", "JGD2000", "JGD2011", "SWEREF99"};

/// Reads names like "WGS 84 / UTM zone 33N", "NAD_1983_UTM_Zone_10N" and "GDA94 / MGA zone 55", converted to capitals.
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

/// Parses lines with a word and its value, such as "Projection UTM" and "Units FEET".
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
    if (key == "UNITS" && (value == "DS" || value == "DM")) system.unit_deg = value == "DS" ? 1.0 / 3600 : 1.0 / 60;
    if (key == "ZUNITS") system.height_unit_m = unit_of(value);
  }
  if (is_utm)  // southern zones have negative numbers
    system.utm = utm_of_name(datum + " UTM ZONE " + (zone.starts_with('-') ? zone.substr(1) + "S" : zone + "N"));
  return system;
}

/// Reads WKT of versions 1 and 2: words with values and further words in brackets.
class WktReader {
 public:
  CoordinateSystem read(std::string_view text) {
    std::string word;
    for (std::size_t at = 0; at < text.size(); ++at) {
      const char c = text[at];
      if (c == '"') {
        const std::size_t end = std::min(text.find('"', at + 1), text.size());
        take_name(text.substr(at + 1, end - at - 1));
        at = end;
      } else if (c == '[' || c == '(') {
        if (open_.size() == deepest) break;
        begin(upper(word));
        word.clear();
      } else if (c == ',' || c == ']' || c == ')') {
        if (open_.empty() && c != ',') break;
        if (open_.empty()) {  // ESRI appends the vertical system after the horizontal one
          word.clear();
          continue;
        }
        Open& last = open_.back();
        if (last.commas == 1 || last.commas == 2) last.values[last.commas - 1u] = word;
        ++last.commas;
        word.clear();
        if (c != ',') close();
      } else if (c > ' ') {
        word += c;
      }
    }
    return finished();
  }

 private:
  struct Open {
    std::string word, name;
    unsigned commas = 0;
    std::array<std::string, 2> values;  // second and third value of a keyword
  };
  static constexpr std::size_t deepest = 64;

  void begin(std::string word) {
    const bool degrees = is_one_of(word, in_degrees), lengths = is_one_of(word, in_lengths);
    // A projected system contains a geographic one after its own name.
    if (!system_.geographic && (degrees || lengths)) {
      system_.geographic = degrees;
      is_projected_ = word.starts_with("PROJ");
      system_at_ = open_.size();
    }
    open_.push_back({std::move(word), {}, 0, {}});
  }

  void take_name(std::string_view given) {
    const std::string name = upper(given);
    for (const char* mercator : {"PSEUDO-MERCATOR", "PSEUDO_MERCATOR", "MERCATOR_AUXILIARY_SPHERE", "POPULAR VISUALISATION"})
      system_.web_mercator = system_.web_mercator || name.find(mercator) != name.npos;
    if (open_.empty() || open_.back().commas > 0) return;
    Open& last = open_.back();
    last.name = name;
    const bool is_system = is_one_of(last.word, in_lengths) || is_one_of(last.word, in_degrees);
    if (is_system && system_.geographic && open_.size() == system_at_ + 1) name_ = given.substr(0, longest_name);
    if (!system_.utm && (open_.size() == 1 || is_one_of(last.word, in_lengths))) system_.utm = utm_of_name(name);
    if (last.word == "PROJECTION" || last.word == "METHOD") {
      last.name = without_blanks(last.name);
      transverse_ = last.name == "TRANSVERSEMERCATOR" || last.name == "GAUSSKRUGER";
    }
  }

  void close() {
    const Open unit = open_.back();
    open_.pop_back();
    const auto first = height_number(unit.values[0]), second = height_number(unit.values[1]);
    const bool of_vertical = !open_.empty() && is_one_of(open_.back().word, of_heights);
    const bool downwards = unit.word == "AXIS" ? upper(unit.values[0]) == "DOWN"
                                               : unit.word == "PARAMETER" && unit.name == "DIRECTION" && first.value_or(1) < 0;
    if (of_vertical && downwards) system_.depths = open_.back().name;
    if (unit.word == "PARAMETER" && first) take_parameter(unit.name, *first);
    if ((unit.word == "SPHEROID" || unit.word == "ELLIPSOID") && first && second) modern_ = is_modern_ellipsoid(*first, *second);
    if (unit.word == "PRIMEM" && first && std::abs(*first) <= 400) meridian_deg_ = *first * meridian_unit_deg_;
    if (unit.word != "UNIT" && unit.word != "LENGTHUNIT" && unit.word != "ANGLEUNIT") return;
    std::size_t owner = open_.size();
    bool of_height = false;
    for (; owner > 0 && open_[owner - 1].word == "AXIS"; --owner) {
      const std::string direction = upper(open_[owner - 1].values[0]);
      of_height = direction == "UP" || direction == "DOWN";
    }
    if (owner == 0 || !first || !is_unit(*first)) return;
    const double deg = deg_from_rad(*first), unit_deg = std::abs(deg - 1) < 1e-6 || unit.name == "DEGREE" ? 1 : deg;
    const std::string& word = open_[owner - 1].word;
    const bool degrees = is_one_of(word, in_degrees), lengths = is_one_of(word, in_lengths);
    if (word == "PRIMEM") meridian_unit_deg_ = unit_deg;
    // A system with three axes has a unit of heights in addition to that of its coordinates.
    if (is_one_of(word, of_heights) || (of_height && (degrees || lengths)))
      system_.height_unit_m = *first;
    else if (degrees && unit.word != "LENGTHUNIT")
      system_.unit_deg = unit_deg;
    else if (lengths && unit.word != "ANGLEUNIT")
      system_.unit_m = *first;
  }

  void take_parameter(const std::string& given, double value) {
    const std::string name = without_blanks(given);
    if (name.starts_with("LATITUDEOF")) by_.latitude_deg = value;
    if (name == "CENTRALMERIDIAN" || name.starts_with("LONGITUDEOF")) by_.central_meridian_deg = value;
    if (name.starts_with("SCALEFACTOR")) by_.scale = value;
    if (name == "FALSEEASTING") by_.false_easting_m = value;
    if (name == "FALSENORTHING") by_.false_northing_m = value;
  }

  CoordinateSystem finished() {
    if (system_.geographic.value_or(false))
      system_.prime_meridian_deg = meridian_deg_;
    else if (meridian_deg_ != 0)
      system_.utm.reset();
    if (!system_.utm && is_projected_ && transverse_ && meridian_deg_ == 0 && modern_.value_or(false) && system_.unit_m == 1)
      system_.utm = utm_of_parameters(by_);
    if (is_projected_ && !system_.utm && !system_.web_mercator) system_.name = name_;
    system_.other_datum = system_.geographic.value_or(false) && !modern_.value_or(true);
    if (system_.other_datum) system_.name = name_;
    return system_;
  }

  static constexpr std::size_t longest_name = 80;
  CoordinateSystem system_;
  std::vector<Open> open_;
  std::size_t system_at_ = 0;
  std::string name_;
  bool is_projected_ = false, transverse_ = false;
  std::optional<bool> modern_;
  double meridian_deg_ = 0, meridian_unit_deg_ = 1;
  TransverseMercator by_;
};

}  // namespace

CoordinateSystem system_of_wkt(std::string_view text) { return WktReader().read(text); }

CoordinateSystem system_by_prj(const std::filesystem::path& heights) {
  std::filesystem::path prj = heights;
  const auto text = read_regular(prj.replace_extension(".prj"), 65536);
  if (!text) return {};
  return text->find_first_of("[(") == std::string::npos ? system_of_lines(upper(*text)) : system_of_wkt(*text);
}

}  // namespace sonar
