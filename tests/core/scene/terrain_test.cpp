// Ground: made from a seed, read from ESRI grids and PNG images; far coordinates, holes, and files that are wrong.
#include "core/scene/shapes/terrain.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/scene/files/height_values.hpp"
#include "core/scene/shapes/relief_noise.hpp"
#include "core/text/format.hpp"
#include "tests/core/scene/mesh_checks.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::terrain_test {
namespace {

using ::testing::HasSubstr;
using tests::expect_sound;
using tests::TemporaryFiles;

TEST(Noise, IsSmoothBoundedAndDrawnFromItsSeed) {
  double sum = 0, most = 0, step = 0;
  const GradientField field(50, 50, 2, 9, 1), again(80, 30, 2, 9, 1), other(50, 50, 2, 10, 1);
  int differs = 0;
  for (int i = 0; i < 4000; ++i) {
    const double x = -45 + 0.0225 * i, y = 20 * std::sin(i);
    const double v = field(x, y);
    EXPECT_NEAR(v, again(x, y), 1e-9);  // whatever the rectangle
    differs += std::abs(v - other(x, y)) > 1e-3;
    sum += v * v;
    most = std::max(most, std::abs(v));
    step = std::max(step, std::abs(field(x + 1e-4, y) - v));
    EXPECT_LE(std::abs(value_noise({x, y, 0.3 * x}, 3, 0)), 1);
  }
  EXPECT_GT(differs, 3500);
  EXPECT_LE(most, 1.01);
  EXPECT_NEAR(std::sqrt(sum / 4000), 0.35, 0.1);
  EXPECT_LT(step, 1e-3);
}

TEST(Seabed, HasTheSizeSpacingAndReliefAskedFor) {
  SeabedShape shape{.size_x_m = 30, .size_y_m = 20, .fine_x_m = 30, .fine_y_m = 20, .spacing_x_m = 0.25, .spacing_y_m = 0.5};
  shape.relief_m = 0.2;
  const HeightGrid grid = make_seabed(shape);
  EXPECT_EQ(grid.x.size(), 121u);
  EXPECT_EQ(grid.y.size(), 41u);
  EXPECT_DOUBLE_EQ(grid.x.front(), -15);
  EXPECT_DOUBLE_EQ(grid.x.back(), 15);
  const auto [low, high] = std::minmax_element(grid.z_m.begin(), grid.z_m.end());
  EXPECT_GT(*high - *low, 0.2f);
  EXPECT_LT(*high - *low, 0.8f);
  EXPECT_EQ(make_seabed(shape).z_m, grid.z_m);
  shape.seed = 2;
  EXPECT_NE(make_seabed(shape).z_m, grid.z_m);
  auto mesh = mesh_from_grid(grid);
  ASSERT_TRUE(mesh);
  expect_sound(mesh->mesh);
  EXPECT_EQ(mesh->mesh.triangles.size(), 2u * 120 * 40);
}

TEST(Seabed, RipplesHaveTheirWavelengthAndHeight) {
  SeabedShape shape{.size_x_m = 20, .size_y_m = 4, .fine_x_m = 20, .fine_y_m = 4, .spacing_x_m = 0.02, .spacing_y_m = 1};
  shape.relief_m = 0;
  shape.ripples = {.wavelength_m = 0.5, .height_m = 0.06, .direction_rad = 0, .bend = 0};
  const HeightGrid grid = make_seabed(shape);
  const std::size_t n = grid.x.size();
  int crossings = 0;
  float low = 1, high = -1;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    crossings += (grid.z_m[2 * n + i] < 0) != (grid.z_m[2 * n + i + 1] < 0);
    low = std::min(low, grid.z_m[i]), high = std::max(high, grid.z_m[i]);
  }
  EXPECT_NEAR(crossings, 2 * 20 / 0.5, 2);
  EXPECT_GT(high - low, 0.035f);
  EXPECT_LT(high - low, 0.0605f);
}

