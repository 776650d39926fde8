#include "core/scene/files/height_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/letters.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

constexpr double farthest_deg = 5, nearest_pole_deg = 89;

bool could_be_degrees(const RawHeights& raw) {
  return raw.x.front() >= -180 && raw.x.back() <= 360 && raw.y.front() >= -90 && raw.y.back() <= 90;
}

/// True for multiples of a ninth of an arc second, such as 0.000277777778, that are not round decimals. Such sizes are unlikely
/// in metres.
bool are_arc_seconds(double cell) {
  const auto is_whole = [](double v) { return v > 0.5 && std::abs(v - std::round(v)) < 1e-3; };
  constexpr double ninths_in_a_degree = 9 * 3600;
  return is_whole(cell * ninths_in_a_degree) && !is_whole(cell * 1e5);
}

/// True if the coordinates are probably degrees: read as metres, they make the ground absurdly steep (a slope of 1 in 100
/// becomes 1000 to 1), or small cells have a size that is usual in degrees. `height_m`: metres per unit of `raw.z`.
bool shows_degrees(const RawHeights& raw, double height_m) {
  const std::size_t columns = raw.x.size();
  const double cell = (raw.x.back() - raw.x.front()) / static_cast<double>(columns - 1);
  constexpr double small_cell_deg = 0.1, steep = 10;
  if (!could_be_degrees(raw)) return false;
  double rise = 0;
  std::size_t steps = 0, steep_steps = 0;
  for (std::size_t k = 1; k < raw.z.size(); ++k)
    if (k % columns != 0 && !std::isnan(raw.z[k]) && !std::isnan(raw.z[k - 1])) {
      const double step = height_m * std::abs(static_cast<double>(raw.z[k]) - static_cast<double>(raw.z[k - 1]));
      rise += step, ++steps, steep_steps += step > steep * cell;
    }
  // Large cells are more likely in metres. Therefore a few wrong heights must not decide.
  if (cell >= small_cell_deg) return 2 * steep_steps > steps;
  const double slope = steps == 0 ? 0 : rise / static_cast<double>(steps) / cell;
  return slope > steep || (slope == 0 && cell < 0.005) || are_arc_seconds(cell);
}

/// Converts to degrees, because a metre of Web Mercator is shorter on the ground by the cosine of the latitude.
void convert_web_mercator(RawHeights& raw, std::vector<std::string>& notes) {
  constexpr double radius_m = 6378137;
  for (double& x : raw.x) x = deg_from_rad(x * raw.system.unit_m / radius_m);
  for (double& y : raw.y) y = deg_from_rad(std::atan(std::sinh(y * raw.system.unit_m / radius_m)));
  raw.system.geographic = true;
  notes.push_back(
      text::format("its coordinates, in Web Mercator, whose lengths are %.3g times those on the ground here, become degrees",
                   1 / std::cos(rad_from_deg(0.5 * (raw.y.front() + raw.y.back())))));
}

/// Converts longitudes and latitudes in other units, or relative to a meridian other than that of Greenwich.
void convert_to_degrees(RawHeights& raw, std::vector<std::string>& notes) {
  const double unit_deg = raw.system.unit_deg, meridian_deg = raw.system.prime_meridian_deg;
  if (unit_deg != 1) {
    for (auto* axis : {&raw.x, &raw.y})
      for (double& v : *axis) v *= unit_deg;
    notes.push_back(text::format("its coordinates, in units of %.9g degrees, become degrees", unit_deg));
  }
  if (meridian_deg == 0) return;
  for (double& x : raw.x) x += meridian_deg;
  notes.push_back(text::format("its longitudes begin %.6f degrees %s of Greenwich, and become those from Greenwich",
                               std::abs(meridian_deg), meridian_deg > 0 ? "east" : "west"));
}

