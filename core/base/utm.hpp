// Converts the eastings and northings of charts (Universal Transverse Mercator on WGS 84) to latitudes and longitudes. Source:
// C. F. F. Karney, "Transverse Mercator with an accuracy of a few nanometers", Journal of Geodesy 85 (2011). The code uses the
// series of Krueger in the third flattening up to its fourth power, which is exact to micrometres within 10 degrees of a zone.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/geodesy.hpp"

namespace sonar {

struct UtmZone {
  int number = 31;  // 1 to 60; the middle of zone n has the longitude 6 n - 183 degrees
  bool south = false;
  bool operator==(const UtmZone&) const = default;
};

/// The name of the zone: "33N", "33S".
std::string text_of(UtmZone zone);
/// Reads "33N" or "33 south"; empty for any other text.
std::optional<UtmZone> utm_zone_from(std::string_view text);
/// The zone that contains a position, without the exceptions for Norway and Svalbard.
UtmZone utm_zone_at(const Geodetic& place);

/// True if the coordinates [m] can lie in a zone or in the usual margin around it.
bool are_utm(double easting_m, double northing_m);
/// The position on the ellipsoid with these coordinates [m].
Geodetic geodetic_from_utm(UtmZone zone, double easting_m, double northing_m);

}  // namespace sonar
