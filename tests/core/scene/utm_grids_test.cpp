// Height grids in metres of UTM: the source of their zone, and their position in a scene and relative to the world's origin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/files/height_values.hpp"
#include "core/scene/files/load_scene.hpp"
#include "core/text/format.hpp"
#include "tests/core/scene/mesh_checks.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::utm_grids_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using tests::TemporaryFiles;

const Geodetic origin{rad_from_deg(60), rad_from_deg(15), 0};
constexpr double northing_m = 6'651'411.19;  // latitude 60 degrees, in the middle of a zone

/// Returns 21 x 21 heights, 100 m apart, around a position.
std::string grid_about(double easting_m, double at_northing_m) {
  std::string text =
      text::format("ncols 21\nnrows 21\nxllcenter %.2f\nyllcenter %.2f\ncellsize 100\n", easting_m - 1000, at_northing_m - 1000);
  for (int i = 0; i < 441; ++i) text += text::format("%.1f ", -20 - 0.1 * (i % 7));
  return text;
}

struct UtmGrid : ::testing::Test {
  TemporaryFiles files;
  std::string text = grid_about(500'000, northing_m);

  Result<HeightGrid> read(const HeightOptions& options) { return read_esri_heights(files.write("g.asc", text), options); }
  std::string notes_of(const HeightOptions& options) {
    const auto grid = read(options);
    std::string all;
    if (!grid) return grid.error().text;
    for (const std::string& note : grid->notes) all += note + ". ";
    return all;
  }
};

TEST_F(UtmGrid, EveryVertexLiesWhereTheGeodesyOfPosesPutsItsPlace) {
  text = grid_about(670'000, northing_m);  // near the edge of the zone: grid north is 2.6 degrees from north
  const auto grid = read({.utm = UtmZone{33, false}, .origin = origin});
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_THAT(grid->notes, ElementsAre());
  const auto mesh = mesh_from_grid(*grid);
  ASSERT_TRUE(mesh) << mesh.error().text;
  tests::expect_sound(mesh->mesh);
  const auto vertex = [&](std::size_t k) { return to_double(mesh->mesh.vertices[k]) + mesh->centre_m; };
  for (const std::size_t k : {std::size_t{0}, std::size_t{20}, std::size_t{227}, std::size_t{440}}) {
    const Vec3d expected = enu_in_enu_of(origin, geodetic_from_utm({33, false}, grid->x[k % 21], grid->y[k / 21])).position_m;
    EXPECT_NEAR(vertex(k).x, expected.x, 1e-3) << k;
    EXPECT_NEAR(vertex(k).y, expected.y, 1e-3) << k;
    EXPECT_NEAR(vertex(k).z, static_cast<double>(grid->z_m[k]), 1e-5) << k;
  }
  const Vec3d row =
      vertex(20) - vertex(0);  // the sine of 60 degrees times the distance from the zone's middle, slightly more than 3 degrees
  EXPECT_NEAR(deg_from_rad(std::atan2(row.y, row.x)), 0, 0.2) << "seen from the origin, which is at the zone's middle";
  const auto there = read({.utm = UtmZone{33, false}, .origin = Geodetic{rad_from_deg(60), rad_from_deg(18), 0}});
  ASSERT_TRUE(there) << there.error().text;
  const auto turned = mesh_from_grid(*there);
  ASSERT_TRUE(turned);
  const Vec3 along = turned->mesh.vertices[20] - turned->mesh.vertices[0];
  EXPECT_NEAR(deg_from_rad(std::atan2(static_cast<double>(along.y), static_cast<double>(along.x))), -2.6, 0.1);
}

TEST_F(UtmGrid, TheZoneComesFromThePrjFile) {
  const auto zone_by = [&](const std::string& prj) {
    files.write("g.prj", prj);
    const auto grid = read({.world_origin = origin});
    return !grid ? grid.error().text : grid->zone ? text_of(*grid->zone) : "none";
  };
  EXPECT_EQ(zone_by("PROJCS[\"WGS 84 / UTM zone 33N\",GEOGCS[\"WGS 84\"],UNIT[\"metre\",1]]"), "33N");
  EXPECT_EQ(zone_by("PROJCS[\"WGS_1984_UTM_Zone_33N\",GEOGCS[\"GCS_WGS_1984\"],UNIT[\"Meter\",1.0]]"), "33N");
  EXPECT_EQ(zone_by("PROJCRS[\"ETRS89 / UTM zone 33N\",BASEGEOGCRS[\"ETRS89\"],LENGTHUNIT[\"metre\",1]]"), "33N");
  EXPECT_EQ(zone_by("Projection    UTM\nZone          33\nDatum         WGS84\nUnits         METERS\n"), "33N");
  EXPECT_EQ(zone_by("PROJCS[\"ED50 / UTM zone 33N\",GEOGCS[\"ED50\"],UNIT[\"metre\",1]]"), "none");
  EXPECT_EQ(zone_by("Projection    UTM\nZone          33\nDatum         NAD27\nUnits         METERS\n"), "none");
  EXPECT_EQ(zone_by("PROJCS[\"x / UTM\",GEOGCS[\"WGS 84 / UTM zone 33N\"],UNIT[\"metre\",1]]"), "none");
  const auto utm_in = [](const char* wkt) {
    const auto zone = system_of_wkt(wkt).utm;
    return zone ? text_of(*zone) : "none";
  };
  EXPECT_EQ(utm_in("COMPD_CS[\"NAD83(2011) / UTM zone 10N + NAVD88\",PROJCS[\"NAD83(2011) / UTM zone 10N\"]]"), "10N");
  EXPECT_EQ(utm_in("COMPD_CS[\"NAD83 / UTM zone 5N + NAVD88 height\",PROJCS[\"NAD83 / UTM zone 5N\"]]"), "5N");
  EXPECT_EQ(utm_in("COMPD_CS[\"unknown\",PROJCS[\"NAD83 / UTM zone 5N\",GEOGCS[\"NAD83\"]],VERT_CS[\"NAVD88\"]]"), "5N");
  EXPECT_EQ(utm_in("COMPOUNDCRS[\"unknown\",PROJCRS[\"WGS 84 / UTM zone 7S\",BASEGEOGCRS[\"WGS 84\"]]]"), "7S");
  EXPECT_EQ(utm_in("PROJCS[\"GDA94 / MGA zone 55\"]"), "55S");
  EXPECT_EQ(utm_in("PROJCS[\"WGS 84 / UTM zone 4N\"]"), "4N");
  EXPECT_EQ(utm_in("PROJCS[\"WGS 84 / UTM zone 61N\"]"), "none");
  for (const auto& [code, zone] : {std::pair{32601u, "1N"},
                                   {32660u, "60N"},
                                   {32733u, "33S"},
                                   {25832u, "32N"},
                                   {26910u, "10N"},
                                   {6339u, "10N"},
                                   {31983u, "23S"},
                                   {28355u, "55S"},
                                   {7855u, "55S"}})
    EXPECT_EQ(text_of(utm_of_epsg(code).value_or(UtmZone{})), zone) << code;
  for (const std::uint32_t code : {0u, 4326u, 32600u, 32661u, 32767u, 23033u, 26733u}) EXPECT_FALSE(utm_of_epsg(code)) << code;
}

TEST_F(UtmGrid, AGridWithoutAnOriginKeepsItsCoordinatesWithANote) {
  const auto grid = read({.utm = UtmZone{33, false}});
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_FALSE(grid->origin || grid->zone);
  EXPECT_EQ(grid->x.front(), 499'000);
  EXPECT_THAT(grid->notes, ElementsAre(HasSubstr("metres of UTM zone 33N; set origin: {lat, lon}, or world.origin")));
  EXPECT_EQ(notes_of({.utm = UtmZone{33, false}, .centred = true}), "");
  files.write("g.prj", "PROJCS[\"WGS 84 / UTM zone 33N\"]");
  EXPECT_THAT(notes_of({}), HasSubstr("metres of UTM zone 33N"));
  EXPECT_EQ(notes_of({.geographic = false, .world_origin = origin}), "");
  EXPECT_EQ(notes_of({.geographic = false, .utm = UtmZone{33, false}, .world_origin = origin}),
            notes_of({.world_origin = origin}));
}

TEST_F(UtmGrid, TheWorldsOriginPlacesAGridWithoutAnOrigin) {
  const auto grid = read({.utm = UtmZone{33, false}, .world_origin = origin});
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_EQ(grid->origin, origin);
  EXPECT_THAT(grid->notes, ElementsAre("its position is relative to world.origin, latitude 60.000000, longitude 15.000000"));
  const Geodetic near{rad_from_deg(60.09), rad_from_deg(15), 0};
  const HeightOptions both{.utm = UtmZone{33, false}, .origin = near, .world_origin = origin};
  EXPECT_EQ(read(both)->origin, near);
  EXPECT_THAT(notes_of(both),
              HasSubstr("its origin is 10 km from world.origin: latitudes and longitudes of vehicles do not fit"));
  EXPECT_EQ(notes_of({.utm = UtmZone{33, false}, .origin = origin, .world_origin = origin}), "");
  text = "ncols 2\nnrows 2\nxllcenter 15\nyllcenter 60\ncellsize 0.001\n-9 -9 -9 -9\n";
  EXPECT_THAT(notes_of({.geographic = true, .world_origin = origin}), HasSubstr("relative to world.origin"));
  EXPECT_THAT(notes_of({.geographic = true, .origin = near, .world_origin = origin}), HasSubstr("10 km from world.origin"));
}

TEST_F(UtmGrid, AnOriginAboveTheSeaDoesNotChangeHeights) {
  const Geodetic lake{origin.latitude_rad, origin.longitude_rad, 3812};
  const HeightOptions options{.utm = UtmZone{33, false}, .world_origin = lake};
  EXPECT_THAT(notes_of(options), HasSubstr("z = 0, which is 3812 m above mean sea level by world.origin; if they are above mean "
                                           "sea level, put -3812 into the z of its pose"));
  EXPECT_EQ(read(options)->z_m, read({.utm = UtmZone{33, false}, .world_origin = origin})->z_m);
}

TEST_F(UtmGrid, MetresNearTheWorldsOriginInItsZoneAreProbablyThatZone) {
  EXPECT_THAT(notes_of({.world_origin = origin}), HasSubstr("if they are UTM of zone 33N: write utm: 33N to place it there"));
  EXPECT_EQ(notes_of({.world_origin = Geodetic{rad_from_deg(40), rad_from_deg(15), 0}}), "");
  text = grid_about(0, 0);
  EXPECT_EQ(notes_of({.world_origin = Geodetic{}}), "");
}

TEST_F(UtmGrid, WrongZonesAndOriginsAreRefused) {
  EXPECT_THAT(notes_of({.utm = UtmZone{10, false}, .origin = origin}), HasSubstr("in UTM zone 10N, reaches"));
  EXPECT_THAT(notes_of({.geographic = true, .utm = UtmZone{33, false}}), HasSubstr("not longitudes and latitudes"));
  text = grid_about(50'000'000, 0);
  EXPECT_THAT(notes_of({.utm = UtmZone{33, false}, .origin = origin}),
              HasSubstr("are not eastings and northings of UTM, zone 33N; remove utm to read them as plain metres"));
  files.write("g.prj", "PROJCS[\"WGS 84 / UTM zone 33N\"]");
  EXPECT_THAT(notes_of({.origin = origin}), HasSubstr("write geographic: false to read them as plain metres"));
  text = "ncols 2\nnrows 2\nxllcenter 15\nyllcenter 60\ncellsize 0.001\n-9 -9 -9 -9\n";
  EXPECT_THAT(notes_of({.geographic = true, .utm = UtmZone{33, false}}), HasSubstr("utm is for coordinates in metres"));
}

TEST_F(UtmGrid, AGridIsReadInAScene) {
  files.write("g.asc", text);
  const auto scene_of = [&](const std::string& keys, const std::optional<Geodetic>& world_origin) {
    return load_scene(
        files.write("s.yaml", "objects:\n  - {name: bed, type: heightmap, file: g.asc, material: sand" + keys + "}\n"),
        world_origin);
  };
  const auto placed = scene_of(", utm: 33N", origin);
  ASSERT_TRUE(placed) << placed.error().text;
  EXPECT_NEAR((*placed)->objects[0].in_world.position_m.x, 0, 0.01);
  EXPECT_NEAR((*placed)->objects[0].in_world.position_m.y, 0, 0.02);
  EXPECT_THAT((*placed)->notes, ElementsAre(HasSubstr("g.asc: its position is relative to world.origin")));
  const auto own = scene_of(", utm: 33N, origin: {lat: 60, lon: 15}", std::nullopt);
  ASSERT_TRUE(own) << own.error().text;
  EXPECT_EQ((*own)->objects[0].in_world.position_m, (*placed)->objects[0].in_world.position_m);
  const auto centred = scene_of(", utm: 33N, centred: true", origin);
  ASSERT_TRUE(centred) << centred.error().text;
  EXPECT_EQ((*centred)->objects[0].in_world.position_m.y, 0);
  EXPECT_TRUE((*centred)->notes.empty());
  EXPECT_THAT(scene_of(", utm: 33", origin).error().text,
              HasSubstr("utm: is not a zone of UTM; write its number and hemisphere"));
}

}  // namespace
}  // namespace sonar::utm_grids_test
