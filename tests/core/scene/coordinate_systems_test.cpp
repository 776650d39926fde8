// Coordinate systems in files: codes and keys of GeoTIFF, WKT of .prj files, and the notes about unknown systems.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/files/geo_keys.hpp"
#include "core/text/format.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::coordinate_systems_test {
namespace {

using ::testing::HasSubstr;
using tests::TemporaryFiles;

std::string zone_text(const std::optional<UtmZone>& zone) { return zone ? text_of(*zone) : "none"; }

TEST(CoordinateSystems, CodesOfUtmOnModernDatumsAreKnown) {
  for (const auto& [code, zone] : {std::pair{2959u, "18N"},                                   // NAD83(CSRS)
                                   {3156u, "9N"},           {22710u, "10N"}, {3717u, "10N"},  // NAD83(NSRS2007)
                                   {3740u, "10N"},                                            // NAD83(HARN)
                                   {3750u, "4N"},           {6339u, "10N"},                   // NAD83(2011)
                                   {3372u, "59N"},          {3044u, "32N"},                   // ETRS89, north before east
                                   {3045u, "33N"},          {3006u, "33N"},                   // SWEREF99 TM
                                   {3067u, "35N"},          {4647u, "32N"},                   // eastings that begin with the zone
                                   {5650u, "33N"},          {3100u, "54N"},                   // JGD2000
                                   {6691u, "54N"},                                            // JGD2011
                                   {6210u, "23N"},                                            // SIRGAS 2000
                                   {5396u, "26S"},          {31985u, "25S"}, {7846u, "46S"}, {2134u, "59S"}, {9391u, "35N"}})
    EXPECT_EQ(zone_text(utm_of_epsg(code)), zone) << code;
  for (const std::uint32_t other : {7804u, 2100u, 3405u, 3395u, 27700u, 23033u, 65535u})
    EXPECT_FALSE(utm_of_epsg(other)) << other;
  for (const std::uint32_t modern : {4326u, 4979u, 4258u, 4269u, 4617u, 4152u, 4759u, 6318u, 4283u, 7844u, 4612u, 6668u, 4674u})
    EXPECT_TRUE(agrees_with_wgs84(modern)) << modern;
  for (const std::uint32_t old : {4267u, 4230u, 4314u, 4301u, 4322u, 0u}) EXPECT_FALSE(agrees_with_wgs84(old)) << old;
}

constexpr const char* transverse =
    "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000.0],PARAMETER[\"False_Northing\",10000000.0],"
    "PARAMETER[\"Central_Meridian\",15.0],PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0.0],";

std::string wkt(const std::string& name, const std::string& ellipsoid, const std::string& projection) {
  return "PROJCS[\"" + name + "\",GEOGCS[\"g\",DATUM[\"d\",SPHEROID[" + ellipsoid + "]],UNIT[\"Degree\",0.0174532925199433]]," +
         projection + "UNIT[\"Meter\",1.0]]";
}
const std::string grs80 = "\"GRS_1980\",6378137.0,298.257222101", bessel = "\"Bessel\",6377397.155,299.1528128";

TEST(CoordinateSystems, WktIsUtmByItsParametersWhateverItsName) {
  EXPECT_EQ(zone_text(system_of_wkt(wkt("mine", grs80, transverse)).utm), "33S");
  EXPECT_EQ(zone_text(system_of_wkt("PROJCRS[\"mine\",BASEGEOGCRS[\"g\",DATUM[\"d\",ELLIPSOID[\"WGS 84\",6378137,298.257223563,"
                                    "LENGTHUNIT[\"metre\",1]]]],CONVERSION[\"c\",METHOD[\"Transverse Mercator\"],"
                                    "PARAMETER[\"Latitude of natural origin\",0],PARAMETER[\"Longitude of natural origin\",-123],"
                                    "PARAMETER[\"Scale factor at natural origin\",0.9996],PARAMETER[\"False easting\",500000],"
                                    "PARAMETER[\"False northing\",0]],LENGTHUNIT[\"metre\",1]]")
                          .utm),
            "10N");
  const auto old = system_of_wkt(wkt("MGI / old", bessel, transverse));
  EXPECT_EQ(zone_text(old.utm), "none");
  EXPECT_EQ(old.name, "MGI / old");
  std::string other(transverse);
  other.replace(other.find("0.9996"), 6, "0.9999");
  EXPECT_EQ(zone_text(system_of_wkt(wkt("mine", grs80, other)).utm), "none");
  EXPECT_EQ(system_of_wkt("LOCAL_CS[\"pier\",UNIT[\"metre\",1]]").name, "");
  const auto degrees = system_of_wkt("GEOGCS[\"DHDN\",DATUM[\"d\",SPHEROID[" + bessel + "]],UNIT[\"Degree\",0.017]]");
  EXPECT_TRUE(degrees.other_datum);
  EXPECT_EQ(degrees.name, "DHDN");
  EXPECT_FALSE(system_of_wkt("GEOGCS[\"WGS 84\",DATUM[\"d\",SPHEROID[" + grs80 + "]]]").other_datum);
  EXPECT_FALSE(system_of_wkt("GEOGCS[\"WGS 84\"]").other_datum) << "without an ellipsoid";
}

TEST(CoordinateSystems, PrjFilesOfSeveralWritersAreRead) {
  const auto of = [](std::string_view wkt) {
    const CoordinateSystem s = system_of_wkt(wkt);
    return text::format("%s %.4f %.4f%s",
                        !s.geographic   ? "?"
                        : *s.geographic ? "degrees"
                                        : "lengths",
                        s.unit_m, s.height_unit_m, s.web_mercator ? " Mercator" : "");
  };
  const std::string datum = "DATUM[\"D\",SPHEROID[\"S\",6378137,298.25]]", degrees = "UNIT[\"Degree\",0.0174532925]";
  EXPECT_EQ(of("GEOGCS[\"G\"," + datum + "," + degrees + "]"), "degrees 1.0000 1.0000");
  EXPECT_EQ(of("PROJCS[\"P\",GEOGCS[\"G\"," + datum + "," + degrees + "],PARAMETER[\"F\",0],UNIT[\"Foot_US\",0.3048006096]]"),
            "lengths 0.3048 1.0000");
  EXPECT_EQ(
      of("COMPD_CS[\"C\",PROJCS[\"P\",GEOGCS[\"G\"," + degrees + "],UNIT[\"metre\",1]],VERT_CS[\"V\",UNIT[\"foot\",0.3048]]]"),
      "lengths 1.0000 0.3048");
  EXPECT_EQ(of("COMPOUNDCRS[\"C\",\n  GEOGCRS[\"G\",CS[ellipsoidal,2],AXIS[\"lat\",north]],VERTCRS[\"V\",CS[vertical,1],"
               "AXIS[\"H\",up,LENGTHUNIT[\"foot\",0.3048]]]]"),
            "degrees 1.0000 0.3048");
  EXPECT_EQ(of("PROJCRS[\"P\",BASEGEOGCRS[\"G\"],CONVERSION[\"c\",PARAMETER[\"F\",0,LENGTHUNIT[\"metre\",1]]],CS[Cartesian,2],"
               "AXIS[\"X\",east],AXIS[\"Y\",north],LENGTHUNIT[\"kilometre\",1000]]"),
            "lengths 1000.0000 1.0000");
  EXPECT_EQ(of("PROJCS[\"WGS_1984_Web_Mercator_Auxiliary_Sphere\",GEOGCS[\"G\"],UNIT[\"Meter\",1.0]]"),
            "lengths 1.0000 1.0000 Mercator");
  EXPECT_EQ(of("PROJCS[\"P\",UNIT[\"none\",0]]"), "lengths 1.0000 1.0000");
  EXPECT_EQ(of(std::string(100, '[') + "UNIT[\"x"), "? 1.0000 1.0000");
  EXPECT_EQ(of("]]],,\""), "? 1.0000 1.0000");
}

TEST(CoordinateSystems, LongitudesOfWktMayBeginElsewhereAndAnglesBeGrads) {
  const std::string begin = "GEOGCS[\"g\",DATUM[\"d\",SPHEROID[" + grs80 + "]],";
  const auto paris = system_of_wkt(begin + "PRIMEM[\"Paris\",2.337229166666667],UNIT[\"Grad\",0.01570796326794897]]");
  EXPECT_NEAR(paris.prime_meridian_deg, 2.337229, 1e-6);
  EXPECT_NEAR(paris.unit_deg, 0.9, 1e-9);
  const auto newer = system_of_wkt(
      "GEOGCRS[\"NTF (Paris)\",DATUM[\"d\",ELLIPSOID[\"c\",6378249.2,293.4660212936269,LENGTHUNIT[\"metre\",1]]],"
      "PRIMEM[\"Paris\",2.5969213,ANGLEUNIT[\"grad\",0.015707963267949]],CS[ellipsoidal,2],"
      "AXIS[\"latitude\",north,ORDER[1],ANGLEUNIT[\"grad\",0.015707963267949]],"
      "AXIS[\"longitude\",east,ORDER[2],ANGLEUNIT[\"grad\",0.015707963267949]]]");
  EXPECT_NEAR(newer.prime_meridian_deg, 2.337229, 1e-6);
  EXPECT_NEAR(newer.unit_deg, 0.9, 1e-9);
  const auto usual = system_of_wkt(begin + "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]");
  EXPECT_EQ(usual.prime_meridian_deg, 0);
  EXPECT_EQ(usual.unit_deg, 1);
  std::string with = wkt("mine", grs80, transverse);
  with.insert(with.find(",UNIT"), ",PRIMEM[\"Paris\",2.337229166666667]");
  EXPECT_EQ(zone_text(system_of_wkt(with).utm), "none");
}

TEST(CoordinateSystems, AnAxisOfHeightsChangesNoUnitOfCoordinates) {
  const std::string ellipsoid = "ELLIPSOID[\"WGS 84\",6378137,298.257223563,LENGTHUNIT[\"metre\",1]]";
  const auto geographic = [&](const std::string& cs) {
    return system_of_wkt("GEOGCRS[\"WGS 84\",DATUM[\"World Geodetic System 1984\"," + ellipsoid +
                         "],PRIMEM[\"Greenwich\",0,ANGLEUNIT[\"degree\",0.0174532925199433]]," + cs + "]");
  };
  const auto axes = [](const std::string& unit) {
    return "AXIS[\"geodetic latitude (Lat)\",north,ORDER[1]," + unit + "],AXIS[\"geodetic longitude (Lon)\",east,ORDER[2]," +
           unit + "]";
  };
  const std::string degree = "ANGLEUNIT[\"degree\",0.0174532925199433]", grad = "ANGLEUNIT[\"grad\",0.015707963267949]";
  const auto height = [](const std::string& direction, const std::string& unit) {
    return ",AXIS[\"ellipsoidal height (h)\"," + direction + ",ORDER[3]," + unit + "]";
  };
  struct Case {
    CoordinateSystem is;
    bool geographic;
    double unit_deg, unit_m, height_unit_m;
  };
  const std::string metre = "LENGTHUNIT[\"metre\",1]", foot = "LENGTHUNIT[\"foot\",0.3048]";
  const std::string map_axes = "PROJCRS[\"p\",BASEGEOGCRS[\"g\",DATUM[\"d\"," + ellipsoid +
                               "]],CS[Cartesian,3],AXIS[\"(E)\",east,ORDER[1]," + metre + "],AXIS[\"(N)\",north,ORDER[2]," +
                               metre + "]";
  const std::string old =
      "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
      "UNIT[\"degree\",0.0174532925199433]]";
  const std::string old_heights =
      "VERT_CS[\"h\",VERT_DATUM[\"d\",2005],UNIT[\"foot\",0.3048],AXIS[\"Gravity-related height\",UP]]";
  const std::string esri_heights =
      "VERTCS[\"h\",VDATUM[\"d\"],PARAMETER[\"Vertical_Shift\",0.0],PARAMETER[\"Direction\",1.0],"
      "UNIT[\"Foot\",0.3048]]";
  const std::vector<Case> cases{
      {geographic("CS[ellipsoidal,3]," + axes(degree) + height("up", metre) + ",ID[\"EPSG\",4979]"), true, 1, 1, 1},
      {geographic("CS[ellipsoidal,2]," + axes(degree) + ",ID[\"EPSG\",4326]"), true, 1, 1, 1},
      {geographic("CS[ellipsoidal,3]," + axes(grad) + height("up", foot)), true, 0.9, 1, 0.3048},
      {geographic("CS[ellipsoidal,3]," + axes(grad) + height("down", "UNIT[\"metre\",1]")), true, 0.9, 1, 1},
      {geographic("CS[ellipsoidal,2],AXIS[\"latitude\",north],AXIS[\"longitude\",east]," + grad + "," + metre), true, 0.9, 1, 1},
      {system_of_wkt(map_axes + height("up", foot) + "]"), false, 1, 1, 0.3048},
      {system_of_wkt("COMPD_CS[\"c\"," + old + "," + old_heights + "]"), true, 1, 1, 0.3048},
      {system_of_wkt(old + "," + esri_heights), true, 1, 1, 0.3048},
      {system_of_wkt("COMPOUNDCRS[\"c\"," + map_axes + "],VERTCRS[\"h\",VDATUM[\"d\"],CS[vertical,1],AXIS[\"height (H)\",up," +
                     foot + "]]]"),
       false, 1, 1, 0.3048},
  };
  for (std::size_t k = 0; k < cases.size(); ++k) {
    EXPECT_EQ(cases[k].is.geographic, cases[k].geographic) << k;
    EXPECT_NEAR(cases[k].is.unit_deg, cases[k].unit_deg, 1e-9) << k;
    EXPECT_EQ(cases[k].is.unit_m, cases[k].unit_m) << k;
    EXPECT_EQ(cases[k].is.height_unit_m, cases[k].height_unit_m) << k;
  }
}

/// Keys with their own values, with numbers, and one with a text.
GeoKeys keys(const std::vector<std::array<std::uint16_t, 2>>& values,
             const std::vector<std::pair<std::uint16_t, double>>& numbers = {}, const std::string& citation = "") {
  std::vector<std::uint16_t> words{1, 1, 0, 0};
  std::vector<double> all;
  for (const auto& [key, value] : values) words.insert(words.end(), {key, 0, 1, value});
  for (const auto& [key, value] : numbers) {
    words.insert(words.end(), {key, 34736, 1, static_cast<std::uint16_t>(all.size())});
    all.push_back(value);
  }
  if (!citation.empty()) words.insert(words.end(), {3073, 34737, static_cast<std::uint16_t>(citation.size() + 1), 0});
  return {words, all, citation + "|more"};
}

TEST(CoordinateSystems, GeoKeysOfOnesOwnAreUtmByProjectionOrParameters) {
  const auto of = [](const GeoKeys& k) { return system_of_keys(k, std::nullopt).value(); };
  EXPECT_EQ(zone_text(of(keys({{{1024, 1}, {2048, 4258}, {3072, 32767}, {3074, 16033}}})).utm), "33N");
  EXPECT_EQ(zone_text(of(keys({{{1024, 1}, {2056, 7019}, {3072, 32767}, {3074, 16133}}})).utm), "33S");
  EXPECT_EQ(zone_text(of(keys({{{1024, 1}, {2048, 4314}, {3072, 32767}, {3074, 16033}}})).utm), "none") << "DHDN";
  const std::vector<std::pair<std::uint16_t, double>> by{
      {2057, 6378137}, {2059, 298.257222101}, {3080, 15}, {3081, 0}, {3082, 500000}, {3083, 0}, {3092, 0.9996}};
  EXPECT_EQ(zone_text(of(keys({{{1024, 1}, {3072, 32767}, {3075, 1}}}, by)).utm), "33N");
  EXPECT_EQ(zone_text(of(keys({{{1024, 1}, {3072, 32767}, {3075, 1}, {3076, 9002}}}, by)).utm), "none") << "feet";
  const auto equal_area = of(keys({{{1024, 1}, {3072, 32767}, {3075, 10}}}, by, "my own"));
  EXPECT_EQ(zone_text(equal_area.utm), "none");
  EXPECT_EQ(equal_area.name, "my own");
  EXPECT_EQ(of(keys({{{1024, 1}, {3072, 27700}}})).name, "EPSG:27700");
  EXPECT_EQ(of(keys({{{1024, 1}}})).name, "") << "plain metres";
  EXPECT_TRUE(of(keys({{{1024, 2}, {2048, 4267}}})).other_datum);
  EXPECT_FALSE(of(keys({{{1024, 2}, {2048, 4326}}})).other_datum);
  EXPECT_FALSE(of(keys({{{1024, 2}}})).other_datum);
  EXPECT_THAT(system_of_keys(keys({{{1024, 3}}}), std::nullopt).error().text, HasSubstr("geocentric"));
  for (std::uint16_t at = 0; at < 8; ++at)  // positions outside the numbers and texts
    (void)of(GeoKeys({1, 1, 0, 1, 3073, 34737, 60000, at, 2057, 34736, 1, at}, {}, "x"));
}

TEST(CoordinateSystems, LongitudesOfGeoKeysMayBeginElsewhere) {
  const auto of = [](const GeoKeys& k) { return system_of_keys(k, std::nullopt); };
  EXPECT_NEAR(of(keys({{{1024, 2}, {2048, 4806}}}))->prime_meridian_deg, 12.452333, 1e-6) << "Monte Mario (Rome)";
  EXPECT_NEAR(of(keys({{{1024, 2}, {2048, 32767}, {2051, 8903}}}))->prime_meridian_deg, 2.337229, 1e-6);
  const auto grads = of(keys({{{1024, 2}, {2048, 32767}, {2054, 9105}}}, {{2061, 2.5969213}}));
  EXPECT_NEAR(grads->prime_meridian_deg, 2.337229, 1e-6);
  EXPECT_NEAR(grads->unit_deg, 0.9, 1e-12);
  EXPECT_EQ(of(keys({{{1024, 2}, {2048, 4326}, {2051, 8901}}}))->prime_meridian_deg, 0);
  EXPECT_THAT(of(keys({{{1024, 2}, {2048, 32767}, {2051, 8999}}})).error().text,
              HasSubstr("from an unknown meridian; convert it: gdalwarp"));
  EXPECT_THAT(of(keys({{{1024, 2}, {2054, 9110}}})).error().text, HasSubstr("angles in an unknown unit"));
}

TEST(CoordinateSystems, DegreesOfAGridBecomeThoseFromGreenwich) {
  TemporaryFiles files;
  files.write("g.prj",
              "GEOGCS[\"GCS_NTF_Paris\",DATUM[\"D_NTF\",SPHEROID[\"Clarke_1880_IGN\",6378249.2,293.46602]],"
              "PRIMEM[\"Paris\",2.337229166666667],UNIT[\"Grad\",0.01570796326794897]]");
  const auto grid =
      read_esri_heights(files.write("g.asc", "ncols 2\nnrows 2\nxllcenter -8\nyllcenter 53\ncellsize 0.001\n-1 -2 -3 -4\n"), {});
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_NEAR(grid->x[0], -8 * 0.9 + 2.337229, 1e-6);
  EXPECT_NEAR(grid->y[0], 53 * 0.9, 1e-9);
  EXPECT_THAT(grid->notes[0], HasSubstr("in units of 0.9 degrees, become degrees"));
  EXPECT_THAT(grid->notes[1], HasSubstr("begin 2.337229 degrees east of Greenwich"));
}

struct UnknownSystem : ::testing::Test {
  TemporaryFiles files;
  std::string said(const std::string& prj, const HeightOptions& options, const std::string& x = "400000") {
    files.write("g.prj", prj);
    const auto grid = read_esri_heights(
        files.write("g.asc", "ncols 2\nnrows 2\nxllcorner " + x + "\nyllcorner 6650000\ncellsize 10\n-1 -2 -3 -4\n"), options);
    std::string all;
    if (!grid) return grid.error().text;
    for (const std::string& note : grid->notes) all += note + ". ";
    return all;
  }
};

TEST_F(UnknownSystem, TheErrorNamesTheCommandThatConverts) {
  const std::string prj = wkt("British_National_Grid", bessel, transverse);
  EXPECT_THAT(said(prj, {}), HasSubstr("of British_National_Grid, are read as plain metres"));
  EXPECT_THAT(said(prj, {}), HasSubstr("gdalwarp -t_srs EPSG:4326"));
  EXPECT_EQ(said(prj, {.geographic = false}), "");
  EXPECT_THAT(said(prj, {.origin = Geodetic{1, 0, 0}}), HasSubstr("this is in British_National_Grid; convert it to degrees"));
  EXPECT_THAT(said(wkt("a\x1b[31m", bessel, transverse), {}), HasSubstr("a\\x1b[31m"));
}

TEST_F(UnknownSystem, EastingsMayBeginWithTheirZone) {
  const HeightOptions options{.utm = UtmZone{32, false}, .origin = Geodetic{rad_from_deg(60), rad_from_deg(7.2), 0}};
  EXPECT_THAT(said("", options, "32400000"), HasSubstr("begin with 32, the number of their zone"));
  EXPECT_EQ(said("", options), "");
  EXPECT_THAT(said("", options, "33400000"), HasSubstr("not eastings and northings of UTM"));
}

TEST(UnnamedSystem, ANoteNamesMetresThatCouldBeDegrees) {
  TemporaryFiles files;
  const auto notes = [&](const std::string& corner, const std::string& cell, const HeightOptions& options = {},
                         const std::string& heights = "-30 -30.1 -30.2 -30.1\n-30 -30.1 -30 -30\n") {
    const std::string header = "# made by hand\nncols 4\nnrows 2\n" + corner + "\ncellsize " + cell + "\n# heights\n";
    const auto grid = read_esri_heights(files.write("g.asc", header + heights), options);
    if (!grid) return grid.error().text;
    return grid->notes.empty() ? std::string() : grid->notes.back();
  };
  EXPECT_THAT(notes("xllcorner 4\nyllcorner 52", "0.25"),
              HasSubstr("are read as metres; write geographic: true if they are degrees"));
  EXPECT_THAT(notes("xllcorner -180\nyllcorner -60", "90"), HasSubstr("are read as metres"));
  EXPECT_EQ(notes("xllcorner 4\nyllcorner 52", "0.25", {.geographic = false}), "");
  const std::string pool = "-1 -1 -1 -0.9\n-1 -1 -1 -0.9\n", at_0 = "xllcorner 0\nyllcorner 0";
  EXPECT_EQ(notes(at_0, "0.25", {}, pool), "");
  EXPECT_EQ(notes("xllcorner -0.5\nyllcorner -0.25", "0.25", {}, pool), "") << "about its middle";
  EXPECT_THAT(notes(at_0, "0.25"), HasSubstr("are read as metres")) << "1 m wide and 30 m deep";
  EXPECT_EQ(notes(at_0, "0.25", {.z_scale = 0.001}), "") << "1 m wide and 30 mm deep";
  EXPECT_THAT(notes("xllcorner 4\nyllcorner 52", "0.25", {.centred = true}), HasSubstr("are read as metres"));
  EXPECT_EQ(notes("xllcorner 400\nyllcorner 52", "0.25"), "");
  std::string meridian = "ncols 2\nnrows 180\nxllcorner 0\nyllcorner -90\ncellsize 1\n";
  for (int i = 0; i < 360; ++i) meridian += "-1 ";
  const auto grid = read_esri_heights(files.write("m.asc", meridian), {});
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_THAT(grid->notes, ::testing::ElementsAre(HasSubstr("are read as metres"))) << "from pole to pole";
  files.write("g.prj", "PROJCS[\"mine\"]");
  EXPECT_EQ(notes("xllcorner 4\nyllcorner 52", "0.25").find("read as metres;"), std::string::npos);
}

TEST(UnnamedSystem, CoarseCellsAreDegreesIfMostStepsAreSteep) {
  TemporaryFiles files;
  const auto said = [&](const std::string& rows, const std::string& cell = "0.25", const HeightOptions& options = {}) {
    const std::string header = "ncols 4\nnrows 3\nxllcorner 4\nyllcorner 52\ncellsize " + cell + "\n";
    const auto grid = read_esri_heights(files.write("g.asc", header + rows), options);
    return !grid ? grid.error().text : grid->origin ? "degrees" : "metres";
  };
  const std::string steep = "-10 -40 -25 -60\n-12 -55 -40 -90\n-30 -35 -70 -20";
  EXPECT_EQ(said(steep), "degrees");
  EXPECT_EQ(said(steep, "1"), "degrees");
  EXPECT_EQ(said(steep, "10"), "metres");
  EXPECT_EQ(said(steep, "0.25", {.z_scale = 0.001}), "metres") << "heights in millimetres";
  EXPECT_THAT(said("-1000 -4000 -2500 -6000\n-1200 -5500 -4000 -900\n-3000 -3500 -7000 -2000", "9"),
              HasSubstr("at most 5: cut a part out (gdal_translate -projwin WEST NORTH EAST SOUTH IN OUT.tif), or set origin; "
                        "write geographic: false "
                        "if its coordinates are metres"));
  EXPECT_EQ(said("-10 -10.2 -500 -10.1\n-10 -10.2 -10.3 -10.1\n-10 -10.2 -10.3 -10.1"), "metres") << "one false height";
}

}  // namespace
}  // namespace sonar::coordinate_systems_test