void convert_to_metres(RawHeights& raw, double z_scale, std::vector<std::string>& notes) {
  const double unit_m = raw.system.unit_m;
  if (unit_m == 1) return;
  for (auto* axis : {&raw.x, &raw.y})
    for (double& v : *axis) v *= unit_m;
  notes.push_back(text::format("its coordinates, in units of %.6g m, become metres", unit_m) +
                  (raw.system.height_unit_m == 1 && unit_m < 1 && std::abs(z_scale) == 1
                       ? text::format("; heights stay as they are: set z_scale: %.6g if they are in these units too", unit_m)
                       : ""));
}

/// Removes the zone number that often precedes German eastings: 32500000.
void remove_zone_number(RawHeights& raw, UtmZone zone, std::vector<std::string>& notes) {
  constexpr double a_million_m = 1e6;
  const auto has_it = [&](double x) { return std::floor(x / a_million_m) == zone.number; };
  if (!has_it(raw.x.front()) || !has_it(raw.x.back())) return;
  for (double& x : raw.x) x -= zone.number * a_million_m;
  notes.push_back(text::format("its eastings begin with %d, the number of their zone, which is removed", zone.number));
}

/// Returns a note about a system whose latitudes and longitudes are unknown or only roughly known.
std::string note_of_system(const CoordinateSystem& system) {
  const bool is_named = !same_letters(system.name, "unknown") && !same_letters(system.name, "unnamed");
  const std::string name = is_named ? text::printable(system.name) : "a system without a name";
  return system.other_datum ? "its degrees, of " + name +
                                  ", are read as degrees of WGS 84, which may differ by about 100 m; convert them: gdalwarp "
                                  "-t_srs EPSG:4326 IN OUT.tif"
                            : "its coordinates, of " + name +
                                  ", are read as plain metres, with the scale of that projection; to place it by latitude and "
                                  "longitude: gdalwarp -t_srs EPSG:4326 IN OUT.tif";
}

/// Converts stored values to heights. Fill values must have been replaced by NaN before.
void apply_scale(RawHeights& raw, std::vector<std::string>& notes) {
  if (raw.scale == 1 && raw.offset == 0) return;
  for (float& z : raw.z) z = static_cast<float>(raw.scale * static_cast<double>(z) + raw.offset);
  notes.push_back(
      text::format("its heights are %.9g times the stored values, plus %.9g, as the file says", raw.scale, raw.offset));
}

/// Adds a note about a vertical system that counts downwards. The values decide, because many files that name such a system
/// contain heights.
void note_depths(const RawHeights& raw, double z_scale, std::vector<std::string>& notes) {
  if (raw.system.depths.empty() || z_scale < 0) return;
  const auto positive = std::count_if(raw.z.begin(), raw.z.end(), [](float z) { return z > 0; }),
             negative = std::count_if(raw.z.begin(), raw.z.end(), [](float z) { return z < 0; });
  notes.push_back(
      "its vertical system, " + text::printable(raw.system.depths) + ", counts depths downwards" +
      (positive > negative ? ": set z_scale: -1" : ", but its values are negative, as heights below the surface are"));
}

std::string place_text(const Geodetic& place) {
  return text::format("latitude %.6f, longitude %.6f", deg_from_rad(place.latitude_rad), deg_from_rad(place.longitude_rad));
}

/// Sets the origin from the scene or the configuration; if neither has one, to the middle of the grid.
void choose_origin(HeightGrid& grid, const HeightOptions& options, const Geodetic& middle) {
  grid.origin = options.origin ? options.origin : options.world_origin;
  if (grid.origin && !options.origin)
    grid.notes.push_back("its position is relative to world.origin, " + place_text(*grid.origin));
  if (grid.origin && std::abs(grid.origin->altitude_m) >= 1)
    grid.notes.push_back(
        text::format("its heights are relative to z = 0, which is %.6g m above mean sea level by world.origin; if "
                     "they are above mean sea level, put %.6g into the z of its pose",
                     grid.origin->altitude_m, -grid.origin->altitude_m));
  if (options.origin && options.world_origin) {
    const Vec3d apart = enu_in_enu_of(*options.world_origin, *options.origin).position_m;
    const double distance_m = std::hypot(apart.x, apart.y);
    constexpr double agreeing_m = 2;
    if (distance_m > agreeing_m)
      grid.notes.push_back(
          text::format("its origin is %.3g %s from world.origin: latitudes and longitudes of vehicles do not fit this ground; "
                       "remove origin to use world.origin",
                       distance_m < 1000 ? distance_m : distance_m / 1000, distance_m < 1000 ? "m" : "km"));
  }
  if (grid.origin) return;
  grid.origin = middle;
  grid.notes.push_back("x and y are relative to its middle, " + place_text(middle) +
                       "; set origin: {lat, lon} to place it otherwise");
}

