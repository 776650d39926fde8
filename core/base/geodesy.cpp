#include "core/base/geodesy.hpp"

#include <algorithm>
#include <array>

#include "core/base/letters.hpp"

namespace sonar {
namespace {

// Scale on the middle meridian, and offsets of the coordinates [m]; false_northing_m applies only in the southern hemisphere.
constexpr double scale = 0.9996, false_easting_m = 500'000, false_northing_m = 10'000'000;
constexpr double n = earth_flattening / (2 - earth_flattening), n2 = n * n, n3 = n2 * n, n4 = n3 * n;
constexpr double rectifying_m = earth_semi_major_m / (1 + n) * (1 + n2 / 4 + n4 / 64);
/// Coefficients of the conversion from the plane to the conformal sphere.
constexpr std::array<double, 4> to_sphere{n / 2 - n2 * 2 / 3 + n3 * 37 / 96 - n4 / 360, n2 / 48 + n3 / 15 - n4 * 437 / 1440,
                                          n3 * 17 / 480 - n4 * 37 / 840, n4 * 4397 / 161280};
/// Coefficients of the conversion from conformal to geographic latitude.
constexpr std::array<double, 4> to_latitude{2 * n - n2 * 2 / 3 - 2 * n3 + n4 * 116 / 45, n2 * 7 / 3 - n3 * 8 / 5 - n4 * 227 / 45,
                                            n3 * 56 / 15 - n4 * 136 / 35, n4 * 4279 / 630};
constexpr double margin_m = 500'000;

}  // namespace

std::string text_of(UtmZone zone) { return std::to_string(zone.number) + (zone.south ? "S" : "N"); }

std::optional<UtmZone> utm_zone_from(std::string_view text) {
  UtmZone zone{0, false};
  std::size_t at = 0;
  for (; at < text.size() && at < 2 && text[at] >= '0' && text[at] <= '9'; ++at)
    zone.number = 10 * zone.number + (text[at] - '0');
  while (at < text.size() && (text[at] == ' ' || text[at] == '_')) ++at;
  if (zone.number < 1 || zone.number > 60) return std::nullopt;
  const std::string hemisphere = small_letters(text.substr(at));
  zone.south = hemisphere == "s" || hemisphere == "south";
  return zone.south || hemisphere == "n" || hemisphere == "north" ? std::optional(zone) : std::nullopt;
}

UtmZone utm_zone_at(const Geodetic& place) {
  const double turns = std::floor(deg_from_rad(place.longitude_rad) / 360 + 0.5);
  const double longitude_deg = deg_from_rad(place.longitude_rad) - 360 * turns;  // -180 to 180
  return {std::clamp(static_cast<int>(std::floor((longitude_deg + 180) / 6)) + 1, 1, 60), place.latitude_rad < 0};
}

bool are_utm(double easting_m, double northing_m) {
  return easting_m >= -margin_m && easting_m <= 2 * false_easting_m + margin_m && northing_m >= -margin_m &&
         northing_m <= false_northing_m + margin_m;
}

Geodetic geodetic_from_utm(UtmZone zone, double easting_m, double northing_m) {
  const double north = (northing_m - (zone.south ? false_northing_m : 0)) / (scale * rectifying_m);
  const double east = (easting_m - false_easting_m) / (scale * rectifying_m);
  double xi = north, eta = east;
  for (std::size_t k = 0; k < to_sphere.size(); ++k) {
    const double order = 2 * static_cast<double>(k + 1);
    xi -= to_sphere[k] * std::sin(order * north) * std::cosh(order * east);
    eta -= to_sphere[k] * std::cos(order * north) * std::sinh(order * east);
  }
  const double conformal = std::asin(std::sin(xi) / std::cosh(eta));
  double latitude = conformal;
  for (std::size_t k = 0; k < to_latitude.size(); ++k)
    latitude += to_latitude[k] * std::sin(2 * static_cast<double>(k + 1) * conformal);
  const double middle = rad_from_deg(6 * zone.number - 183);
  return {latitude, middle + std::atan2(std::sinh(eta), std::cos(xi)), 0};
}

}  // namespace sonar