TEST(Seabed, WidensOutsideItsFinePartAndKeepsItsEstimate) {
  const SeabedShape shape{.size_x_m = 60, .size_y_m = 60, .fine_x_m = 10, .fine_y_m = 10, .spacing_x_m = 0.1, .spacing_y_m = 0.1};
  const HeightGrid grid = make_seabed(shape);
  EXPECT_DOUBLE_EQ(grid.x.back(), 30);
  double widest = 0;
  for (std::size_t i = 1; i < grid.x.size(); ++i) {
    const double step = grid.x[i] - grid.x[i - 1];
    EXPECT_GT(step, 0.05);
    widest = std::max(widest, step);
  }
  EXPECT_GT(widest, 0.9);
  EXPECT_LT(widest, 1.6);
  EXPECT_EQ(seabed_triangles(shape), 2 * (grid.x.size() - 1) * (grid.y.size() - 1));
}

const char* const small_grid =
    "ncols 3\nnrows 3\nxllcorner 500000\nyllcorner 5200000.5\ncellsize 2\nNODATA_value -9999\n"
    "1 2 3\n4 5 6\n7 8 -9999\n";

TEST(EsriGrid, KeepsFarCoordinatesInTheCentre) {
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

TEST(EsriGrid, HeadersOfOtherProgramsSayTheSame) {
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

TEST(EsriGrid, KnowsNoDataInEveryForm) {
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
  EXPECT_EQ(holes_in("\xEF\xBB\xBF" + grid_of(metre, "-9999"), false), "1");  // as editors on Windows begin a text
  EXPECT_EQ(holes_in(grid_of(at + "dx 1\ndy 2", "-9999"), false), "1");
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -3.40282e+38", "-3.4028234663852886e+38"), false), "1");
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -3.4E+38", "-3.4028234663852886e+38"), false), "1");
  for (const char* few_digits : {"1e20", "-1e38", "2e7"})  // one digit would make every height one of them
    EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value " + few_digits, few_digits), false), "1") << few_digits;
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -99999.99", "-99999.9921875"), false), "1");
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value 0", "0"), false), "1");
  for (const char* fill :
       {"-32768", "-99999", "-9999999", "-2147483648", "2147483647", "4294967295", "-3.4028234663852886e+38", "9.96921e+36"})
    EXPECT_EQ(holes_in(grid_of(metre, fill), true), "1") << fill;
  EXPECT_EQ(holes_in(grid_of(metre + "\nNODATA_value -32768", "-9999"), true), "1");
  // Among such depths -9999 m is ground, not a hole.
  const auto trench = read_esri_heights(
      files.write("g.asc",
                  "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 100\nNODATA_value -32768\n-9999 -9998 -9950 -10010\n"),
      {});
  ASSERT_TRUE(trench);
  EXPECT_TRUE(trench->notes.empty()) << trench->notes[0];
  EXPECT_FLOAT_EQ(trench->z_m[2], -9999);
}

TEST(EsriGrid, OblongCells) {
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
  // Lengths of a degree at 60 degrees north: 111 412.4 m along the meridian, 55 799.8 m along the parallel (WGS84: the
  // meridian's radius, and N cos(latitude)), here of 39 arc seconds.
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
  EXPECT_NEAR(high.x - low.x, 39 * 55799.8 / 3600, 0.2);  // the widest row is 19 arc seconds farther south
  EXPECT_NEAR(mesh->centre_m.x, 0, 0.1);
  EXPECT_NEAR(mesh->centre_m.y, 0, 0.1);

  // Every vertex where the geodesy of poses puts the same place, its height apart.
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

TEST(EsriGrid, SaysWhatItTakesForDegrees) {
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

// A grey image written with libpng's simple interface.
std::filesystem::path write_png(const TemporaryFiles& files, unsigned width, unsigned height, unsigned format,
                                const void* pixels) {
  const auto file = files.path("h.png");
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = format;
  EXPECT_TRUE(png_image_write_to_file(&image, file.c_str(), 0, pixels, 0, nullptr));
  return file;
}

TEST(PngHeights, SixteenBitsKeepTheirSteps) {
  TemporaryFiles files;
  const std::uint16_t pixels[6] = {0, 1, 65535, 256, 512, 32768};
  const auto grid = read_png_heights(write_png(files, 3, 2, PNG_FORMAT_LINEAR_Y, pixels), 20, 10, -6.5535, 0);
  ASSERT_TRUE(grid) << grid.error().text;
  EXPECT_DOUBLE_EQ(grid->x.front(), -10);
  EXPECT_DOUBLE_EQ(grid->y.back(), 5);
  EXPECT_NEAR(grid->z_m[3], -6.5535, 1e-6);  // first row of the image is the last row of the grid
  EXPECT_NEAR(grid->z_m[4], -6.5534, 1e-6);
  EXPECT_NEAR(grid->z_m[5], 0, 1e-6);
  EXPECT_NEAR(grid->z_m[0], -6.5535 + 0.0256, 1e-6);
}

TEST(PngHeights, WrongFilesAreRefused) {
  TemporaryFiles files;
  const std::uint8_t colour[12] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  const auto refusal = [&](const std::filesystem::path& file) {
    const auto grid = read_png_heights(file, 1, 1, 0, 1);
    return grid ? std::string("accepted") : grid.error().text;
  };
  EXPECT_THAT(refusal(write_png(files, 2, 2, PNG_FORMAT_RGB, colour)), HasSubstr("not a grey image"));
  EXPECT_THAT(refusal(write_png(files, 1, 2, PNG_FORMAT_GRAY, colour)), HasSubstr("smaller than 2 x 2"));
  EXPECT_THAT(refusal(files.write("no.png", "not a picture")), HasSubstr("not usable as heights"));
  EXPECT_THAT(refusal("no/such.png"), HasSubstr("cannot be opened"));
  const auto good = write_png(files, 3, 2, PNG_FORMAT_GRAY, colour);
  EXPECT_EQ(refusal(good), "accepted");
  const std::string bytes = files.read(good);
  for (std::size_t n = 0; n + 12 < bytes.size(); ++n) {  // without its last chunk alone, the picture is whole
    EXPECT_THAT(refusal(files.write("cut.png", bytes.substr(0, n))), HasSubstr("not usable as heights")) << n;
  }
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    std::string bent = bytes;
    bent[n] = static_cast<char>(bent[n] ^ 0x55);
    refusal(files.write("bent.png", bent));
  }
}

// Drawing programs store grey so.
TEST(PngHeights, GreyStoredAsColoursIsRead) {
  TemporaryFiles files;
  const std::uint8_t levels[6] = {0, 1, 255, 16, 32, 128};
  std::vector<std::uint8_t> rgb, rgba;
  for (const std::uint8_t v : levels) {
    rgb.insert(rgb.end(), {v, v, v});
    rgba.insert(rgba.end(), {v, v, v, 255});
  }
  const auto expect_levels = [&](const std::filesystem::path& file, const char* what) {
    const auto grid = read_png_heights(file, 20, 10, -255, 0);
    ASSERT_TRUE(grid) << what << grid.error().text;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(grid->z_m[3 + i], levels[i] - 255, 1e-3) << what;
  };
  expect_levels(write_png(files, 3, 2, PNG_FORMAT_RGB, rgb.data()), "RGB");
  expect_levels(write_png(files, 3, 2, PNG_FORMAT_RGBA, rgba.data()), "RGBA");
  std::vector<std::uint16_t> wide;
  for (const std::uint8_t v : levels) wide.insert(wide.end(), 3, static_cast<std::uint16_t>(v * 257));
  const auto linear = read_png_heights(write_png(files, 3, 2, PNG_FORMAT_LINEAR_RGB, wide.data()), 20, 10, -255, 0);
  ASSERT_TRUE(linear) << linear.error().text;
  EXPECT_NEAR(linear->z_m[4], -254, 1e-3);

  const auto file = files.path("palette.png");  // indices into equal colours
  const std::uint8_t indices[6] = {0, 1, 2, 3, 4, 5};
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 3, image.height = 2, image.format = PNG_FORMAT_RGB_COLORMAP, image.colormap_entries = 6;
  ASSERT_TRUE(png_image_write_to_file(&image, file.c_str(), 0, indices, 0, rgb.data()));
  expect_levels(file, "palette");
  rgb[17] = 129;
  EXPECT_THAT(read_png_heights(write_png(files, 3, 2, PNG_FORMAT_RGB, rgb.data()), 1, 1, 0, 1).error().text,
              HasSubstr("not a grey image: it has colours"));
}

// gdal_translate marks cells without data so.
TEST(PngHeights, TransparentPixelsAreHoles) {
  TemporaryFiles files;
  const std::vector<std::uint8_t> grey_alpha{10, 255, 20, 0, 30, 255, 40, 255, 50, 1, 60, 255};
  std::vector<std::uint8_t> rgba;
  for (std::size_t k = 0; k < 6; ++k)
    for (const std::size_t at : {2 * k, 2 * k, 2 * k, 2 * k + 1}) rgba.push_back(grey_alpha[at]);
  rgba[4] = 99;  // the colour of a transparent pixel is not seen
  for (const auto& file :
       {write_png(files, 3, 2, PNG_FORMAT_GA, grey_alpha.data()), write_png(files, 3, 2, PNG_FORMAT_RGBA, rgba.data())}) {
    const auto grid = read_png_heights(file, 20, 10, 0, 255);
    ASSERT_TRUE(grid) << grid.error().text;
    EXPECT_TRUE(std::isnan(grid->z_m[4]));
    EXPECT_NEAR(grid->z_m[3], 10, 1e-3);
    EXPECT_NEAR(grid->z_m[1], 50, 1e-3) << "not wholly transparent";
    EXPECT_THAT(grid->notes, ::testing::ElementsAre(HasSubstr("1 of its 6 pixels are transparent: holes")));
  }
}

TEST(PngHeights, InterlacedRowsAreWhole) {
  TemporaryFiles files;
  const auto file = files.path("interlaced.png");
  constexpr unsigned width = 9, height = 11;  // all seven passes
  std::vector<std::vector<png_byte>> rows;
  std::vector<png_bytep> pointers;
  for (unsigned j = 0; j < height; ++j) {
    auto& row = rows.emplace_back();
    for (unsigned i = 0; i < width; ++i) row.push_back(static_cast<png_byte>(20 * j + i));
  }
  for (auto& row : rows) pointers.push_back(row.data());
  std::FILE* out = std::fopen(file.c_str(), "wb");
  ASSERT_TRUE(out);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, out);
  png_set_IHDR(png, info, width, height, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_ADAM7, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_rows(png, info, pointers.data());
  png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(out);
  const auto grid = read_png_heights(file, 8, 10, 0, 255);
  ASSERT_TRUE(grid) << grid.error().text;
  for (unsigned j = 0; j < height; ++j)
    for (unsigned i = 0; i < width; ++i) EXPECT_NEAR(grid->z_m[(height - 1 - j) * width + i], 20 * j + i, 1e-3);
}

TEST(XyzGrid, PointsOfAnEvenGridInAnyOrder) {
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
  EXPECT_THAT(notes("easting northing z\n" + north_first), ::testing::Not(exchanged)) << "such as feet of a state's plane";
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

TEST(XyzGrid, NamesInACommentAlsoTellTheHeightAndDepths) {
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
        "0 0 -1 9 9\n10 0 -2 9 9\n0 20 -3 9 9\n10 20 -4 9 9\n"}) {
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
  EXPECT_THAT(read("0 0 -1\n10 0 -2\n0 20 -3,5\n").error().text, HasSubstr("line 3: numbers have a decimal comma"));
  EXPECT_TRUE(read("0, 0, -1\n10, 0, -2\n0, 20, -3\n10, 20, -4\n")) << "commas between numbers";
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
  EXPECT_THAT(refusal("0 0 1\n1 0.3 1\n2.5 1 1\n3.1 2.7 2\n"), HasSubstr("not a uniform grid; make one of them: gdal_grid"));
  EXPECT_THAT(refusal("0 0 1\n1 1 1\n99999 99999 1\n"), HasSubstr("more than 10 million"));
}

TEST(CoordinateSystems, OfPrjFilesOfSeveralWriters) {
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

TEST(EsriGrid, LengthsOfItsPrjBecomeMetres) {
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

TEST(HeightGrid, TooManyTrianglesAreRefused) {
  HeightGrid grid;
  grid.x.resize(5000);
  grid.y.resize(5000);
  EXPECT_THAT(mesh_from_grid(grid).error().text, HasSubstr("more than 20 million triangles"));
}

}  // namespace
}  // namespace sonar::terrain_test
