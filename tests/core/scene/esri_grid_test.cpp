// Ground read from ESRI grids: headers, far coordinates, holes, degrees and lengths, and files that are wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/scene/shapes/terrain.hpp"
#include "tests/core/scene/mesh_checks.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::esri_grid_test {
namespace {

using ::testing::HasSubstr;
using tests::expect_sound;
using tests::TemporaryFiles;

const char* const small_grid =
    "ncols 3\nnrows 3\nxllcorner 500000\nyllcorner 5200000.5\ncellsize 2\nNODATA_value -9999\n"
    "1 2 3\n4 5 6\n7 8 -9999\n";

TEST(EsriGrid, LargeCoordinatesBecomeTheMeshCentre) {
  TemporaryFiles files;
  const auto grid = read_esri_heights(files.write("g.asc", small_grid), {});
  ASSERT_TRUE(grid) << grid.error().text;
  auto mesh = mesh_from_grid(*grid);
  ASSERT_TRUE(mesh);
  expect_sound(mesh->mesh);
  EXPECT_DOUBLE_EQ(mesh->centre_m.x, 500003);
  EXPECT_DOUBLE_EQ(mesh->centre_m.y, 5200003.5);
  EXPECT_EQ(mesh->mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh->mesh.triangles.size(), 6u);  // the corner without data costs its quad
  // First row of the file is north: the height at the north-west is 1.
  EXPECT_FLOAT_EQ(grid->z_m[6], 1);
  EXPECT_TRUE(std::isnan(grid->z_m[2]));
  EXPECT_FLOAT_EQ(read_esri_heights(files.write("g.asc", small_grid), {.z_scale = -1})->z_m[6], -1);
}

TEST(EsriGrid, HeadersOfOtherProgramsAreRead) {
  TemporaryFiles files;
  const std::string heights = "-1 -2 -3\n-4 -5 -9999\n";
  for (const char* header : {"ncols = 3\nnrows = 2\nxllcorner = 100\nyllcorner = 200\ncellsize = 10\nNODATA_value = -9999\n",
                             "NCOLS: 3\r\nNROWS: 2\r\nXLLCORNER: 100\r\nYLLCORNER: 200\r\nCELLSIZE: 10\r\nNODATA: -9999\r\n",
                             "NoData_Value -9999\nCellSize 10\nYLLCENTRE 205\nXLLCENTRE 105\nNRows=2\nNCols=3\n",
                             "nrows 2\nncols 3\nxllcorner 100\nyllcenter 205\ndx 10\ndy 10\n"}) {
    const auto grid = read_esri_heights(files.write("g.asc", header + heights), {});
    ASSERT_TRUE(grid) << header << grid.error().text;
    EXPECT_EQ(grid->x, (std::vector<double>{105, 115, 125})) << header;
    EXPECT_EQ(grid->y, (std::vector<double>{205, 215})) << header;
    EXPECT_FLOAT_EQ(grid->z_m[3], -1) << header;
    EXPECT_TRUE(std::isnan(grid->z_m[2])) << header;
  }
  const std::string placeless = "ncols 3\nnrows 2\ncellsize 10\n";
  EXPECT_THAT(read_esri_heights(files.write("g.asc", placeless + heights), {})->notes,
              ::testing::Contains(HasSubstr("neither xllcorner nor yllcorner")));
  EXPECT_THAT(read_esri_heights(files.write("g.asc", "xllcorner 1\n" + placeless + heights), {}).error().text,
              HasSubstr("yllcorner is missing"));
}

TEST(EsriGrid, WrongFilesAreRefusedWithTheirLine) {
  TemporaryFiles files;
  const auto refusal = [&](const std::string& text) {
    const auto grid = read_esri_heights(files.write("bad.asc", text), {});
    return grid ? std::string("accepted") : grid.error().text;
  };
  EXPECT_THAT(refusal(""), HasSubstr("ncols is missing in the header"));
  EXPECT_THAT(refusal("ncols 3\nnrows x\n"), HasSubstr("line 2: nrows needs a number"));
  EXPECT_THAT(refusal("hello 3\n"), HasSubstr("\"hello\" is not a header word"));
  EXPECT_THAT(refusal("ncols 1\nnrows 2\ncellsize 1\n1 2"), HasSubstr("whole numbers from 2"));
  EXPECT_THAT(refusal("ncols 1e9\nnrows 1e9\ncellsize 1\n"), HasSubstr("at most 10 million"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ncellsize 0\n1 2 3 4"), HasSubstr("cellsize must be"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ncellsize 1\n1 2 3"), HasSubstr("ends after 3 of 4 heights"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ncellsize 1\n1 2 3 4 5"), HasSubstr("more heights than"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ncellsize 1\n1 2\n3 x"), HasSubstr("line 5: \"x\" is not a height"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ndx 1\n1 2 3 4"), HasSubstr("cellsize is missing"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ndy 1\n1 2 3 4"), HasSubstr("dx is missing"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\nxllcorner 0,5\n"), HasSubstr("xllcorner needs a number, not \"0,5\" (numbers have a"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ncellsize 1\n*\x1b[2J 2 3 4"), HasSubstr("line 4: \"*\\x1b[2J\" is not a height"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ncellsize 1\n-1,-2\n-3,-4"), HasSubstr("\"-1,-2\" (numbers have a decimal point, and"));
  EXPECT_THAT(refusal("ncols nan\nnrows 2\ncellsize 1\n1 2 3 4"), HasSubstr("ncols needs a number"));
  EXPECT_THAT(refusal("ncols 2\nnrows 2\ncellsize 1\n1 2\n3 1e9"), HasSubstr("beyond 1e7 m"));
  const auto missing = read_esri_heights("no/grid.asc", {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::missing_file);
  const auto empty = read_esri_heights(files.write("e.asc", "ncols 2\nnrows 2\ncellsize 1\nNODATA_value 0\n0 0 0 0"), {});
  ASSERT_TRUE(empty);
  EXPECT_THAT(mesh_from_grid(*empty).error().text, HasSubstr("no cell of the grid has a height"));
  for (std::size_t n = 0; n < std::string(small_grid).size(); ++n) refusal(std::string(small_grid).substr(0, n));
}

std::string grid_of(const std::string& header, const std::string& odd, int edge = 10) {
  std::string text = "ncols " + std::to_string(edge) + "\nnrows " + std::to_string(edge) + "\n" + header + "\n";
  for (int i = 0; i < edge * edge; ++i) text += (i == 45 ? odd : i == 99 ? "-9.5" : "-10") + (i % edge == edge - 1 ? "\n" : " ");
  return text;
}

TEST(EsriGrid, NoDataIsRecognisedInEveryForm) {
  TemporaryFiles files;
  const std::string at = "xllcorner 0\nyllcorner 0\n", metre = at + "cellsize 1";
  const auto holes_in = [&](const std::string& text, bool with_note) {
    const auto grid = read_esri_heights(files.write("g.asc", text), {});
    if (!grid) return grid.error().text;
    int holes = 0;
    for (std::size_t k = 0; k < grid->z_m.size(); ++k)
      if (std::isnan(grid->z_m[k])) {
        ++holes;
        EXPECT_EQ(k, 55u) << text;
      }
    std::string notes;
    for (const std::string& note : grid->notes) notes += note + ". ";
    EXPECT_THAT(notes, HasSubstr(" of its 100 heights (1 %) are missing"));
    EXPECT_EQ(grid->notes.size(), with_note ? 2u : 1u) << notes;
    return std::to_string(holes);
  };
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value nan", "nan"), false), "1");
  EXPECT_EQ(holes_in(grid_of(metre, "NaN"), false), "1");
  EXPECT_EQ(holes_in("\xEF\xBB\xBF" + grid_of(metre, "-9999"), false), "1");  // byte order mark, as written by editors on Windows
  EXPECT_EQ(holes_in(grid_of(at + "dx 1\ndy 2", "-9999"), false), "1");
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -3.40282e+38", "-3.4028234663852886e+38"), false), "1");
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -3.4E+38", "-3.4028234663852886e+38"), false), "1");
  for (const char* few_digits : {"1e20", "-1e38", "2e7"})  // a tolerance of one digit would include every height
    EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value " + few_digits, few_digits), false), "1") << few_digits;
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -99999.99", "-99999.9921875"), false), "1");
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value 0", "0"), false), "1");
  for (const char* fill : {"-32768", "-99999", "-9999999", "-999.99", "-9999.9", "99999.99", "65535", "-2147483648", "2147483647",
                           "4294967295", "-3.4028234663852886e+38", "9.96921e+36"})
    EXPECT_EQ(holes_in(grid_of(metre, fill), true), "1") << fill;
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -32768", "-9999"), true), "1");
  // Other values remain heights, but one far from all others is noted.
  for (const char* far : {"-888", "-12345.6", "5000"}) {
    const auto grid = read_esri_heights(files.write("g.asc", grid_of(metre, far)), {});
    ASSERT_TRUE(grid);
    EXPECT_THAT(grid->notes, ::testing::Contains(HasSubstr(std::string("1 cell of ") + far + ", "))) << far;
  }
  const auto near = read_esri_heights(files.write("g.asc", grid_of(metre, "8")), {});
  ASSERT_TRUE(near);
  EXPECT_TRUE(near->notes.empty()) << near->notes[0];
  // Among such depths -9999 m is ground, not a hole.
  const auto trench = read_esri_heights(
      files.write("g.asc",
                  "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 100\nNODATA_value -32768\n-9999 -9998 -9950 -10010\n"),
      {});
  ASSERT_TRUE(trench);
  EXPECT_TRUE(trench->notes.empty()) << trench->notes[0];
  EXPECT_FLOAT_EQ(trench->z_m[2], -9999);
}

TEST(EsriGrid, CellsMayBeOblong) {
  TemporaryFiles files;
  const auto grid =
      read_esri_heights(files.write("g.asc", "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 20\ndx 2\ndy 4\n1 2 3 4 5 6"), {});
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_EQ(grid->x, (std::vector<double>{11, 13, 15}));
  EXPECT_EQ(grid->y, (std::vector<double>{22, 26}));
}

std::string degrees_of(const std::string& corner, const std::string& cell, int edge = 40, bool flat = false) {
  std::string text =
      "ncols " + std::to_string(edge) + "\nnrows " + std::to_string(edge) + "\n" + corner + "\ncellsize " + cell + "\n";
  for (int i = 0; i < edge * edge; ++i) text += std::to_string(flat ? -20.0 : -20 + 3 * std::sin(0.3 * i)) + " ";
  return text;
}

TEST(EsriGrid, DegreesBecomeMetresAboutAnOrigin) {
  TemporaryFiles files;
  // Lengths of a degree (WGS84): 111 412.4 m along the meridian in the middle, 55 799.8 m along the southernmost parallel. The
  // grid spans 39 arc seconds.
  const std::string text = degrees_of("xllcorner 5.0\nyllcorner 60.0", "0.000277777778");
  const auto grid = read_esri_heights(files.write("g.asc", text), {});
  ASSERT_TRUE(grid) << grid.error().text;
  ASSERT_EQ(grid->notes.size(), 2u);
  EXPECT_THAT(grid->notes[0], HasSubstr("read as degrees"));
  EXPECT_THAT(grid->notes[1], HasSubstr("relative to its middle, latitude 60.005556, longitude 5.005556"));
  const auto mesh = mesh_from_grid(*grid);
  ASSERT_TRUE(mesh);
  expect_sound(mesh->mesh);
  Vec3 low = mesh->mesh.vertices[0], high = low;
  for (const Vec3& v : mesh->mesh.vertices)
    low = {std::min(low.x, v.x), std::min(low.y, v.y), 0}, high = {std::max(high.x, v.x), std::max(high.y, v.y), 0};
  EXPECT_NEAR(high.y - low.y, 39 * 111412.4 / 3600, 0.1);
  EXPECT_NEAR(high.x - low.x, 39 * 55799.8 / 3600, 0.2);  // the southernmost row is the widest
  EXPECT_NEAR(mesh->centre_m.x, 0, 0.1);
  EXPECT_NEAR(mesh->centre_m.y, 0, 0.1);

  // A vertex lies where the conversion of poses puts its place; its height is compared separately.
  const Geodetic origin{rad_from_deg(60.1), rad_from_deg(4.9), 0};
  const auto placed = read_esri_heights(files.write("g.asc", text), {.geographic = true, .origin = origin});
  ASSERT_TRUE(placed) << placed.error().text;
  EXPECT_TRUE(placed->notes.empty());
  const auto there = mesh_from_grid(*placed);
  ASSERT_TRUE(there);
  for (const std::size_t k : {std::size_t{0}, std::size_t{39}, std::size_t{777}, std::size_t{1599}}) {
    const Vec3d expected =
        enu_in_enu_of(origin, {rad_from_deg(placed->y[k / 40]), rad_from_deg(placed->x[k % 40]), 0}).position_m;
    const Vec3d p = to_double(there->mesh.vertices[k]) + there->centre_m;
    EXPECT_NEAR(p.x, expected.x, 1e-3) << k;
    EXPECT_NEAR(p.y, expected.y, 1e-3) << k;
    EXPECT_NEAR(p.z, static_cast<double>(placed->z_m[k]), 1e-5) << k;
  }
}

TEST(EsriGrid, DistinguishesDegreesFromMetres) {
  TemporaryFiles files;
  const auto is_geographic = [&](const std::string& text, const HeightOptions& options = {}) -> std::string {
    const auto grid = read_esri_heights(files.write("g.asc", text), options);
    return !grid ? grid.error().text : grid->origin ? "degrees" : "metres";
  };
  const std::string near_zero = "xllcorner 0\nyllcorner 0", far = "xllcorner 500000\nyllcorner 6600000";
  EXPECT_EQ(is_geographic(degrees_of(near_zero, "0.004166667")), "degrees");
  EXPECT_EQ(is_geographic(degrees_of("xllcorner -122.5\nyllcorner -47", "0.000833333", 12, true)), "degrees");
  EXPECT_EQ(is_geographic(degrees_of("xllcorner 237.5\nyllcorner 47", "0.016666667", 12)), "degrees");
  EXPECT_EQ(is_geographic(degrees_of(far, "0.004166667")), "metres");
  const auto smooth = [&](const char* cell) {
    return is_geographic("ncols 2\nnrows 2\n" + near_zero + "\ncellsize " + cell + "\n-10 -10.003 -10 -10.003\n");
  };
  for (const char* cell : {"0.00416666667", "0.000277777778", "0.00083333", "0.0166666667"})
    EXPECT_EQ(smooth(cell), "degrees") << cell;
  for (const char* cell : {"0.004", "0.0005", "0.025", "0.0254"}) EXPECT_EQ(smooth(cell), "metres") << cell;  // cells of a tank
  EXPECT_EQ(is_geographic(degrees_of(near_zero, "30")), "metres");
  EXPECT_EQ(is_geographic(degrees_of(near_zero, "0.05", 12, true)), "metres");  // a tank
  EXPECT_EQ(is_geographic(degrees_of(near_zero, "0.004166667"), {.geographic = false}), "metres");
  EXPECT_EQ(is_geographic(degrees_of(near_zero, "0.05", 12, true), {.geographic = true}), "degrees");
  const std::string seattle = degrees_of("xllcorner 237.5\nyllcorner 47", "0.016666667", 12);
  EXPECT_EQ(is_geographic(seattle, {.origin = Geodetic{rad_from_deg(47), rad_from_deg(-122.5), 0}}), "degrees");
  EXPECT_THAT(is_geographic(degrees_of(far, "1"), {.geographic = true}), HasSubstr("not longitudes and latitudes"));
  EXPECT_THAT(is_geographic(degrees_of(near_zero, "1", 40, true), {.geographic = true}), HasSubstr("at most 5"));
  EXPECT_THAT(is_geographic(degrees_of("xllcorner 3\nyllcorner 89.5", "0.0002"), {}), HasSubstr("of a pole"));
  EXPECT_THAT(is_geographic(degrees_of(far, "1"), {.origin = Geodetic{}}), HasSubstr("origin is for a grid in degrees"));
  files.write("g.prj", "GEOGCS[\"WGS 84\"]");
  EXPECT_EQ(is_geographic(degrees_of(near_zero, "0.05", 12, true)), "degrees");
  files.write("g.prj", "PROJCS[\"UTM\"]");
  EXPECT_EQ(is_geographic(degrees_of(near_zero, "0.004166667")), "metres");
}

TEST(EsriGrid, UnitsOfItsPrjBecomeMetres) {
  TemporaryFiles files;
  const std::string grid_text = "ncols 2\nnrows 2\nxllcenter 1000\nyllcenter 2000\ncellsize 10\nNODATA -1\n-3 NA\n-5 -1\n";
  const auto read = [&](const std::string& prj) {
    files.write("g.prj", prj);
    return read_esri_heights(files.write("g.asc", grid_text), {});
  };
  auto grid = read("Projection    STATEPLANE\r\nUnits         feet\r\nZunits        feet\r\n");
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_NEAR(grid->x.back(), 1010 * 0.3048, 1e-9);
  EXPECT_NEAR(grid->z_m[2], -3 * 0.3048, 1e-6);
  EXPECT_TRUE(std::isnan(grid->z_m[3]) && std::isnan(grid->z_m[1]));
  grid = read("PROJCS[\"P\",UNIT[\"km\",1000]]");
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_NEAR(grid->x.back(), 1010e3, 1e-6);
  EXPECT_THAT(grid->notes, ::testing::ElementsAre(HasSubstr("in units of 1000 m, become metres"), HasSubstr("of P, are read"),
                                                  HasSubstr("are missing")));
}

TEST(EsriGrid, VerticalSystemsOfItsPrjAreRead) {
  TemporaryFiles files;
  const auto read = [&](const std::string& prj, const std::string& heights = "3 4\n5 6\n") {
    files.write("g.prj", prj);
    return read_esri_heights(files.write("g.asc", "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 10\n" + heights), {});
  };
  const std::string lengths = "PROJCS[\"P\",GEOGCS[\"G\",UNIT[\"Degree\",0.0174]],UNIT[\"Meter\",1]]";
  const auto depths = HasSubstr(", counts depths downwards: set z_scale: -1");
  for (const std::string& vertical :
       {"COMPD_CS[\"C\"," + lengths + ",VERT_CS[\"MSL depth\",UNIT[\"metre\",1],AXIS[\"Depth\",DOWN]]]",
        lengths + ",VERTCS[\"MSL_Depth\",PARAMETER[\"Vertical_Shift\",0.0],PARAMETER[\"Direction\",-1.0],UNIT[\"Meter\",1.0]]",
        "COMPOUNDCRS[\"C\"," + lengths + ",VERTCRS[\"d\",CS[vertical,1],AXIS[\"depth (D)\",down,LENGTHUNIT[\"metre\",1]]]]"}) {
    EXPECT_THAT(read(vertical)->notes, ::testing::Contains(depths)) << vertical;
    EXPECT_THAT(read(vertical, "-3 -4\n-5 -6\n")->notes, ::testing::Contains(HasSubstr("but its values are negative")))
        << vertical;
  }
  const std::string feet = lengths + ",VERTCS[\"H\",PARAMETER[\"Direction\",1.0],UNIT[\"Foot\",0.3048]]";
  EXPECT_THAT(read(feet)->notes, ::testing::Not(::testing::Contains(depths)));
  EXPECT_NEAR(read(feet)->z_m[2], 3 * 0.3048, 1e-6);
  EXPECT_THAT(read(feet)->notes, ::testing::Contains(HasSubstr("its coordinates, of P, are read")));
}

}  // namespace
}  // namespace sonar::esri_grid_test