/// Adds a note if large cells may be in degrees although the ground is flat: the coordinates are possible on Earth, and the grid
/// is not local (0, 0 at a corner or in the middle), or spans the Earth, or is deeper than wide.
void hint_at_degrees(HeightGrid& grid) {
  constexpr double least_cell = 0.05, all_around = 300, pole_to_pole = 175;
  const double cell = grid.x[1] - grid.x[0], near = cell;
  const auto is_local = [&](const std::vector<double>& axis) {
    return std::abs(axis.front()) <= near || std::abs(axis.back()) <= near || std::abs(axis.front() + axis.back()) <= near;
  };
  if (cell < least_cell || grid.x.front() < -180 || grid.x.back() > 360 || grid.y.front() < -90 || grid.y.back() > 90) return;
  const double width_x = grid.x.back() - grid.x.front() + cell, width_y = grid.y.back() - grid.y.front() + cell;
  const bool is_deep = std::any_of(grid.z_m.begin(), grid.z_m.end(), [width = std::max(width_x, width_y)](float z) {
    return std::abs(static_cast<double>(z)) > width;
  });
  if (is_local(grid.x) && is_local(grid.y) && width_x < all_around && width_y < pole_to_pole && !is_deep) return;
  grid.notes.push_back(
      text::format("its coordinates (%.6g, %.6g, cells of %.6g) are read as metres; write geographic: true if they "
                   "are degrees, or false",
                   grid.x.front(), grid.y.front(), cell));
}

Result<void> set_origin_of_degrees(HeightGrid& grid, const HeightOptions& options, bool guessed) {
  const double longitude = 0.5 * (grid.x.front() + grid.x.back()), latitude = 0.5 * (grid.y.front() + grid.y.back());
  if (guessed)
    grid.notes.push_back(
        text::format("its coordinates (%.6g, %.6g, cells of %.6g) are read as degrees; write geographic: true, or "
                     "false if they are metres",
                     grid.x.front(), grid.y.front(), grid.x[1] - grid.x[0]));
  choose_origin(grid, options, {rad_from_deg(latitude), rad_from_deg(longitude), 0});
  const double from_longitude = deg_from_rad(grid.origin->longitude_rad), from_latitude = deg_from_rad(grid.origin->latitude_rad);
  const double turns = std::round((from_longitude - longitude) / 360);  // files use 0 to 360 or -180 to 180
  for (double& x : grid.x) x += 360 * turns;
  const double far = std::max({std::abs(grid.x.front() - from_longitude), std::abs(grid.x.back() - from_longitude),
                               std::abs(grid.y.front() - from_latitude), std::abs(grid.y.back() - from_latitude)});
  const char* const else_metres = guessed ? "; write geographic: false if its coordinates are metres" : "";
  if (far > farthest_deg)
    return failure(ErrorKind::bad_data,
                   text::format("the grid, in degrees, reaches %.3g degrees from the origin (%s); at most 5: cut a part out "
                                "(gdal_translate -projwin WEST NORTH EAST SOUTH IN OUT.tif), or set origin%s",
                                far, place_text(*grid.origin).c_str(), else_metres));
  if (std::max(std::abs(grid.y.front()), std::abs(grid.y.back())) > nearest_pole_deg)
    return failure(ErrorKind::bad_data,
                   "the grid, in degrees, reaches within 1 degree of a pole; project it to metres" + std::string(else_metres));
  return {};
}

