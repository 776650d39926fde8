// Compares Universal Transverse Mercator with its definition: angles are preserved everywhere, and the meridian in the middle
// of a zone has 0.9996 times its length.
#include "core/base/geodesy.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace sonar {
namespace {

constexpr double scale = 0.9996;

/// Returns the length of the meridian from the equator [m], by Simpson's rule.
double meridian_arc_m(double latitude_rad) {
  constexpr int steps = 2000;
  const auto radius_m = [](double latitude) {
    const double s = std::sin(latitude), e2 = earth_eccentricity_squared;
    return earth_semi_major_m * (1 - e2) / std::pow(1 - e2 * s * s, 1.5);
  };
  double sum = radius_m(0) + radius_m(latitude_rad);
  for (int k = 1; k < steps; ++k) sum += (k % 2 == 1 ? 4 : 2) * radius_m(latitude_rad * k / steps);
  return sum * latitude_rad / steps / 3;
}

TEST(Utm, TheMiddleOfAZoneHasItsMeridian) {
  for (const double latitude_deg : {0.0, 12.5, 47.0, 60.0, 79.0}) {
    const double arc_m = meridian_arc_m(rad_from_deg(latitude_deg));
    const Geodetic north = geodetic_from_utm({33, false}, 500'000, scale * arc_m);
    EXPECT_NEAR(deg_from_rad(north.latitude_rad), latitude_deg, 1e-10);
    EXPECT_NEAR(deg_from_rad(north.longitude_rad), 15, 1e-12);
    const Geodetic south = geodetic_from_utm({1, true}, 500'000, 10'000'000 - scale * arc_m);
    EXPECT_NEAR(deg_from_rad(south.latitude_rad), -latitude_deg, 1e-10);
    EXPECT_NEAR(deg_from_rad(south.longitude_rad), -177, 1e-12);
  }
  EXPECT_NEAR(scale * meridian_arc_m(rad_from_deg(60.0)), 6'651'411.19, 0.01);  // the value printed in tables
}

// Only one projection preserves angles and has this scale along the meridian.
TEST(Utm, IsTrueToAngles) {
  for (const double easting_m : {166'000.0, 300'000.0, 500'000.0, 780'000.0, 1'200'000.0})
    for (const double northing_m : {0.0, 1'500'000.0, 5'200'000.0, 8'700'000.0}) {
      constexpr double step_m = 10;
      const auto at = [&](double east, double north) {
        return ecef_from(geodetic_from_utm({10, false}, easting_m + east, northing_m + north));
      };
      const Vec3d east = (0.5 / step_m) * (at(step_m, 0) - at(-step_m, 0)),
                  north = (0.5 / step_m) * (at(0, step_m) - at(0, -step_m));
      EXPECT_NEAR(length(east), length(north), 1e-8) << easting_m << " " << northing_m;
      EXPECT_NEAR(dot(east, north), 0, 1e-8) << easting_m << " " << northing_m;
      EXPECT_NEAR(length(north), 1 / scale, 0.01);
    }
}

TEST(Utm, AKnownPlaceHasItsCoordinates) {  // the CN Tower: 43 deg 38' 33.24" north, 79 deg 23' 13.7" west is 17N 630084 4833438
  const Geodetic tower = geodetic_from_utm({17, false}, 630'084, 4'833'438);
  EXPECT_NEAR(deg_from_rad(tower.latitude_rad), 43 + 38 / 60.0 + 33.24 / 3600, 1e-5);
  EXPECT_NEAR(deg_from_rad(tower.longitude_rad), -(79 + 23 / 60.0 + 13.7 / 3600), 1e-5);
}

TEST(Utm, NamesOfZonesAreReadAndWritten) {
  EXPECT_EQ(utm_zone_from("33N"), (UtmZone{33, false}));
  EXPECT_EQ(utm_zone_from("1 south"), (UtmZone{1, true}));
  EXPECT_EQ(utm_zone_from("60_s"), (UtmZone{60, true}));
  for (const char* wrong : {"", "N", "33", "0N", "61N", "331N", "33NN", "-3N", "33V"})
    EXPECT_FALSE(utm_zone_from(wrong)) << wrong;
  EXPECT_EQ(text_of(UtmZone{56, true}), "56S");
  const auto zone_at = [](double latitude, double longitude) {
    return text_of(utm_zone_at({rad_from_deg(latitude), rad_from_deg(longitude), 0}));
  };
  EXPECT_EQ(zone_at(60, 15), "33N");
  EXPECT_EQ(zone_at(-33, 151.2), "56S");
  EXPECT_EQ(zone_at(47, 237.7), "10N");
  EXPECT_EQ(zone_at(47, -180), "1N");
  EXPECT_EQ(zone_at(47, 179.99), "60N");
  EXPECT_FALSE(are_utm(5e6, 0));
  EXPECT_TRUE(are_utm(500'000, 9'999'999));
}

}  // namespace
}  // namespace sonar
