// Reads the coordinate system of a grid from WKT and .prj files: degrees or lengths, their units, and the zone of UTM.

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/regular_file.hpp"
#include "core/scene/files/height_values.hpp"

namespace sonar {

// The systems of the EPSG data set that are UTM, and those that agree with WGS 84. Source: the EPSG Geodetic Parameter Dataset
// 10, in the version of PROJ 9.1: every transverse Mercator projection with UTM's scale on the ellipsoids GRS 80 and WGS 84.

namespace {

constexpr bool north = false, south = true;

struct Zones {
  std::uint16_t first, last;
  int zone;  // UTM zone of `first`
  bool south;
};

constexpr auto utm_codes = std::to_array<Zones>({
    {2037, 2038, 19, north},   {2133, 2135, 58, south},  {2148, 2148, 21, north},   {2149, 2149, 18, north},
    {2150, 2150, 17, north},   {2151, 2151, 13, north},  {2152, 2152, 12, north},   {2153, 2153, 11, north},
    {2156, 2156, 59, south},   {2158, 2158, 29, north},  {2195, 2195, 2, south},    {2955, 2957, 11, north},
    {2958, 2962, 17, north},   {2972, 2972, 22, north},  {2975, 2975, 40, south},   {3006, 3006, 33, north},
    {3038, 3051, 26, north},   {3064, 3065, 32, north},  {3067, 3067, 35, north},   {3097, 3101, 51, north},
    {3154, 3157, 7, north},    {3158, 3160, 14, north},  {3169, 3171, 57, south},   {3178, 3189, 18, north},
    {3296, 3299, 5, south},    {3313, 3313, 21, north},  {3372, 3373, 59, north},   {3449, 3450, 17, north},
    {3706, 3707, 59, north},   {3708, 3726, 1, north},   {3740, 3749, 10, north},   {3750, 3751, 4, north},
    {3761, 3761, 22, north},   {3767, 3768, 33, north},  {3890, 3892, 37, north},   {4082, 4083, 27, north},
    {4467, 4467, 21, north},   {4471, 4471, 38, south},  {4484, 4489, 11, north},   {4559, 4559, 20, north},
    {4647, 4647, 32, north},   {5014, 5015, 25, north},  {5016, 5016, 28, north},   {5048, 5048, 35, north},
    {5361, 5361, 19, south},   {5362, 5362, 18, south},  {5382, 5383, 21, south},   {5396, 5396, 26, south},
    {5490, 5490, 20, north},   {5550, 5552, 54, south},  {5649, 5649, 31, north},   {5650, 5650, 33, north},
    {5651, 5653, 31, north},   {5700, 5700, 1, south},   {6210, 6211, 23, north},   {6328, 6329, 59, north},
    {6330, 6348, 1, north},    {6366, 6371, 11, north},  {6634, 6635, 4, north},    {6636, 6636, 2, south},
    {6688, 6692, 51, north},   {6707, 6709, 32, north},  {6732, 6735, 41, south},   {6736, 6737, 46, south},
    {6738, 6738, 59, south},   {7374, 7376, 39, north},  {7791, 7793, 32, north},   {7799, 7800, 34, north},
    {7803, 7803, 34, north},   {7805, 7805, 36, north},  {9391, 9391, 35, north},   {7846, 7859, 46, south},
    {8682, 8682, 34, north},   {8687, 8687, 33, north},  {8692, 8693, 54, north},   {9295, 9297, 39, north},
    {9356, 9360, 36, north},   {9476, 9482, 46, north},  {9487, 9494, 47, south},   {9709, 9709, 23, north},
    {9712, 9712, 24, north},   {9713, 9713, 24, north},  {9716, 9716, 34, north},   {22207, 22222, 7, north},
    {22307, 22322, 7, north},  {22407, 22422, 7, north}, {22607, 22622, 7, north},  {22707, 22722, 7, north},
    {25828, 25838, 28, north}, {26901, 26923, 1, north}, {28348, 28358, 48, south}, {31965, 31976, 11, north},
    {31977, 31985, 17, south}, {32601, 32660, 1, north}, {32701, 32760, 1, south},
});

struct Codes {
  std::uint16_t first, last;
};

/// Latitudes and longitudes on datums that agree with WGS 84 within 2 m: WGS 84, ITRF, ETRS89, NAD83, GDA94 and GDA2020, JGD,
/// NZGD2000, SIRGAS, and those that countries derive from them.
constexpr auto modern_codes = std::to_array<Codes>(
    {{3888, 3889}, {4040, 4040}, {4080, 4081}, {4126, 4126}, {4140, 4140}, {4152, 4152}, {4163, 4163}, {4167, 4167}, {4170, 4171},
     {4173, 4173}, {4180, 4180}, {4189, 4189}, {4258, 4258}, {4269, 4269}, {4283, 4283}, {4326, 4327}, {4329, 4329}, {4341, 4341},
     {4345, 4345}, {4347, 4347}, {4351, 4351}, {4353, 4353}, {4359, 4359}, {4361, 4361}, {4363, 4363}, {4369, 4369}, {4463, 4463},
     {4466, 4466}, {4469, 4470}, {4482, 4483}, {4557, 4558}, {4612, 4612}, {4617, 4617}, {4619, 4619}, {4624, 4624}, {4627, 4627},
     {4640, 4640}, {4659, 4659}, {4661, 4661}, {4669, 4670}, {4674, 4674}, {4687, 4687}, {4747, 4747}, {4749, 4749}, {4755, 4755},
     {4758, 4759}, {4761, 4761}, {4765, 4765}, {4883, 4883}, {4889, 4889}, {4893, 4893}, {4895, 4895}, {4898, 4898}, {4907, 4907},
     {4909, 4909}, {4935, 4951}, {4955, 4959}, {4963, 4967}, {4970, 4983}, {4988, 4989}, {4999, 4999}, {5012, 5013}, {5323, 5324},
     {5353, 5354}, {5359, 5360}, {5372, 5373}, {5380, 5381}, {5488, 5489}, {5545, 5546}, {6318, 6325}, {6364, 6365}, {6667, 6668},
     {6705, 6706}, {6782, 6783}, {7036, 7042}, {7084, 7084}, {7372, 7373}, {7656, 7665}, {7797, 7798}, {7815, 7816}, {7842, 7844},
     {7900, 7931}, {8085, 8086}, {8231, 8255}, {8399, 8403}, {8426, 8427}, {8542, 8545}, {8684, 8685}, {8817, 8818}, {8988, 9019},
     {9053, 9075}, {9754, 9755}, {9989, 9990}});

struct Meridian {
  std::uint16_t code;
  double degrees;
};

/// Prime meridians, in degrees east of Greenwich.
constexpr auto meridians = std::to_array<Meridian>({
    {8901, 0},                 // Greenwich
    {8902, -9.131906111111},   // Lisbon
    {8903, 2.337229166667},    // Paris
    {8904, -74.080916666667},  // Bogota
    {8905, -3.687375},         // Madrid
    {8906, 12.452333333333},   // Rome
    {8907, 7.439583333333},    // Bern
    {8908, 106.807719444444},  // Jakarta
    {8909, -17.666666666667},  // Ferro
    {8910, 4.367975},          // Brussels
    {8911, 18.058277777778},   // Stockholm
    {8912, 23.7163375},        // Athens
    {8913, 10.722916666667},   // Oslo
    {8914, 2.337208333333},    // Paris, by the Royal Greenwich Observatory
});
struct OfSystem {
  std::uint16_t system, meridian;
};
/// Geographic systems whose longitudes do not begin at Greenwich.
constexpr auto systems_of_meridians =
    std::to_array<OfSystem>({{4801, 8907}, {4802, 8904}, {4803, 8902}, {4804, 8908}, {4805, 8909}, {4806, 8906}, {4807, 8903},
                             {4808, 8908}, {4809, 8910}, {4810, 8903}, {4811, 8903}, {4813, 8908}, {4814, 8911}, {4815, 8912},
                             {4816, 8903}, {4817, 8913}, {4818, 8909}, {4819, 8903}, {4820, 8908}, {4821, 8903}, {4901, 8914},
                             {4902, 8914}, {4903, 8905}, {4904, 8902}, {5229, 8909}, {8042, 8909}, {8043, 8909}});

const auto* row_of(const auto& rows, std::uint32_t code) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& r) { return code >= r.first && code <= r.last; });
  return row == rows.end() ? nullptr : &*row;
}

}  // namespace