Result<void> set_origin_of_zone(HeightGrid& grid, const HeightOptions& options, UtmZone zone) {
  if (!are_utm(grid.x.front(), grid.y.front()) || !are_utm(grid.x.back(), grid.y.back()))
    return failure(
        ErrorKind::bad_data,
        text::format("its coordinates (%.7g, %.7g) are not eastings and northings of UTM, zone %s; %s to read them as plain "
                     "metres",
                     grid.x.front(), grid.y.front(), text_of(zone).c_str(),
                     options.utm ? "remove utm" : "write geographic: false"));
  grid.zone = zone;
  choose_origin(grid, options, {});
  double far_m = 0;
  for (const double x : {grid.x.front(), grid.x.back()})
    for (const double y : {grid.y.front(), grid.y.back()})
      far_m = std::max(far_m, length(enu_in_enu_of(*grid.origin, geodetic_from_utm(zone, x, y)).position_m));
  if (far_m > farthest_deg * 111e3)
    return failure(
        ErrorKind::bad_data,
        text::format("the grid, in UTM zone %s, reaches %.0f km from the origin (%s); at most 555: correct the zone or "
                     "the origin, or cut a part out",
                     text_of(zone).c_str(), far_m / 1000, place_text(*grid.origin).c_str()));
  return {};
}

/// Adds a note if coordinates in metres of an unknown zone, read in the zone of the world's origin, lie near this origin.
void hint_at_zone(HeightGrid& grid, const Geodetic& world_origin) {
  constexpr double near_m = 50'000, least_northing_m = 10'000;
  const double x = 0.5 * (grid.x.front() + grid.x.back()), y = 0.5 * (grid.y.front() + grid.y.back());
  if (std::abs(y) < least_northing_m || !are_utm(x, y)) return;
  const UtmZone zone = utm_zone_at(world_origin);
  if (length(enu_in_enu_of(world_origin, geodetic_from_utm(zone, x, y)).position_m) < near_m)
    grid.notes.push_back(
        text::format("its coordinates are near world.origin if they are UTM of zone %s: write utm: %s to place it "
                     "there",
                     text_of(zone).c_str(), text_of(zone).c_str()));
}

}  // namespace

bool is_nan_word(std::string_view word) {
  // The words that printf, Microsoft's C, R, databases, Python and numpy's masked arrays write for missing values.
  static constexpr std::array<std::string_view, 16> words{"nan", "NaN",  "NAN",  "nan(ind)", "1.#QNAN", "1.#IND",
                                                          "NA",  "null", "NULL", "None",     "none",    "--",
                                                          "inf", "Inf",  "INF",  "Infinity"};
  const auto is_word = [](std::string_view w) { return std::find(words.begin(), words.end(), w) != words.end(); };
  if (is_word(word)) return true;
  return (word.starts_with('-') || word.starts_with('+')) && is_word(word.substr(1));
}

std::string word_text(std::string_view word) {
  constexpr std::size_t longest = 40;
  const std::size_t comma = word.find(',');
  const bool decimal = comma != word.npos && comma > 0 && comma + 1 < word.size();
  return '"' + text::printable(word.substr(0, longest)) + '"' +
         (decimal ? " (numbers have a decimal point, and blanks between them)" : "");
}

std::optional<double> height_number(std::string_view s) {
  if (const auto v = text::parse_decimal(s)) return v;
  if (is_nan_word(s)) return std::numeric_limits<double>::quiet_NaN();
  std::size_t sign = s.starts_with('-') || s.starts_with('+') ? 1 : 0, zeros = sign;
  while (zeros + 1 < s.size() && s[zeros] == '0' && s[zeros + 1] >= '0' && s[zeros + 1] <= '9') ++zeros;
  if (zeros == sign) return std::nullopt;
  return text::parse_decimal(std::string(s.substr(0, sign)) + std::string(s.substr(zeros)));
}

