// Ground read from lists of points: the order of points and columns, their names, and files that are wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "core/scene/shapes/terrain.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::xyz_grid_test {
namespace {

using ::testing::HasSubstr;
using tests::TemporaryFiles;

TEST(XyzGrid, PointsMayHaveAnyOrder) {
  TemporaryFiles files;
  const auto read = [&](const std::string& text) { return read_xyz_heights(files.write("g.xyz", text), {}); };
  const auto grid = read(
      "x y z\n500010 100 -1\n500020,100,-2\n500010;110;-3\n\n# missing: 500020 110\n500010 130 -5\n500020 130 nan\n500020 100 "
      "-7\n");
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_EQ(grid->x, (std::vector<double>{500010, 500020}));
  EXPECT_EQ(grid->y, (std::vector<double>{100, 110, 120, 130}));  // a row that is missing is a row of holes
  EXPECT_FLOAT_EQ(grid->z_m[0], -1);
  EXPECT_FLOAT_EQ(grid->z_m[1], -7);
  EXPECT_FLOAT_EQ(grid->z_m[2], -3);
  EXPECT_TRUE(std::isnan(grid->z_m[3]) && std::isnan(grid->z_m[4]) && std::isnan(grid->z_m[7]));
  EXPECT_THAT(grid->notes, ::testing::ElementsAre(HasSubstr("4 of its 8 heights"),
                                                  HasSubstr("1 points have the position of an earlier point")));

  std::string degrees;  // rounded to five digits, as tools write them
  for (int j = 0; j < 30; ++j)
    for (int i = 0; i < 400; ++i) {
      char line[80];
      std::snprintf(line, sizeof line, "%.5f %.5f %.2f\n", 5 + i / 3600.0, 60 + j / 3600.0, -20 + 3 * std::sin(0.3 * i + j));
      degrees += line;
    }
  const auto rounded = read(degrees);
  ASSERT_TRUE(rounded) << rounded.error().text;
  EXPECT_EQ(rounded->x.size(), 400u);
  EXPECT_EQ(rounded->y.size(), 30u);
  EXPECT_TRUE(rounded->origin);
  EXPECT_TRUE(read("\xEF\xBB\xBF" + degrees));
}

TEST(XyzGrid, NamesOfColumnsMayPutNorthFirst) {
  TemporaryFiles files;
  for (const char* names : {"lat,lon,depth", "Latitude Longitude z", "NORTHING;EASTING;Z", "y x z"}) {
    const auto grid =
        read_xyz_heights(files.write("g.xyz", names + std::string("\n1 100 -1\n2 100 -2\n3 100 -3\n1 110 -4\n")), {});
    ASSERT_TRUE(grid) << names << ": " << grid.error().text;
    EXPECT_EQ(grid->x, (std::vector<double>{100, 110})) << names;
    EXPECT_EQ(grid->y, (std::vector<double>{1, 2, 3})) << names;
    EXPECT_FLOAT_EQ(grid->z_m[1], -4) << names;
  }
  const auto usual = read_xyz_heights(files.write("g.xyz", "lon lat depth\n100 1 -1\n100 2 -2\n110 1 -4\n"), {});
  ASSERT_TRUE(usual) << usual.error().text;
  EXPECT_EQ(usual->x, (std::vector<double>{100, 110}));
}

TEST(XyzGrid, NorthingsInTheFirstColumnAreANote) {
  TemporaryFiles files;
  const auto notes = [&](const std::string& text) {
    const auto grid = read_xyz_heights(files.write("g.xyz", text), {});
    return grid ? grid->notes : std::vector<std::string>{grid.error().text};
  };
  const std::string north_first = "6650000 556000 -1\n6650001 556000 -2\n6650000 556002 -3\n6650001 556002 -4\n";
  const auto exchanged = ::testing::Contains(HasSubstr("x and y may be exchanged"));
  EXPECT_THAT(notes(north_first), exchanged);
  EXPECT_THAT(notes("north east z\n" + north_first), ::testing::Not(exchanged));
  EXPECT_THAT(notes("easting northing z\n" + north_first), ::testing::Not(exchanged))
      << "named columns may be of another grid, such as state plane feet";
  EXPECT_THAT(notes("# E N z\n" + north_first), ::testing::Not(exchanged));
  for (const char* other : {"556000 6650000 -1\n556001 6650000 -2\n556000 6650002 -3\n", "0 0 -1\n1 0 -2\n0 1 -3\n1 1 -3\n",
                            "6650000 5560000 -1\n6650001 5560000 -2\n6650000 5560002 -3\n"})
    EXPECT_THAT(notes(other), ::testing::Not(exchanged)) << other;
}

TEST(XyzGrid, NamesOfColumnsMayStandInAComment) {
  TemporaryFiles files;
  const auto first_x = [&](const std::string& head, const std::string& more = "") {
    std::string text = head;
    for (const char* line : {"1 100 -1", "2 100 -2", "3 100 -3", "1 110 -4"}) text += line + more + "\n";
    const auto grid = read_xyz_heights(files.write("g.xyz", text), {});
    return grid ? grid->x.front() : -1;
  };
  for (const char* head :
       {"# lat lon depth\n", "#Latitude,Longitude,Elevation\n", "// y x z\n", "# lat lon z\n# by hand\n", "N,E,Z\n"})
    EXPECT_EQ(first_x(head), 100) << head;
  EXPECT_EQ(first_x("# made by x from y, north first\n"), 1) << "no names of three columns";
  EXPECT_EQ(first_x("# lat lon z\n", " 7"), 1) << "more columns than names";
  EXPECT_EQ(first_x("# lat lon z\nx y z\n"), 1) << "a line of names counts more";
}

TEST(XyzGrid, NamesInACommentSelectHeightAndDepths) {
  TemporaryFiles files;
  for (const char* begin : {"", "# "}) {
    const auto read = [&](const std::string& names, const std::string& points) {
      return read_xyz_heights(files.write("g.xyz", begin + names + "\n" + points), {});
    };
    const auto numbered = read("x y id z", "100 1 7 -1\n100 2 8 -2\n110 1 9 -3\n110 2 10 -4\n");
    ASSERT_TRUE(numbered) << begin << numbered.error().text;
    EXPECT_EQ(numbered->z_m, (std::vector<float>{-1, -3, -2, -4})) << begin;
    const std::string points = "100 1 1\n100 2 2\n110 1 3\n110 2 4\n";
    const auto depths = read("x y depth", points), heights = read("x y z", points);
    ASSERT_TRUE(depths && heights);
    EXPECT_THAT(depths->notes, ::testing::Contains(HasSubstr("set z_scale: -1 if they count down"))) << begin;
    EXPECT_THAT(heights->notes, ::testing::Not(::testing::Contains(HasSubstr("z_scale")))) << begin;
  }
}

TEST(XyzGrid, ColumnsAreFoundByTheirNames) {
  TemporaryFiles files;
  const auto read = [&](const std::string& text) { return read_xyz_heights(files.write("p.csv", text), {}); };
  for (const char* text :
       {"id,x,y,z\n1,0,0,-1\n2,10,0,-2\n3,0,20,-3\n4,10,20,-4\n", "// by hand\nz;x;y\n-1;0;0\n-2;10;0\n-3;0;20\n-4;10;20\n",
        "Easting (m), Northing (m), Depth below water (m)\r0,0,-1\r10,0,-2\r0,20,-3\r10,20,-4\r",
        "\"Northing\",\"Easting\",\"Elevation\"\n0,0,-1\n0,10,-2\n20,0,-3\n20,10,-4\n",
        "0 0 -1 9 9\n10 0 -2 9 9\n0 20 -3 9 9\n10 20 -4 9 9\n", "x|y|z\n0|0|-1\n10|0|-2\n0|20|-3\n10|20|-4\n",
        ",x,y,z\n0,0,0,-1\n1,10,0,-2\n2,0,20,-3\n3,10,20,-4\n",
        "OBJECTID,POINT_X,POINT_Y,grid_code\n1,0,0,-1\n2,10,0,-2\n3,0,20,-3\n4,10,20,-4\n",
        "4\n0 0 -1\n10 0 -2\n0 20 -3\n10 20 -4\n", "% x y z\n> a\n! b\n0 0 -1\n10 0 -2\n0 20 -3\n10 20 -4\n"}) {
    const auto grid = read(text);
    ASSERT_TRUE(grid) << text << grid.error().text;
    EXPECT_EQ(grid->x, (std::vector<double>{0, 10})) << text;
    EXPECT_EQ(grid->y, (std::vector<double>{0, 20})) << text;
    EXPECT_EQ(grid->z_m, (std::vector<float>{-1, -2, -3, -4})) << text;
  }
  const auto depths = read("x y depth\n0 0 1\n10 0 2\n0 20 3\n10 20 4\n");
  ASSERT_TRUE(depths);
  EXPECT_THAT(depths->notes, ::testing::ElementsAre(HasSubstr("set z_scale: -1")));
  for (const char* text : {"0,5 0,5 -1,5\n", "0,5;0,5;-1,5\n", "500000,5\t0\t-1\n"})
    EXPECT_THAT(read(text).error().text, HasSubstr("line 1: numbers have a decimal comma")) << text;
  for (const char* text : {"0 0 -1\n10 0 -2\n0 20 -3,5\n", "0;0;-1\n10;0;-2\n0;20;-3,5\n"})
    EXPECT_THAT(read(text).error().text, HasSubstr("line 3: numbers have a decimal comma")) << text;
  EXPECT_TRUE(read("0, 0, -1\n10, 0, -2\n0, 20, -3\n10, 20, -4\n")) << "commas between numbers";
}

TEST(XyzGrid, AnEmptyFieldIsAHoleAndShiftsNoOthers) {
  TemporaryFiles files;
  for (const char* text :
       {"x,y,z,id\n0,0,-1,5\n10,0,,5\n0,20,-3,5\n10,20,-4,5\n", "0;0;-1\n10;0;\n0;20;-3\n10;20;-4\n",
        "0, 0, -1\r\n10, 0, \r\n0, 20, -3\r\n10, 20, -4\r\n", "id,x,y,z\n1,0,0,-1\n2,10,0,\n3,0,20,\"-3\"\n4,10,20,-4\n",
        "y,x,z\n,,\n0,0,-1\n0,10,\n,,\n20,0,-3\n20,10,-4\n,,\n", "# y,x,z\n0,0,-1,\n0,10,,\n20,0,-3,\n20,10,-4,\n",
        "x\ty\tz\tid\n0\t0\t-1\t5\n10\t0\t\t5\n0\t20\t-3\t5\n10\t20\t-4\t5\n",
        "0\t0\t-1\r\n10\t0\t\r\n0\t20\t-3\r\n10\t20\t-4\r\n"}) {
    const auto grid = read_xyz_heights(files.write("p.csv", text), {});
    ASSERT_TRUE(grid) << text << grid.error().text;
    EXPECT_THAT(grid->z_m, ::testing::ElementsAre(-1, ::testing::IsNan(), -3, -4)) << text;
  }
  EXPECT_TRUE(read_xyz_heights(files.write("p.csv", "0\t\t0\t\t-1\n10\t\t0\t-2\n0\t20\t-3\n10\t20\t-4\n"), {}))
      << "tabs as blanks";
  EXPECT_THAT(read_xyz_heights(files.write("p.csv", "0,0,-1\n,0,-2\n"), {}).error().text, HasSubstr("line 2: three numbers"));
}

TEST(XyzGrid, FineStepsFarAwayStayInTheirCells) {
  TemporaryFiles files;
  std::string text;
  for (int i = 0; i < 2000; ++i)
    for (int j = 0; j < 2; ++j) {
      char line[80];
      std::snprintf(line, sizeof line, "%.7f %d %d\n", 99'999'000 + 1e-6 * i, j, -1 - i);
      text += line;
    }
  const auto grid = read_xyz_heights(files.write("g.xyz", text), {});
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_FLOAT_EQ(grid->z_m.front(), -1);
  EXPECT_FLOAT_EQ(grid->z_m.back(), -2000);
}

TEST(XyzGrid, WrongFilesAreRefused) {
  TemporaryFiles files;
  const auto refusal = [&](const std::string& text) {
    const auto grid = read_xyz_heights(files.write("bad.xyz", text), {});
    return grid ? std::string("accepted") : grid.error().text;
  };
  EXPECT_THAT(refusal(""), HasSubstr("has no line of three numbers"));
  EXPECT_THAT(refusal("lat,lon,depth\n60d1N,5d1E,x\n60d2N,5d2E,y\n"),
              HasSubstr("no line of three numbers, x y z; coordinates must"));
  EXPECT_THAT(refusal("north: 6650100\n"), HasSubstr("line 1: three numbers are needed, x y z; other grids: gdal_translate"));
  EXPECT_THAT(refusal("1 2\n"), HasSubstr("line 1: three numbers are needed"));
  EXPECT_THAT(refusal("1 2 3\nx y z\n"), HasSubstr("line 2: three numbers"));
  EXPECT_THAT(refusal("1 2 3\n1e9 2 3\n"), HasSubstr("line 2: the point is farther"));
  EXPECT_THAT(refusal("1 2 3\nnan 2 3\n"), HasSubstr("line 2: the point is farther"));
  EXPECT_THAT(refusal("1 2 3\n2 2 1e9\n"), HasSubstr("line 2: the height 1e9 is beyond"));
  EXPECT_THAT(refusal("0 0 1\n1 0.3 1\n2.5 1 1\n3.1 2.7 2\n"), HasSubstr("not a uniform grid; make a grid of them: gdal_grid"));
  EXPECT_THAT(refusal("0 0 1\n1 1 1\n99999 99999 1\n"), HasSubstr("more than 10 million"));
}

}  // namespace
}  // namespace sonar::xyz_grid_test