std::optional<UtmZone> utm_of_epsg(std::uint32_t code) {
  const Zones* const row = row_of(utm_codes, code);
  return row == nullptr ? std::nullopt : std::optional(UtmZone{row->zone + static_cast<int>(code - row->first), row->south});
}

std::optional<double> degrees_of_prime_meridian(std::uint32_t code) {
  const auto row = std::find_if(meridians.begin(), meridians.end(), [&](const Meridian& m) { return m.code == code; });
  return row == meridians.end() ? std::nullopt : std::optional(row->degrees);
}

double prime_meridian_of_epsg(std::uint32_t code) {
  const auto row =
      std::find_if(systems_of_meridians.begin(), systems_of_meridians.end(), [&](const OfSystem& s) { return s.system == code; });
  return row == systems_of_meridians.end() ? 0 : degrees_of_prime_meridian(row->meridian).value_or(0);
}

bool agrees_with_wgs84(std::uint32_t code) { return row_of(modern_codes, code) != nullptr; }

bool is_modern_ellipsoid(double semi_major_m, double inverse_flattening) {
  return std::abs(semi_major_m - earth_semi_major_m) < 0.01 && std::abs(inverse_flattening - 1 / earth_flattening) < 0.001;
}

std::optional<UtmZone> utm_of_parameters(const TransverseMercator& by) {
  constexpr double easting_m = 500'000, a_million_m = 1e6, northing_of_south_m = 1e7;
  const double zone = std::round((by.central_meridian_deg + 183) / 6);
  const bool south = by.false_northing_m == northing_of_south_m;
  const auto is = [](double a, double b) { return std::abs(a - b) < 1e-7; };
  if (!(zone >= 1 && zone <= 60) || !is(by.central_meridian_deg, 6 * zone - 183) || !is(by.scale, 0.9996) ||
      !is(by.latitude_deg, 0))
    return std::nullopt;
  if ((by.false_northing_m != 0 && !south) ||
      !(is(by.false_easting_m, easting_m) || is(by.false_easting_m, zone * a_million_m + easting_m)))
    return std::nullopt;
  return UtmZone{static_cast<int>(zone), south};
}

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

/// Datums that agree with WGS 84 within 2 m. They are spelt as in names of systems, but without blanks and underscores.
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
