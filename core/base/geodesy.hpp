// Converts latitudes and longitudes (WGS84) to the plane that is tangent to the ellipsoid at an origin. This is used for poses
// with satellite positions. All calculations are in double, exact to micrometres near the origin.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/geometry.hpp"

namespace sonar {

struct Geodetic {
  double latitude_rad = 0, longitude_rad = 0;
  double altitude_m = 0;  // above the ellipsoid, or above another level that is the same for all positions
  bool operator==(const Geodetic&) const = default;
};

inline constexpr double earth_semi_major_m = 6378137.0;        // WGS84 (NIMA TR8350.2, table 3.1)
inline constexpr double earth_flattening = 1 / 298.257223563;  // source: the same table
inline constexpr double earth_eccentricity_squared = earth_flattening * (2 - earth_flattening);

/// Returns earth-centred, earth-fixed coordinates [m]; x points to latitude 0, longitude 0, z to the north pole.
inline Vec3d ecef_from(const Geodetic& place) {
  const double s = std::sin(place.latitude_rad), c = std::cos(place.latitude_rad);
  const double normal_m = earth_semi_major_m / std::sqrt(1 - earth_eccentricity_squared * s * s);
  return {(normal_m + place.altitude_m) * c * std::cos(place.longitude_rad),
          (normal_m + place.altitude_m) * c * std::sin(place.longitude_rad),
          (normal_m * (1 - earth_eccentricity_squared) + place.altitude_m) * s};
}

/// Returns the pose of the axes east, north, up at a position, expressed in earth-centred axes.
inline Pose enu_in_ecef(const Geodetic& place) {
  const Quatd about_z = turned_by({0, 0, place.longitude_rad + pi / 2});  // x then points east
  const Quatd about_x = turned_by({pi / 2 - place.latitude_rad, 0, 0});   // z then points up
  return {ecef_from(place), about_z * about_x};
}

/// Returns the pose of the axes east, north, up at `place`, expressed in those at `origin`. Near it, the rotation is small.
inline Pose enu_in_enu_of(const Geodetic& origin, const Geodetic& place) {
  return compose(inverse(enu_in_ecef(origin)), enu_in_ecef(place));
}

// Converts the eastings and northings of charts (Universal Transverse Mercator on WGS 84) to latitudes and longitudes. Source:
// C. F. F. Karney, "Transverse Mercator with an accuracy of a few nanometers", Journal of Geodesy 85 (2011). The code uses the
// series of Krueger in the third flattening up to its fourth power, which is exact to micrometres within 10 degrees of a zone.

struct UtmZone {
  int number = 31;  // 1 to 60; the middle of zone n has the longitude 6 n - 183 degrees
  bool south = false;
  bool operator==(const UtmZone&) const = default;
};

/// Returns the name of the zone: "33N", "33S".
std::string text_of(UtmZone zone);
/// Reads "33N" or "33 south"; returns nullopt for any other text.
std::optional<UtmZone> utm_zone_from(std::string_view text);
/// Returns the zone that contains a position, without the exceptions for Norway and Svalbard.
UtmZone utm_zone_at(const Geodetic& place);

/// True if the coordinates [m] are in the ranges of a zone, or at most 500 km outside.
bool are_utm(double easting_m, double northing_m);
/// Returns the position on the ellipsoid with these coordinates [m].
Geodetic geodetic_from_utm(UtmZone zone, double easting_m, double northing_m);

}  // namespace sonar
