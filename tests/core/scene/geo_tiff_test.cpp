// Height grids as GeoTIFF, written here field by field: positions, units, types of numbers, and invalid files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/scene/shapes/terrain.hpp"
#include "tests/core/scene/temporary_files.hpp"
#include "tests/core/scene/tiff_file.hpp"
#include "tests/is_sanitized.hpp"

namespace sonar::geo_tiff_test {
namespace {

using ::testing::HasSubstr;
using tests::TemporaryFiles;
using tests::TiffFile;

struct GeoTiff : ::testing::Test {
  TemporaryFiles files;
  Result<HeightGrid> read(const TiffFile& tiff, const HeightOptions& options = {}) {
    return read_geo_tiff_heights(files.write("g.tif", tiff.bytes()), options);
  }
  void SetUp() override {
    const auto grid = read_geo_tiff_heights(files.write("g.tif", "?"), {});
    if (grid.error().kind != ErrorKind::unavailable) return;
    EXPECT_THAT(grid.error().text, HasSubstr("gdal_translate -of AAIGrid g.tif g.asc"));
    GTEST_SKIP() << "built without libtiff";
  }
};
const std::vector<float> six{-1, -2, -3, -4, -9999, -6};

TEST_F(GeoTiff, MetresAreReadByCornerAndByPoint) {
  TiffFile area = TiffFile::of(3, 2, six).at(500000, 6600020, 10, 5).keys({{{1024, 1}, {1025, 1}}});
  area.text(42113, "-9999");
  const auto grid = read(area);
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_EQ(grid->x, (std::vector<double>{500005, 500015, 500025}));
  EXPECT_EQ(grid->y, (std::vector<double>{6600012.5, 6600017.5}));
  EXPECT_FLOAT_EQ(grid->z_m[3], -1);  // the first row is north
  EXPECT_TRUE(std::isnan(grid->z_m[1]));
  EXPECT_THAT(grid->notes, ::testing::ElementsAre(HasSubstr("1 of its 6 heights")));
  const auto points = read(TiffFile::of(3, 2, six).at(500000, 6600020, 10, 5).keys({{{1024, 1}, {1025, 2}}}));
  ASSERT_TRUE(points);
  EXPECT_EQ(points->x.front(), 500000);
  EXPECT_EQ(points->y.back(), 6600020);
  const auto feet =
      read(TiffFile::of(3, 2, six).at(1000, 2000, 10, 10).keys({{{1024, 1}, {1025, 2}, {3076, 9002}, {4099, 9002}}}));
  ASSERT_TRUE(feet) << feet.error().text;
  EXPECT_NEAR(feet->x.back(), 1020 * 0.3048, 1e-9);
  EXPECT_NEAR(feet->z_m[3], -0.3048, 1e-6);
}

TEST_F(GeoTiff, HeightsInFeetBecomeMetres) {
  const auto first = [&](TiffFile tiff) {
    const auto grid = read(tiff.without(42113));
    return grid ? static_cast<double>(grid->z_m[3]) : -9;
  };
  const auto good = [] { return TiffFile::of(3, 2, std::vector<float>{-1, -2, -3, -4, -5, -6}).at(0, 100, 10, 10); };
  EXPECT_NEAR(first(good().keys({{{1024, 1}, {4096, 5703}}})), -1, 1e-6);  // NAVD88, in metres
  EXPECT_NEAR(first(good().keys({{{1024, 1}, {4096, 6360}}})), -0.3048006, 1e-6);
  EXPECT_NEAR(first(good().keys({{{1024, 1}, {4096, 8228}}})), -0.3048, 1e-6);
  EXPECT_NEAR(first(good().keys({{{1024, 1}, {4096, 6360}, {4099, 9001}}})), -1, 1e-6);
  const auto unit = [&](const std::string& word) {
    TiffFile tiff = good();
    tiff.text(42112, R"(<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">)" + word + "</Item></GDALMetadata>");
    const auto grid = read(tiff);
    if (grid && word == "cubits") {
      EXPECT_THAT(grid->notes, ::testing::Contains(HasSubstr("cubits, is not known")));
    }
    return first(tiff);
  };
  EXPECT_NEAR(unit("ft"), -0.3048, 1e-6);
  EXPECT_NEAR(unit("US survey foot"), -0.3048006, 1e-6);
  EXPECT_NEAR(unit("metre"), -1, 1e-6);
  EXPECT_NEAR(unit("Metres"), -1, 1e-6);
  EXPECT_NEAR(unit("cm"), -0.01, 1e-6);
  EXPECT_NEAR(unit("millimetre"), -0.001, 1e-6);
  EXPECT_NEAR(unit("fathoms"), -1.8288, 1e-6);
  EXPECT_NEAR(unit("cubits"), -1, 1e-6);
  TiffFile in_feet = good().keys({{{1024, 1}, {4099, 9002}}});
  in_feet.text(42112, R"(<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">cubits</Item></GDALMetadata>)");
  EXPECT_NEAR(first(in_feet), -0.3048, 1e-6);
  EXPECT_THAT(read(in_feet)->notes,
              ::testing::Contains(HasSubstr("cubits, is not known: that of its coordinate system is used")));
  const auto lengths = read(good().keys({{{1024, 1}, {3076, 9003}}}));
  ASSERT_TRUE(lengths);
  EXPECT_NEAR(lengths->z_m[3], -1, 1e-6);
  EXPECT_THAT(lengths->notes, ::testing::ElementsAre(HasSubstr("set z_scale: 0.304801 if they are")));
}

TEST_F(GeoTiff, StoredValuesAreScaledByTheFilesOwnNumbers) {
  TiffFile tiff = TiffFile::of(3, 2, std::vector<std::int16_t>{900, 800, 700, 600, -32768, -1}).at(0, 100, 10, 10);
  tiff.text(42113, "-1");
  tiff.text(42112,
            "<GDALMetadata>\n  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">-100</Item>\n"
            "  <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.1</Item>\n"
            "  <Item name=\"SCALE\" sample=\"1\" role=\"scale\">7</Item>\n</GDALMetadata>");
  const auto grid = read(tiff);
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_FLOAT_EQ(grid->z_m[3], -10);
  EXPECT_FLOAT_EQ(grid->z_m[0], -40);
  EXPECT_TRUE(std::isnan(grid->z_m[1])) << "a fill value is a stored one";
  EXPECT_TRUE(std::isnan(grid->z_m[2]));
  EXPECT_THAT(grid->notes, ::testing::Contains(HasSubstr("0.1 times the stored values, plus -100")));
}

TEST_F(GeoTiff, ASystemOfDepthsIsNoted) {
  const auto notes = [&](double sign, std::uint16_t system, double z_scale = 1) {
    std::vector<float> heights;
    for (const float z : {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f}) heights.push_back(static_cast<float>(sign) * z);
    const auto grid =
        read(TiffFile::of(3, 2, heights).at(0, 100, 10, 10).keys({{{1024, 1}, {4096, system}}}), {.z_scale = z_scale});
    return grid ? grid->notes : std::vector<std::string>{grid.error().text};
  };
  for (const std::uint16_t system : {std::uint16_t{5715}, std::uint16_t{5831}, std::uint16_t{5861}, std::uint16_t{9672}}) {
    EXPECT_THAT(notes(1, system),
                ::testing::ElementsAre(HasSubstr(std::to_string(system) + ", counts depths downwards: set z_scale: -1")));
    EXPECT_THAT(notes(-1, system), ::testing::ElementsAre(HasSubstr("but its values are negative")));
    EXPECT_THAT(notes(1, system, -1), ::testing::IsEmpty());
  }
  EXPECT_THAT(notes(1, 5714), ::testing::IsEmpty());  // heights above mean sea level
}

/// Returns a stream of zlib with one block that is not compressed.
std::string zlib_of(const std::string& data) {
  std::uint32_t a = 1, b = 0;
  for (const char c : data) a = (a + static_cast<unsigned char>(c)) % 65521, b = (b + a) % 65521;
  const auto size = static_cast<std::uint16_t>(data.size()), not_size = static_cast<std::uint16_t>(~data.size());
  std::string sum{static_cast<char>(b >> 8), static_cast<char>(b), static_cast<char>(a >> 8), static_cast<char>(a)};
  return "\x78\x01\x01" + TiffFile::bytes_of(std::vector{size, not_size}) + data + sum;
}

TEST_F(GeoTiff, TheFloatingPointPredictorIsReadInBothByteOrders) {
  const std::vector<float> heights{-1, -2.5f, -3, -1000.25f, -5, -6};
  std::string predicted;
  for (std::size_t row = 0; row < 2; ++row) {
    std::string planes;  // all first bytes of a row, then all second ones; the first have the sign and the exponent
    for (std::size_t k = 4; k-- > 0;)
      for (std::size_t i = 0; i < 3; ++i) planes += TiffFile::bytes_of(heights)[4 * (3 * row + i) + k];
    for (std::size_t i = planes.size(); i-- > 1;) planes[i] = static_cast<char>(planes[i] - planes[i - 1]);
    predicted += planes;
  }
  TiffFile tiff = TiffFile::of(3, 2, heights).at(0, 100, 10, 10).without(259).without(279);
  tiff.heights = zlib_of(predicted);
  tiff.shorts(259, {8}), tiff.shorts(317, {3}), tiff.longs(279, {static_cast<std::uint32_t>(tiff.heights.size())});
  for (const bool big : {false, true}) {
    const auto grid = read_geo_tiff_heights(files.write("g.tif", tiff.bytes(big)), {});
    ASSERT_TRUE(grid) << big << grid.error().text;
    EXPECT_EQ(grid->z_m, (std::vector<float>{-1000.25f, -5, -6, -1, -2.5f, -3})) << big;
  }
}

TEST_F(GeoTiff, PackedRunsMayCrossTheEndsOfRows) {
  TiffFile tiff = TiffFile::of(3, 2, std::vector<std::uint8_t>{1, 2, 2, 2, 2, 3}).at(0, 100, 10, 10).without(259).without(279);
  tiff.heights = {0, 1, -3, 2, 0, 3};  // one byte, four equal ones, one byte
  tiff.shorts(259, {32773}), tiff.longs(279, {static_cast<std::uint32_t>(tiff.heights.size())});
  const auto grid = read(tiff);
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_EQ(grid->z_m, (std::vector<float>{2, 2, 3, 1, 2, 2}));
  tiff.heights.resize(4);
  tiff.without(279).longs(279, {4});
  EXPECT_FALSE(read(tiff)) << "two cells are missing";
}

TEST_F(GeoTiff, WebMercatorHasItsLengthsOnTheGround) {
  const std::vector<float> whole(6, -5);
  // Cells of 100 "m" at 60 degrees north are 50 m wide.
  const double north = 6378137 * std::log(std::tan(0.25 * pi + 0.5 * rad_from_deg(60.0)));
  const auto grid =
      read(TiffFile::of(3, 2, whole).at(0, north, 100, 100).keys({{{1024, 1}, {1025, 2}, {3072, 3857}, {3076, 9001}}}));
  ASSERT_TRUE(grid) << grid.error().text;
  ASSERT_TRUE(grid->origin);
  EXPECT_NEAR(grid->y.back(), 60, 1e-9);
  const auto mesh = mesh_from_grid(*grid);
  ASSERT_TRUE(mesh);
  const auto& v = mesh->mesh.vertices;
  EXPECT_NEAR(v[1].x - v[0].x, 50, 0.2);
  EXPECT_NEAR(v[3].y - v[0].y, 50, 0.2);
  const auto as_metres =
      read(TiffFile::of(3, 2, whole).at(0, north, 100, 100).keys({{{1024, 1}, {3072, 3857}}}), {.geographic = false});
  ASSERT_TRUE(as_metres);
  EXPECT_NEAR(as_metres->x[1] - as_metres->x[0], 100, 1e-9);
}

TEST_F(GeoTiff, BlocksThatAreLeftOutAreHoles) {
  TiffFile sparse = TiffFile::of(3, 2, six).at(0, 100, 10, 10).without(273).without(278).without(279);
  sparse.shorts(278, {1}), sparse.longs(273, {8, 0}), sparse.longs(279, {12, 0});  // one strip per row, the second without bytes
  sparse.fields[1].value = TiffFile::bytes_of(std::vector<std::uint16_t>{2});
  const auto grid = read(sparse);
  EXPECT_FALSE(grid && mesh_from_grid(*grid));
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_FLOAT_EQ(grid->z_m[3], -1);
  EXPECT_TRUE(std::isnan(grid->z_m[0]));
}

TEST_F(GeoTiff, CellsThatAMaskHidesAreHoles) {
  const auto masked = [&](std::uint16_t bits, const std::vector<std::uint8_t>& cells, std::uint16_t columns = 3,
                          std::uint32_t kind = 4) {
    TiffFile mask = TiffFile::of(columns, 2, cells).without(262).without(258);
    mask.longs(254, {kind}), mask.shorts(262, {4}), mask.shorts(258, {bits});
    return read_geo_tiff_heights(files.write("g.tif", TiffFile::of(3, 2, six).at(0, 100, 10, 10).bytes_before(mask)), {});
  };
  const auto holes = [](const Result<HeightGrid>& grid) {
    std::string all;
    for (std::size_t k = 0; grid && k < 6; ++k) all += std::isnan(grid->z_m[k]) ? 'o' : 'x';
    return grid ? all : grid.error().text;
  };
  // The file begins in the north, but the grid in the south.
  EXPECT_EQ(holes(masked(1, {0b10100000, 0b10000000})), "xooxox");
  EXPECT_EQ(holes(masked(8, {255, 255, 255, 255, 0, 255})), "xoxxxx");
  EXPECT_FLOAT_EQ(masked(8, {255, 255, 255, 255, 0, 255})->z_m[3], -1);
  EXPECT_EQ(holes(masked(8, {0, 0, 0, 0, 0, 0}, 3, 5)), "xoxxxx")
      << "a mask of a reduced picture is ignored; -9999 is far from all heights";
  EXPECT_THAT(masked(8, {255, 255, 255, 255}, 2).error().text, HasSubstr("a mask of another size or kind"));
  EXPECT_THAT(masked(4, {255, 255, 255, 255, 255, 255}).error().text, HasSubstr("gdalwarp -dstnodata"));
  files.write("g.tif.msk", "?");
  EXPECT_THAT(read(TiffFile::of(3, 2, six).at(0, 100, 10, 10)).error().text, HasSubstr("in a file beside it (.msk)"));
}

TEST_F(GeoTiff, FloatingPointNumbersOf16BitsAreRead) {
  const std::vector<std::uint16_t> halves{0x0000, 0xBC00, 0xD640, 0x3555, 0x8001, 0x7E00};
  const auto grid = read(TiffFile::of(3, 2, halves).at(0, 100, 10, 10).without(339).shorts(339, {3}));
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_EQ(grid->z_m[3], 0);
  EXPECT_EQ(grid->z_m[4], -1);
  EXPECT_EQ(grid->z_m[5], -100);
  EXPECT_NEAR(grid->z_m[0], 0.33325195, 1e-8);
  EXPECT_NEAR(grid->z_m[1], -5.9604645e-8, 1e-14);
  EXPECT_TRUE(std::isnan(grid->z_m[2]));
}

TEST_F(GeoTiff, TheFirstOfSeveralBandsIsTheHeightAndAnAlphaBandMarksHoles) {
  // Files as gdal_translate makes them from a BAG (elevation, uncertainty), and as gdalwarp -dstalpha makes them.
  const std::vector<float> pairs{-1, 0.5f, -2, 0, -3, 0.5f, -4, 0.5f, -5, 0.5f, -6, 0.5f};
  TiffFile file = TiffFile::of(3, 2, pairs).at(0, 100, 10, 10).bands({0});
  const auto uncertain = read(file);
  ASSERT_TRUE(uncertain) << uncertain.error().text;
  EXPECT_EQ(uncertain->z_m, (std::vector<float>{-4, -5, -6, -1, -2, -3}));
  EXPECT_THAT(uncertain->notes, ::testing::ElementsAre(HasSubstr("are the first of 2 bands")));
  const auto with_alpha = read(TiffFile::of(3, 2, pairs).at(0, 100, 10, 10).bands({2}));
  ASSERT_TRUE(with_alpha) << with_alpha.error().text;
  EXPECT_TRUE(std::isnan(with_alpha->z_m[4]));
  EXPECT_FLOAT_EQ(with_alpha->z_m[5], -3);
  EXPECT_THAT(with_alpha->notes, ::testing::ElementsAre(HasSubstr("1 of its 6 heights")));
  EXPECT_FALSE(read(TiffFile::of(3, 2, std::vector<std::uint8_t>(12)).at(0, 100, 10, 10).bands({2}))) << "a picture";
  EXPECT_FALSE(read(TiffFile::of(3, 2, pairs).at(0, 100, 10, 10).bands(std::vector<std::uint16_t>(40)))) << "too short";
  TiffFile planes = TiffFile::of(3, 2, pairs).at(0, 100, 10, 10).bands({2}).shorts(284, {2});
  EXPECT_THAT(read(planes).error().text, HasSubstr("separate band; write them as a value: gdalwarp -dstnodata"));
}

TEST_F(GeoTiff, ASystemThatIsOnlyCitedIsRead) {
  const std::string sphere =
      "GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,298.257223563]],"
      "PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]]";
  const auto system = [&](const std::string& name, const std::string& rest, std::uint16_t model) {
    return read(TiffFile::of(3, 2, std::vector<float>(6, -5))
                    .at(500000, 6651500, 100, 100)
                    .cited({{{1024, model}, {1025, 1}, {3072, 32767}}}, 3073,
                           "ESRI PE String = PROJCS[\"" + name + "\"," + sphere + rest + "]"));
  };
  for (const std::uint16_t model : {std::uint16_t{1}, std::uint16_t{32767}}) {
    const auto mercator = system("WGS_1984_Web_Mercator_Auxiliary_Sphere", ",PROJECTION[\"Mercator_Auxiliary_Sphere\"]", model);
    ASSERT_TRUE(mercator) << mercator.error().text;
    EXPECT_TRUE(mercator->origin);
    EXPECT_THAT(mercator->notes, ::testing::Contains(HasSubstr("in Web Mercator")));
    const auto utm = system("WGS_1984_UTM_Zone_33N", ",UNIT[\"Meter\",1.0]", model);
    ASSERT_TRUE(utm) << utm.error().text;
    EXPECT_THAT(utm->notes, ::testing::ElementsAre(HasSubstr("UTM zone 33N")));
    const auto feet = system("Somewhere", ",UNIT[\"Foot_US\",0.304800609601]", model);
    ASSERT_TRUE(feet) << feet.error().text;
    EXPECT_NEAR(feet->x[1] - feet->x[0], 100 * 0.304800609601, 1e-9);
  }
  const auto nameless = read(TiffFile::of(3, 2, six).at(0, 100, 10, 10).cited({{{1024, 1}, {3075, 1}}}, 1026, "unknown"));
  ASSERT_TRUE(nameless) << nameless.error().text;
  EXPECT_THAT(nameless->notes, ::testing::Contains(HasSubstr("of a system without a name, are read as plain metres")));
}

TEST_F(GeoTiff, AWorldFileBesideATiffGivesItsPlace) {
  files.write("g.tfw", "10\n0\n0\n-5\n1000\n2000\n");
  files.write("g.prj", "PROJCS[\"x\",GEOGCS[\"y\",UNIT[\"degree\",0.017]],UNIT[\"foot\",0.3048]]");
  const auto grid = read(TiffFile::of(3, 2, six));
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_NEAR(grid->x.back(), 1020 * 0.3048, 1e-9);
  EXPECT_NEAR(grid->y.front(), 1995 * 0.3048, 1e-9);
}

TEST_F(GeoTiff, DegreesStandAboutAnOrigin) {
  const auto grid = read(TiffFile::of(3, 2, std::vector<std::int16_t>{-10, -20, -30, -40, -32768, -60})
                             .at(5, 60, 0.01, 0.01)
                             .keys({{{1024, 2}, {1025, 1}, {2054, 9102}}}),
                         {.origin = Geodetic{rad_from_deg(60), rad_from_deg(5), 0}});
  ASSERT_TRUE(grid) << grid.error().text;
  ASSERT_TRUE(grid->origin);
  EXPECT_NEAR(grid->x[0], 5.005, 1e-12);
  EXPECT_NEAR(grid->y[1], 59.995, 1e-12);
  EXPECT_TRUE(std::isnan(grid->z_m[1]));
  EXPECT_THAT(grid->notes, ::testing::ElementsAre(HasSubstr("1 cell of -32768, far from"), HasSubstr("are missing")));
  EXPECT_FALSE(read(TiffFile::of(3, 2, six).at(5, 60, 0.01, 0.01).keys({{{1024, 1}}}))->origin) << "the file states metres";
}

TEST_F(GeoTiff, TheUtmZoneOfAFilePlacesTheGridAboutAnOrigin) {
  const auto tiff = [](std::uint16_t system) {
    return TiffFile::of(3, 2, std::vector<float>(6, -5))
        .at(500000, 6651500, 100, 100)
        .keys({{{1024, 1}, {1025, 2}, {3072, system}}});
  };
  const Geodetic origin{rad_from_deg(60), rad_from_deg(15), 0};
  for (const std::uint16_t system : {std::uint16_t{32633}, std::uint16_t{25833}}) {
    const auto grid = read(tiff(system), {.origin = origin});
    ASSERT_TRUE(grid) << grid.error().text;
    EXPECT_EQ(grid->zone, (UtmZone{33, false}));
    const auto mesh = mesh_from_grid(*grid);
    ASSERT_TRUE(mesh) << mesh.error().text;
    const Vec3d corner = to_double(mesh->mesh.vertices[0]) + mesh->centre_m;
    EXPECT_NEAR(corner.x, 0, 0.01);
    EXPECT_NEAR(corner.y, (6651400 - 6651411.19) / 0.9996, 0.02);  // the northing of 60 degrees
  }
  EXPECT_EQ(read(tiff(32733), {.origin = Geodetic{rad_from_deg(-30.3), rad_from_deg(15), 0}})->zone, (UtmZone{33, true}));
  // ED50: its coordinates differ from those of WGS 84 by about 100 m.
  EXPECT_THAT(read(tiff(23033), {.origin = origin}).error().text, HasSubstr("origin is for a grid in degrees or UTM"));
}

TEST_F(GeoTiff, EveryKindOfNumberIsRead) {
  const auto first = [&](const TiffFile& tiff) {
    const auto grid = read(TiffFile(tiff).at(0, 100, 10, 10));
    return grid ? static_cast<double>(grid->z_m[2]) : -1;
  };
  EXPECT_EQ(first(TiffFile::of(2, 2, std::vector<std::uint8_t>{7, 1, 2, 3})), 7);
  EXPECT_EQ(first(TiffFile::of(2, 2, std::vector<std::int8_t>{-7, 1, 2, 3})), -7);
  EXPECT_EQ(first(TiffFile::of(2, 2, std::vector<std::uint16_t>{40000, 1, 2, 3})), 40000);
  EXPECT_EQ(first(TiffFile::of(2, 2, std::vector<std::int32_t>{-70000, 1, 2, 3})), -70000);
  EXPECT_EQ(first(TiffFile::of(2, 2, std::vector<double>{-7.25, 1, 2, 3})), -7.25);
  TiffFile turned = TiffFile::of(2, 2, six);
  turned.doubles(34264, {10, 0, 0, 100, 0, 10, 0, 200, 0, 0, 0, 0, 0, 0, 0, 1});  // south first
  const auto grid = read(turned);
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_EQ(grid->y, (std::vector<double>{205, 215}));
  EXPECT_FLOAT_EQ(grid->z_m[0], -1);
}

TEST_F(GeoTiff, NumbersWithoutWholeBytesAreRead) {
  using Rows = std::vector<std::uint8_t>;
  const auto tiff = [](std::uint16_t bits, const Rows& bytes, std::uint16_t columns, std::uint16_t fill_order = 1) {
    TiffFile f = TiffFile::of(columns, 2, bytes).at(0, 100, 10, 10).without(258);
    f.shorts(258, {bits}), f.shorts(266, {fill_order});
    return f;
  };
  const auto heights = [&](const TiffFile& f, bool big = false) {
    const auto grid = read_geo_tiff_heights(files.write("g.tif", f.bytes(big)), {});
    if (!grid) ADD_FAILURE() << grid.error().text;
    return grid ? grid->z_m : std::vector<float>();
  };
  using Heights = std::vector<float>;  // the last row is the first one in the file
  const Rows twelve{0x12, 0x3A, 0xBC, 0x00, 0x10, 0xFF, 0xF8, 0x00, 0x7F, 0xF0};
  EXPECT_EQ(heights(tiff(12, twelve, 3)), (Heights{0xFFF, 0x800, 0x7FF, 0x123, 0xABC, 0x001}));
  EXPECT_EQ(heights(tiff(12, twelve, 3), true), (Heights{0xFFF, 0x800, 0x7FF, 0x123, 0xABC, 0x001})) << "both byte orders";
  const Rows reversed{0x48, 0x5C, 0x3D, 0x00, 0x08, 0xFF, 0x1F, 0x00, 0xFE, 0x0F};
  EXPECT_EQ(heights(tiff(12, reversed, 3, 2)), (Heights{0xFFF, 0x800, 0x7FF, 0x123, 0xABC, 0x001}));
  EXPECT_EQ(heights(tiff(10, {0x80, 0x7F, 0xF0, 0x00, 0x10, 0x00}, 2)), (Heights{0, 256, 513, 1023}));
  EXPECT_EQ(heights(tiff(1, {0xA0, 0x60}, 3)), (Heights{0, 1, 1, 1, 0, 1}));
  const Heights long_ones = heights(tiff(31, {0, 0, 0, 3, 0xFF, 0xFF, 0xFF, 0xFC, 0, 2, 0, 0, 0, 0, 0, 0}, 2));
  ASSERT_EQ(long_ones.size(), 4u);
  EXPECT_EQ((Heights{long_ones[0], long_ones[1], long_ones[2]}), (Heights{65536, 0, 1}));
  EXPECT_TRUE(std::isnan(long_ones[3])) << "all of its bits are 1, a fill value";
  // Rows as GDAL 3.6.2 writes them: gdal_translate -ot UInt32 -co NBITS=20, and 24, which it writes in the order of the bits,
  // too.
  const Heights written{70000, 66051, 1048575, 1, 300, 4095};
  EXPECT_EQ(
      heights(tiff(20, {0x00, 0x00, 0x10, 0x01, 0x2C, 0x00, 0xFF, 0xF0, 0x11, 0x17, 0x01, 0x02, 0x03, 0xFF, 0xFF, 0xF0}, 3)),
      written);
  EXPECT_EQ(heights(tiff(24, {0, 0, 1, 0, 1, 0x2C, 0, 0x0F, 0xFF, 1, 0x11, 0x70, 1, 2, 3, 0x0F, 0xFF, 0xFF}, 3)), written);
  TiffFile two_bands = tiff(12, {0x12, 0x3A, 0xBC, 0x45, 0x60, 0x00, 0x00, 0x10, 0x02, 0x00, 0x30, 0x04}, 2);
  EXPECT_EQ(heights(two_bands.bands({0})), (Heights{1, 3, 0x123, 0x456}));
  const Heights shown = heights(two_bands.without(338).shorts(338, {2}));
  ASSERT_EQ(shown.size(), 4u);
  EXPECT_TRUE(std::isnan(shown[3])) << "its alpha is 0";
  EXPECT_EQ(shown[2], 0x123);
  TiffFile with_sign = tiff(12, twelve, 3).without(339);
  with_sign.shorts(339, {2});
  const auto refused = read(with_sign);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("whole numbers of 12 bits, which are not read; convert them: gdal_tr"));
  TiffFile complex = TiffFile::of<double>(2, 2, {1, 2, 3, 4}).at(0, 0, 1, 1).without(339);
  EXPECT_THAT(read(complex.shorts(339, {6})).error().text, HasSubstr("complex numbers of 64 bits"));
}

TEST_F(GeoTiff, WrongFilesAreRefusedWithTheCommandThatHelps) {
  const auto refusal = [&](const TiffFile& tiff) {
    const auto grid = read(tiff);
    return grid ? std::string("accepted") : grid.error().text;
  };
  const auto good = [] { return TiffFile::of(3, 2, six).at(0, 100, 10, 10); };
  EXPECT_EQ(refusal(good()), "accepted");
  EXPECT_THAT(refusal(TiffFile::of(3, 2, six)), HasSubstr("gdal_translate -a_ullr"));
  TiffFile points = TiffFile::of(3, 2, six);
  points.doubles(33922, {0, 0, 0, 5, 60, 0, 3, 0, 0, 5.1, 60, 0, 0, 2, 0, 5, 59.9, 0});
  EXPECT_THAT(refusal(points),
              HasSubstr("has control points instead of a regular grid; make a grid of them: gdalwarp IN OUT.tif"));
  TiffFile picture = good().without(262).without(277);
  picture.shorts(262, {2}), picture.shorts(277, {3});
  EXPECT_THAT(refusal(picture), HasSubstr("not one band of heights but a picture"));
  TiffFile huge = good().without(256).without(257);
  huge.longs(256, {100000}), huge.longs(257, {100000});
  EXPECT_THAT(refusal(huge), HasSubstr("more than 10 million"));
  TiffFile jpeg = good().without(259);
  jpeg.shorts(259, {7});
  EXPECT_THAT(refusal(jpeg), HasSubstr("COMPRESS=DEFLATE"));
  EXPECT_THAT(refusal(jpeg), HasSubstr("(JPEG)"));
  TiffFile lerc = good().without(259);
  lerc.shorts(259, {34887});
  EXPECT_THAT(refusal(lerc), HasSubstr("(LERC); write it otherwise: gdal_translate -co COMPRESS=DEFLATE IN OUT.tif"));
  for (const char* scale : {"0", "x", "1e9", "nan"}) {
    TiffFile scaled = good();
    scaled.text(42112, R"(<GDALMetadata><Item name="SCALE" sample="0" role="scale">)" + std::string(scale) + "</Item>");
    EXPECT_THAT(refusal(scaled), HasSubstr("gdal_translate -unscale")) << scale;
  }
  TiffFile unscaled = good();
  unscaled.text(42112, R"(<GDALMetadata><Item name="OFFSET" sample="0" role="offset">0</Item>)"
                       R"(<Item name="SCALE" sample="0" role="scale">1</Item></GDALMetadata>)");
  EXPECT_EQ(refusal(unscaled), "accepted");
  EXPECT_THAT(refusal(good().keys({{{1024, 1}, {3076, 32767}}})), HasSubstr("units of length of code 32767"));
  TiffFile turned = TiffFile::of(3, 2, six);
  turned.doubles(34264, {10, 1, 0, 0, 1, -10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1});
  EXPECT_THAT(refusal(turned), HasSubstr("gdalwarp"));
  TiffFile rounded = TiffFile::of(3, 2, six);
  rounded.doubles(34264, {10, 1e-12, 0, 0, -1e-12, -10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1});
  EXPECT_EQ(refusal(rounded), "accepted");
  EXPECT_THAT(refusal(TiffFile::of(3, 2, six).at(0, 0, 0, 10)), HasSubstr("cells whose sizes are not"));
  EXPECT_THAT(refusal(TiffFile::of(2, 2, std::vector<float>{1e9f, 1, 2, 3}).at(0, 0, 1, 1)),
              HasSubstr("row 1, column 1 is beyond 1e7 m"));
  // Four tiles of 64 MiB for 256 KiB of heights: small if packed, but minutes to unpack if there were thousands.
  TiffFile tiles = TiffFile::of(2, 16384, std::vector<float>(2)).at(0, 100, 10, 10).without(273).without(278).without(279);
  tiles.shorts(322, {4096}), tiles.shorts(323, {4096}), tiles.longs(324, {8, 8, 8, 8}), tiles.longs(325, {8, 8, 8, 8});
  EXPECT_THAT(refusal(tiles), HasSubstr("tiles are much larger than the picture"));
  EXPECT_EQ(read_geo_tiff_heights("no/such.tif", {}).error().kind, ErrorKind::missing_file);
  const std::string whole = good().bytes();
  for (std::size_t n = 0; n < whole.size(); n += test::is_sanitized ? 5 : 1) {  // geo_tiff_fuzz makes more mutations there
    const auto cut = read_geo_tiff_heights(files.write("cut.tif", whole.substr(0, n)), {});
    EXPECT_FALSE(cut) << n;
    if (!cut) {
      EXPECT_THAT(cut.error().text, HasSubstr("cut.tif: ")) << n;
    }
    std::string bent = whole;
    bent[n] = static_cast<char>(bent[n] ^ 0x55);
    (void)read_geo_tiff_heights(files.write("bent.tif", bent), {});
  }
}

}  // namespace
}  // namespace sonar::geo_tiff_test
