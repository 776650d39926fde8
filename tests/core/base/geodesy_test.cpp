// Compares positions on the ellipsoid with closed forms: the axes of the earth, radii of curvature, and the rotation between
// tangent planes.
#include "core/base/geodesy.hpp"

#include <gtest/gtest.h>

namespace sonar {
namespace {

constexpr double semi_minor_m = 6356752.314245;  // WGS84, as printed in tables

Geodetic at_deg(double latitude, double longitude, double altitude_m = 0) {
  return {rad_from_deg(latitude), rad_from_deg(longitude), altitude_m};
}
/// Returns the radii of curvature along the meridian and across it [m].
double meridian_m(double latitude_rad) {
  const double s = std::sin(latitude_rad), e2 = earth_eccentricity_squared;
  return earth_semi_major_m * (1 - e2) / std::pow(1 - e2 * s * s, 1.5);
}
double normal_m(double latitude_rad) {
  const double s = std::sin(latitude_rad);
  return earth_semi_major_m / std::sqrt(1 - earth_eccentricity_squared * s * s);
}

void expect_near(Vec3d is, Vec3d wanted, double tolerance) {
  EXPECT_NEAR(is.x, wanted.x, tolerance);
  EXPECT_NEAR(is.y, wanted.y, tolerance);
  EXPECT_NEAR(is.z, wanted.z, tolerance);
}

TEST(Geodesy, EarthAxesPointToTheEquatorAndThePole) {
  expect_near(ecef_from(at_deg(0, 0)), {earth_semi_major_m, 0, 0}, 1e-6);
  expect_near(ecef_from(at_deg(0, 90, 100)), {0, earth_semi_major_m + 100, 0}, 1e-6);
  expect_near(ecef_from(at_deg(90, 37)), {0, 0, semi_minor_m}, 1e-6);
  expect_near(ecef_from(at_deg(-90, 0, 5)), {0, 0, -semi_minor_m - 5}, 1e-6);
}

TEST(Geodesy, EveryPlaceLiesOnTheEllipsoid) {
  for (const double latitude : {-89.0, -33.3, 0.0, 12.0, 47.6, 71.0})
    for (const double longitude : {-179.9, -122.33, 0.0, 15.0, 179.9}) {
      const Vec3d p = ecef_from(at_deg(latitude, longitude));
      const double across = (p.x * p.x + p.y * p.y) / (earth_semi_major_m * earth_semi_major_m);
      EXPECT_NEAR(across + p.z * p.z / (semi_minor_m * semi_minor_m), 1, 1e-12);
    }
}

TEST(Geodesy, LocalAxesAreEastNorthAndUp) {
  const Pose here = enu_in_ecef(at_deg(0, 0));
  expect_near(rotate(here.orientation, {1, 0, 0}), {0, 1, 0}, 1e-12);
  expect_near(rotate(here.orientation, {0, 1, 0}), {0, 0, 1}, 1e-12);
  expect_near(rotate(here.orientation, {0, 0, 1}), {1, 0, 0}, 1e-12);
}

TEST(Geodesy, SmallStepsFollowTheRadiiOfCurvature) {
  for (const double latitude : {-33.8, 0.0, 47.6, 69.6}) {
    const Geodetic origin = at_deg(latitude, -122.33, 20);
    const double step_rad = 1e-6;  // a few metres on the ground
    const auto from_origin = [&](double north, double east, double up) {
      return enu_in_enu_of(origin, {origin.latitude_rad + north, origin.longitude_rad + east, origin.altitude_m + up}).position_m;
    };
    const double north_m = (meridian_m(origin.latitude_rad) + 20) * step_rad;
    const double east_m = (normal_m(origin.latitude_rad) + 20) * std::cos(origin.latitude_rad) * step_rad;
    expect_near(from_origin(step_rad, 0, 0), {0, north_m, 0}, 1e-5);  // the ground is 3 um below the plane here
    expect_near(from_origin(0, step_rad, 0), {east_m, 0, 0}, 1e-5);
    expect_near(from_origin(0, 0, -12.5), {0, 0, -12.5}, 1e-7);
  }
}

TEST(Geodesy, FarAwayTheGroundFallsAndNorthTurns) {
  const Geodetic origin = at_deg(60, 10);
  const Pose place = enu_in_enu_of(origin, at_deg(60, 10.1));
  const double along_m = length(place.position_m);
  EXPECT_NEAR(along_m, normal_m(origin.latitude_rad) * 0.5 * rad_from_deg(0.1), 0.01);
  EXPECT_NEAR(place.position_m.z, -along_m * along_m / (2 * normal_m(origin.latitude_rad)), 0.01);
  // Meridians converge by the sine of the latitude. At a point in the east, north is therefore to the left of north at the
  // origin.
  const Vec3d north = rotate(place.orientation, {0, 1, 0});
  EXPECT_NEAR(std::atan2(-north.x, north.y), rad_from_deg(0.1) * std::sin(origin.latitude_rad), 1e-6);
}

TEST(Geodesy, AcrossTheDateLineIsNear) {
  const Pose place = enu_in_enu_of(at_deg(10, 179.99999), at_deg(10, -179.99999));
  EXPECT_NEAR(place.position_m.x, normal_m(rad_from_deg(10)) * std::cos(rad_from_deg(10)) * rad_from_deg(2e-5), 1e-5);
}

}  // namespace
}  // namespace sonar
