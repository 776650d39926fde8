// Common parts of readers of height grids with coordinates: numbers, cells without data, and coordinate systems.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/shapes/terrain.hpp"

namespace sonar {

/// Parses a number of a grid file, which may have leading zeros ("007") or be nan.
std::optional<double> height_number(std::string_view word);
bool is_nan_word(std::string_view word);
/// Makes a word that is not a number printable for an error text.
std::string word_text(std::string_view word);
/// The byte order mark that may precede the first word of a text in UTF-8.
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

/// Recognises values that mean no data: nan, the declared value, and fill values beyond every height.
class HeightValues {
 public:
  /// `declared`: the no-data value of the file. The grid may state the same value with more digits.
  explicit HeightValues(std::optional<std::string_view> declared);
  /// Returns NaN for no data, and nullopt for a number that is neither a height nor a fill value beyond every height.
  std::optional<float> height_of(double value);
  std::size_t fill_values() const { return fill_values_; }

 private:
  std::optional<double> declared_;
  double tolerance_ = 0;
  std::size_t fill_values_ = 0;
};

/// The units and systems of coordinates and heights, as a file states them.
struct CoordinateSystem {
  std::optional<bool> geographic = {};  // coordinates are angles
  double unit_deg = 1;                  // unit of coordinates that are angles
  double prime_meridian_deg = 0;        // longitude of the prime meridian, east of Greenwich
  double unit_m = 1;                    // unit of coordinates that are lengths
  double height_unit_m = 1;
  bool web_mercator = false;  // its metres are shorter on the ground than true metres
  /// The zone, if the datum agrees with WGS 84 within 2 m.
  std::optional<UtmZone> utm = {};
  /// The name of a system that is not UTM, Web Mercator or WGS 84; empty for these and for local coordinates.
  std::string name = {};
  std::string depths = {};   // the name of a vertical system that counts downwards; empty for all others
  bool other_datum = false;  // degrees that may differ from those of WGS 84 by about 100 m
};

/// The parameters of a transverse Mercator projection, in metres on an ellipsoid like that of WGS 84.
struct TransverseMercator {
  double latitude_deg = 0, central_meridian_deg = 0, scale = 1, false_easting_m = 0, false_northing_m = 0;
};

/// The values of a file, before finish_heights().
struct RawHeights {
  std::vector<double> x = {}, y = {};  // increasing
  std::vector<float> z = {};           // [y][x], NaN: no data
  std::size_t fill_values = 0;         // number of undeclared fill values beyond every height, which were replaced by NaN
  CoordinateSystem system = {};
  double scale = 1, offset = 0;  // a height is scale * z + offset
  std::vector<std::string> notes = {};

  /// Reverses the order of the rows, for files that begin in the north. `columns`: number of columns of `z`.
  void turn_rows(std::size_t columns);
};

/// Removes undeclared fill values: usual ones that are far outside of all other heights. Adds notes about these and other far
/// values.
void take_out_fills(RawHeights& raw, std::vector<std::string>& notes);
/// Removes fill values, converts units, notes holes, and sets the origin. Errors do not contain the file name.
Result<HeightGrid> finish_heights(RawHeights raw, const HeightOptions& options);

/// Reads the .prj file beside the heights: WKT of version 1 or 2, or the lines that Arc/Info writes.
CoordinateSystem system_by_prj(const std::filesystem::path& heights);
/// Parses WKT; units that it does not name are metres.
CoordinateSystem system_of_wkt(std::string_view text);
/// The prime meridian of a geographic system of the EPSG data set, in degrees east of Greenwich.
double prime_meridian_of_epsg(std::uint32_t code);
/// A prime meridian of the EPSG data set, in degrees east of Greenwich; nullopt for an unknown code.
std::optional<double> degrees_of_prime_meridian(std::uint32_t code);
/// The zone of a projected system of the EPSG data set; nullopt for other projections, and for older datums.
std::optional<UtmZone> utm_of_epsg(std::uint32_t code);
/// True for EPSG codes of geographic systems that differ from WGS 84 by at most 2 m.
bool agrees_with_wgs84(std::uint32_t code);
/// True for GRS 80 and the ellipsoid of WGS 84, which all datums since about 1980 have.
bool is_modern_ellipsoid(double semi_major_m, double inverse_flattening);
/// Returns the zone with these parameters, if any. The false easting may begin with the zone's number, as in 32500000.
std::optional<UtmZone> utm_of_parameters(const TransverseMercator& by);

}  // namespace sonar
