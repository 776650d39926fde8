#include "core/scene/files/geo_keys.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/letters.hpp"

namespace sonar {
namespace {

enum Key : std::uint16_t {
  model_type = 1024,
  citation = 1026,
  geographic_system = 2048,
  geographic_citation = 2049,
  prime_meridian = 2051,
  angular_units = 2054,
  angular_unit_size = 2055,
  ellipsoid = 2056,
  semi_major_axis = 2057,
  inverse_flattening = 2059,
  prime_meridian_longitude = 2061,
  projected_system = 3072,
  projected_citation = 3073,
  projection = 3074,
  method = 3075,
  linear_units = 3076,
  natural_origin_longitude = 3080,
  natural_origin_latitude = 3081,
  false_easting = 3082,
  false_northing = 3083,
  natural_origin_scale = 3092,
  vertical_system = 4096,
  vertical_citation = 4097,
  vertical_units = 4099,
};
constexpr std::uint16_t projected = 1, geographic = 2, geocentric = 3, user_defined = 32767;
constexpr std::uint16_t web_mercator = 3857, old_web_mercator = 3785, transverse_mercator = 1;
constexpr std::uint16_t numbers_tag = 34736, texts_tag = 34737;

/// Metres per unit of this code; 1 without a code.
Result<double> length_unit(std::optional<std::uint16_t> key) {
  switch (key.value_or(unit_metre)) {
    case unit_metre:
    case 0:
      return 1;
    case unit_foot:
      return 0.3048;
    case unit_us_survey_foot:
      return 1200.0 / 3937;
    case unit_kilometre:
      return 1000;
    case unit_centimetre:
      return 0.01;
    case unit_millimetre:
      return 0.001;
    case unit_fathom:
      return 1.8288;
    default:
      return failure(ErrorKind::bad_data,
                     "is in units of length of code " + std::to_string(*key) + "; convert it to metres: gdalwarp -t_srs");
  }
}

std::optional<std::uint16_t> code_of(const GeoKeys& keys, std::uint16_t key) {
  const auto code = keys.value_of(key);
  return code == user_defined || code == 0 ? std::nullopt : code;
}

/// Degrees per unit of angle. nullopt for units such as packed degrees, minutes and seconds, which are not decimal.
std::optional<double> degrees_per_unit(const GeoKeys& keys) {
  constexpr std::uint16_t radian = 9101, degree = 9102, grad = 9105, gon = 9106, other_degree = 9122;
  const std::uint16_t unit = keys.value_of(angular_units).value_or(degree);
  if (unit == degree || unit == other_degree) return 1;
  if (unit == grad || unit == gon) return 0.9;
  if (unit == radian) return deg_from_rad(1);
  const auto size_rad = unit == user_defined ? keys.number_of(angular_unit_size) : std::nullopt;
  return size_rad && *size_rad > 1e-6 && *size_rad < 10 ? std::optional(deg_from_rad(*size_rad)) : std::nullopt;
}

/// The prime meridian, in degrees east of Greenwich. nullopt if the file names an unknown meridian.
std::optional<double> prime_meridian_of_keys(const GeoKeys& keys, double unit_deg) {
  if (const auto longitude = keys.number_of(prime_meridian_longitude); longitude && std::abs(*longitude * unit_deg) <= 360)
    return *longitude * unit_deg;
  if (const auto code = code_of(keys, prime_meridian)) return degrees_of_prime_meridian(*code);
  return prime_meridian_of_epsg(code_of(keys, geographic_system).value_or(0));
}

/// The code of the unit of a height system that is not in metres; nullopt for others. From the EPSG data set 10.0.
std::optional<std::uint16_t> unit_of_height_system(std::uint16_t system) {
  static const std::set<std::uint16_t> in_feet{5614, 6130, 6131, 6132, 8050, 8051, 8228},
      in_us_survey_feet{5702, 6358, 6359, 6360, 8052, 8053};
  if (in_feet.contains(system)) return unit_foot;
  if (in_us_survey_feet.contains(system)) return unit_us_survey_foot;
  return std::nullopt;
}

/// True if a height system counts downwards; from the EPSG data set 10.0.
bool counts_downwards(std::uint16_t system) {
  static const std::set<std::uint16_t> depths{5336, 5612, 5614, 5706, 5715, 5734, 5739, 5789, 5831, 5861, 5862, 5863, 5864, 5865,
                                              5866, 5867, 5873, 6357, 6358, 6359, 7976, 8051, 8053, 8358, 9287, 9288, 9672};
  return depths.contains(system);
}

/// The name of the system: "EPSG:27700", or the name in the file.
std::string name_by(std::optional<std::uint16_t> code, const GeoKeys& keys, std::uint16_t own_citation) {
  if (code) return "EPSG:" + std::to_string(*code);
  const std::string own = keys.text_of(own_citation), of_all = keys.text_of(citation);
  return !own.empty() ? own : !of_all.empty() ? of_all : "a system of its own";
}

/// True if the datum is like WGS 84; nullopt if the keys state neither the datum nor the ellipsoid.
std::optional<bool> has_modern_datum(const GeoKeys& keys) {
  if (const auto code = code_of(keys, geographic_system)) return agrees_with_wgs84(*code);
  if (const auto code = code_of(keys, ellipsoid)) return *code == 7019 || *code == 7030;
  const auto axis = keys.number_of(semi_major_axis), flattening = keys.number_of(inverse_flattening);
  return axis && flattening ? std::optional(is_modern_ellipsoid(*axis, *flattening)) : std::nullopt;
}

/// The zone from the code of the system, else from the code of its projection, else from the parameters of the projection.
std::optional<UtmZone> utm_of_keys(const GeoKeys& keys) {
  if (const auto code = code_of(keys, projected_system)) return utm_of_epsg(*code);
  if (!has_modern_datum(keys).value_or(false)) return std::nullopt;
  if (const auto code = code_of(keys, projection); code && *code >= 16001 && *code <= 16160)
    return utm_of_epsg(*code + (32601 - 16001u));
  if (keys.value_of(method) != transverse_mercator) return std::nullopt;
  const auto number = [&](std::uint16_t key) { return keys.number_of(key).value_or(0); };
  return utm_of_parameters({number(natural_origin_latitude), number(natural_origin_longitude), number(natural_origin_scale),
                            number(false_easting), number(false_northing)});
}

/// The system in the citation. ArcGIS (and GDAL for ESRI's codes) writes WKT there if no code exists.
std::optional<CoordinateSystem> system_of_citation(const GeoKeys& keys) {
  constexpr std::string_view before_wkt = "ESRI PE String = ";
  constexpr std::size_t longest_wkt = 8192;
  for (const std::uint16_t key : {projected_citation, geographic_citation, citation})
    if (const std::string text = keys.text_of(key, longest_wkt); text.starts_with(before_wkt))
      if (const CoordinateSystem system = system_of_wkt(std::string_view(text).substr(before_wkt.size())); system.geographic)
        return system;
  return std::nullopt;
}

}  // namespace

std::optional<GeoKeys::Place> GeoKeys::place_of(std::uint16_t key) const {
  for (std::size_t at = 4; at + 4 <= words_.size(); at += 4)
    if (words_[at] == key) return Place{words_[at + 1], words_[at + 2], words_[at + 3]};
  return std::nullopt;
}

std::optional<std::uint16_t> GeoKeys::value_of(std::uint16_t key) const {
  const auto place = place_of(key);
  return place && place->tag == 0 ? std::optional(place->at) : std::nullopt;
}

std::optional<double> GeoKeys::number_of(std::uint16_t key) const {
  const auto place = place_of(key);
  return place && place->tag == numbers_tag && place->at < numbers_.size() ? std::optional(numbers_[place->at]) : std::nullopt;
}

std::string GeoKeys::text_of(std::uint16_t key, std::size_t longest) const {
  const auto place = place_of(key);
  if (!place || place->tag != texts_tag || place->at >= texts_.size()) return {};
  const std::string text = texts_.substr(place->at, std::min<std::size_t>(place->count, longest));
  return text.substr(0, text.find_first_of(std::string("|\0", 2)));
}

Result<CoordinateSystem> system_of_keys(const GeoKeys& keys, std::optional<std::uint16_t> height_unit) {
  CoordinateSystem system;
  auto model = code_of(keys, model_type);
  if (!model && code_of(keys, projected_system)) model = projected;  // some programs state only the system itself
  const auto cited = model == geographic || code_of(keys, projected_system) ? std::nullopt : system_of_citation(keys);
  if (!model && !cited && code_of(keys, geographic_system)) model = geographic;
  if (model == geocentric)
    return failure(ErrorKind::bad_data, "has geocentric coordinates; convert them to degrees: gdalwarp -t_srs EPSG:4326");
  if (cited) {
    system = *cited;
  } else if (model == geographic) {
    system.geographic = true;
    const auto unit_deg = degrees_per_unit(keys);
    const auto meridian_deg = prime_meridian_of_keys(keys, unit_deg.value_or(1));
    if (!unit_deg || !meridian_deg)
      return failure(ErrorKind::bad_data,
                     std::string(unit_deg ? "has longitudes from an unknown meridian" : "has angles in an unknown unit") +
                         "; convert it: gdalwarp -t_srs EPSG:4326 IN OUT.tif");
    system.unit_deg = *unit_deg, system.prime_meridian_deg = *meridian_deg;
    system.other_datum = !has_modern_datum(keys).value_or(true);
    if (system.other_datum) system.name = name_by(code_of(keys, geographic_system), keys, geographic_citation);
  } else if (model == projected) {
    system.geographic = false;
    const auto code = code_of(keys, projected_system);
    system.web_mercator = code == web_mercator || code == old_web_mercator;
    system.utm = utm_of_keys(keys);
    const bool is_named = code || keys.value_of(method) || !keys.text_of(projected_citation).empty();
    if (is_named && !system.utm && !system.web_mercator) system.name = name_by(code, keys, projected_citation);
  }
  const auto vertical = code_of(keys, vertical_system);
  const std::string vertical_name = keys.text_of(vertical_citation);
  if (vertical ? counts_downwards(*vertical) : small_letters(vertical_name).find("depth") != vertical_name.npos)
    system.depths = name_by(vertical, keys, vertical_citation);
  if (!height_unit) height_unit = keys.value_of(vertical_units);
  if (!height_unit) height_unit = unit_of_height_system(keys.value_of(vertical_system).value_or(0));
  const auto of_heights = length_unit(height_unit);
  if (!of_heights) return tl::make_unexpected(of_heights.error());
  if (height_unit) system.height_unit_m = *of_heights;
  if (cited) return system;
  const auto of_lengths = length_unit(model == projected ? keys.value_of(linear_units) : std::nullopt);
  if (!of_lengths) return tl::make_unexpected(of_lengths.error());
  if (*of_lengths != 1) system.utm.reset();  // the parameters of the projection have that unit, too
  system.unit_m = *of_lengths;
  return system;
}

namespace {

constexpr auto npos = std::string_view::npos;

/// The value of an attribute in the text between "<Item" and ">".
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (std::size_t at = tag.find(name); at != npos; at = tag.find(name, at + 1)) {
    const std::size_t equals = at + name.size();
    if (at == 0 || tag[at - 1] != ' ' || equals + 1 >= tag.size() || tag[equals] != '=') continue;
    const char quote = tag[equals + 1];
    const std::size_t end = tag.find(quote, equals + 2);
    if ((quote == '"' || quote == '\'') && end != npos) return tag.substr(equals + 2, end - equals - 2);
  }
  return {};
}

std::optional<std::uint16_t> unit_called(std::string_view name) {
  const std::string word = small_letters(name);
  const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), word) != names.end();
  };
  if (is_one_of({"ft", "foot", "feet", "international foot"})) return unit_foot;
  if (is_one_of({"us survey foot", "ftus", "us-ft"})) return unit_us_survey_foot;
  if (is_one_of({"km", "kilometre", "kilometer"})) return unit_kilometre;
  if (is_one_of({"cm", "centimetre", "centimeter"})) return unit_centimetre;
  if (is_one_of({"mm", "millimetre", "millimeter"})) return unit_millimetre;
  if (is_one_of({"fathom", "fathoms"})) return unit_fathom;
  if (is_one_of({"m", "metre", "meter", "metres", "meters"})) return unit_metre;
  return std::nullopt;
}

}  // namespace

GdalMetadata gdal_metadata_of(std::string_view text) {
  GdalMetadata metadata;
  constexpr std::string_view begin = "<Item";
  for (std::size_t at = text.find(begin); at != npos; at = text.find(begin, at + 1)) {
    const std::size_t close = text.find('>', at);
    if (close == npos) break;
    const std::string_view tag = text.substr(at + begin.size(), close - at - begin.size());
    const std::string_view sample = attribute(tag, "sample"), role = attribute(tag, "role"),
                           value = trimmed(text.substr(close + 1, text.find('<', close) - close - 1), " \t\r\n");
    if (!sample.empty() && sample != "0") continue;
    const auto number = [&] { return height_number(value).value_or(NAN); };
    if (role == "unittype") metadata.height_unit = unit_called(value), metadata.unit_name = value;
    if (role == "scale") metadata.scale = number();
    if (role == "offset") metadata.offset = number();
  }
  return metadata;
}

}  // namespace sonar