void RawHeights::turn_rows(std::size_t columns) {
  const std::size_t rows = z.size() / columns;
  const auto row_at = [&](std::size_t row) { return z.begin() + static_cast<std::ptrdiff_t>(row * columns); };
  for (std::size_t row = 0; row < rows / 2; ++row) std::swap_ranges(row_at(row), row_at(row + 1), row_at(rows - 1 - row));
}

Result<HeightGrid> finish_heights(RawHeights raw, const HeightOptions& options) {
  HeightGrid grid;
  grid.notes = std::move(raw.notes);
  take_out_fills(raw, grid.notes);
  apply_scale(raw, grid.notes);
  if (raw.system.web_mercator && options.geographic.value_or(true)) convert_web_mercator(raw, grid.notes);
  const bool said = options.geographic.has_value() || raw.system.geographic.has_value();
  const double z_scale = options.z_scale * raw.system.height_unit_m;
  const bool geographic =
      options.geographic.value_or(raw.system.geographic.value_or(!said && shows_degrees(raw, std::abs(z_scale))));
  if (!geographic) convert_to_metres(raw, options.z_scale, grid.notes);
  if (geographic && !raw.system.web_mercator) convert_to_degrees(raw, grid.notes);
  if (raw.system.height_unit_m != 1)
    grid.notes.push_back(text::format("its heights, in units of %.6g m, become metres", raw.system.height_unit_m));
  if (geographic && !could_be_degrees(raw))
    return failure(ErrorKind::bad_data, "its coordinates are not longitudes and latitudes in degrees; remove geographic: true");
  const auto zone = options.utm || options.geographic ? options.utm : raw.system.utm;
  if (geographic && zone && options.utm)
    return failure(ErrorKind::bad_data, "utm is for coordinates in metres, and these are degrees; remove it");
  if (zone) remove_zone_number(raw, *zone, grid.notes);
  if (options.origin && !geographic && !zone && !raw.system.name.empty())
    return failure(ErrorKind::bad_data, "origin is for a grid in degrees or UTM, and this is in " +
                                            text::printable(raw.system.name) +
                                            "; convert it to degrees (gdalwarp -t_srs EPSG:4326 IN OUT.tif), or remove origin");
  if (!raw.system.name.empty() && !options.geographic && !options.utm) grid.notes.push_back(note_of_system(raw.system));
  if (options.origin && !geographic && !zone)
    return failure(ErrorKind::bad_data,
                   "origin is for a grid in degrees or UTM; write geographic: true or utm: 33N (its zone) if it is one, else "
                   "remove it");
  note_depths(raw, options.z_scale, grid.notes);
  const auto holes = static_cast<std::size_t>(std::count_if(raw.z.begin(), raw.z.end(), [](float z) { return std::isnan(z); }));
  if (holes > 0)
    grid.notes.push_back(text::format("%zu of its %zu heights (%.2g %%) are missing: holes in the ground", holes, raw.z.size(),
                                      100 * static_cast<double>(holes) / static_cast<double>(raw.z.size())));
  grid.x = std::move(raw.x);
  grid.y = std::move(raw.y);
  grid.z_m = std::move(raw.z);
  for (float& z : grid.z_m) z = static_cast<float>(static_cast<double>(z) * z_scale);
  if (geographic) {
    if (auto set = set_origin_of_degrees(grid, options, !said); !set) return tl::make_unexpected(set.error());
  } else if (zone && (options.origin || options.world_origin)) {
    if (auto set = set_origin_of_zone(grid, options, *zone); !set) return tl::make_unexpected(set.error());
  } else if (zone && !options.centred) {
    grid.notes.push_back("its coordinates are metres of UTM zone " + text_of(*zone) +
                         "; set origin: {lat, lon}, or world.origin in the configuration, to place it by latitude and longitude");
  } else {
    if (options.world_origin && !options.geographic) hint_at_zone(grid, *options.world_origin);
    if (!said && !zone) hint_at_degrees(grid);
  }
  return grid;
}

}  // namespace sonar
