// Ground that is made from a seed, and the mesh of a grid of heights.
#include "core/scene/shapes/terrain.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/core/scene/mesh_checks.hpp"

namespace sonar::terrain_test {
namespace {

using ::testing::HasSubstr;
using tests::expect_sound;

TEST(Noise, IsSmoothBoundedAndDrawnFromItsSeed) {
  double sum = 0, most = 0, step = 0;
  const GradientField field(50, 50, 2, 9, 1), again(80, 30, 2, 9, 1), other(50, 50, 2, 10, 1);
  int differs = 0;
  for (int i = 0; i < 4000; ++i) {
    const double x = -45 + 0.0225 * i, y = 20 * std::sin(i);
    const double v = field(x, y);
    EXPECT_NEAR(v, again(x, y), 1e-9);  // for any rectangle
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

TEST(Seabed, HasTheRequestedSizeSpacingAndRelief) {
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

TEST(Seabed, NotesRipplesThatAreTooFineForItsGrid) {
  const auto notes = [](double wavelength_m, double direction_rad, double height_m) {
    SeabedShape shape{.size_x_m = 8, .size_y_m = 4, .fine_x_m = 4, .fine_y_m = 4, .spacing_x_m = 0.2, .spacing_y_m = 0.05};
    shape.ripples = {.wavelength_m = wavelength_m, .height_m = height_m, .direction_rad = direction_rad};
    return make_seabed(shape).notes;
  };
  EXPECT_THAT(notes(0.5, 0, 0.1),
              testing::ElementsAre("its ripples of wavelength 0.5 m do not appear: the finest spacing of its "
                                   "grid is 0.2 m; set spacing_m: 0.0833, and fine_size_m if the bed is large"));
  EXPECT_THAT(notes(0.72, 0, 0.1), testing::ElementsAre(HasSubstr("keep at most 20 % of their height")));
  EXPECT_THAT(notes(0.6, 0, 0.1), testing::ElementsAre(HasSubstr("do not appear")))
      << "three grid points per wave, except for rounding";
  EXPECT_THAT(notes(1.3, 0, 0.1), testing::IsEmpty());
  EXPECT_THAT(notes(0.5, pi / 2, 0.1), testing::IsEmpty()) << "the grid is finer along y";
  EXPECT_THAT(notes(0.5, 0, 0), testing::IsEmpty()) << "no ripples";
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

TEST(HeightGrid, TooManyTrianglesAreRefused) {
  HeightGrid grid;
  grid.x.resize(5000);
  grid.y.resize(5000);
  EXPECT_THAT(mesh_from_grid(grid).error().text, HasSubstr("more than 20 million triangles"));
}

}  // namespace
}  // namespace sonar::terrain_test
