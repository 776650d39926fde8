// Pictures other than the fan of one ping: positions of the drawn samples, and errors.
#include "core/image/draw_picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/geometry.hpp"

namespace sonar::draw_picture_test {
namespace {

FanStyle style(bool rings = false) { return {360, *find_colour_map("gray"), rings}; }

PolarImage cells(std::size_t rows, std::size_t columns) {
  PolarImage image;
  image.rows = rows;
  image.beams = columns;
  image.row_spacing_m = 0.1;
  image.samples.assign(rows * columns, 0);
  return image;
}

/// Returns a full circle with one bright beam.
SonarPicture sweep(std::size_t bright) {
  SonarPicture picture{.kind = PictureKind::sweep, .image = cells(100, 40)};
  for (std::size_t beam = 0; beam < 40; ++beam)
    picture.image.azimuth_rad.push_back((20 - static_cast<double>(beam)) * 2 * pi / 40);
  for (std::size_t row = 0; row < 100; ++row) picture.image.samples[row * 40 + bright] = 255;
  return picture;
}

TEST(SonarPicture, ASweepOfAFullTurnShowsWhatIsAsternBelow) {
  const SonarPicture port = sweep(10), astern = sweep(39);
  const Raster left = *PicturePainter(style()).draw(port), below = *PicturePainter(style()).draw(astern);
  EXPECT_EQ(left.height, picture_height(port, style()));
  EXPECT_NEAR(left.height, left.width, 2) << "a circle";
  EXPECT_GT(left.at(60, 180).r, 200);
  EXPECT_LT(left.at(300, 180).r, 50);
  EXPECT_LT(left.at(180, 60).r, 50);
  EXPECT_GT(below.at(192, 300).r, 200) << "a little to starboard";
}

TEST(SonarPicture, RingsShowWhereTheHeadLooks) {
  SonarPicture picture = sweep(10);
  picture.head_rad = -pi / 2;
  const Raster with = *PicturePainter(style(true)).draw(picture), without = *PicturePainter(style()).draw(picture);
  EXPECT_GT(with.at(300, with.height / 2).b, 100) << "to starboard";
  EXPECT_LT(without.at(300, without.height / 2).b, 100);
}

TEST(SonarPicture, ARangeImageHasItsHighestRowOnTopAndPortLeft) {
  SonarPicture picture{.kind = PictureKind::range_image, .image = cells(4, 8), .elevation_rad = pi / 8};
  for (std::size_t column = 0; column < 8; ++column)
    picture.image.azimuth_rad.push_back(pi / 4 * (1 - static_cast<double>(column) / 3.5));
  picture.image.samples[1] = 255;
  const Raster raster = *PicturePainter(style()).draw(picture);
  EXPECT_EQ(raster.height, 180) << "as wide as its bearings, as high as its elevations";
  EXPECT_EQ(raster.at(60, 20).r, 255);
  EXPECT_EQ(raster.at(20, 20).r, 0);
  EXPECT_EQ(raster.at(60, 60).r, 0);
  picture.elevation_rad = 0;
  EXPECT_THAT(PicturePainter(style()).draw(picture).error().text, testing::HasSubstr("cannot be drawn"));
}

TEST(SonarPicture, AWaterfallBeginsOnTopAndIsEmptyBelow) {
  SonarPicture picture{.kind = PictureKind::waterfall, .image = cells(50, 20)};
  picture.image.samples[15] = 255;
  const Raster raster = *PicturePainter(style()).draw(picture);
  EXPECT_EQ(raster.height, 270);
  EXPECT_EQ(raster.at(280, 1).r, 255) << "the newest ping, at three quarters of its range";
  EXPECT_EQ(raster.at(280, 100).r, 0);
  EXPECT_NE(raster.at(280, 200).r, raster.at(280, 200).g) << "fewer pings than rows: what is outside";
  EXPECT_NEAR(picture.range_m(), 2, 1e-9);
  picture.image.samples.pop_back();
  EXPECT_FALSE(PicturePainter(style()).draw(picture));
}

/// Returns a waterfall whose rows are this far apart [s].
SonarPicture aged(std::size_t rows, const std::vector<double>& between_s) {
  SonarPicture picture{.kind = PictureKind::waterfall, .image = cells(rows, 20)};
  for (double age_s = 0; picture.row_age_s.size() < rows;) {
    picture.row_age_s.push_back(age_s);
    age_s += between_s[picture.row_age_s.size() % between_s.size()];
  }
  return picture;
}

TEST(SonarPicture, TimesBesideAWaterfallAreThoseOfItsRows) {
  const auto at_each_two_seconds = time_marks(aged(200, {0.1}));
  ASSERT_EQ(at_each_two_seconds.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(at_each_two_seconds[i].age_s, 2.0 * static_cast<double>(i + 1));
    EXPECT_NEAR(at_each_two_seconds[i].part, (20.5 + 20 * static_cast<double>(i)) / 200, 1e-9) << "the middle of its row";
  }
  const auto few = time_marks(aged(30, {0.1}));
  ASSERT_EQ(few.size(), 2u) << "the rows fill the upper part of a picture of 100";
  EXPECT_NEAR(few[1].part, 0.205, 1e-9);
}

TEST(SonarPicture, APauseBetweenPingsLeavesOutTimesOfAWaterfall) {
  std::vector<double> between_s(100, 0.1);
  between_s[50] = 60;
  const auto marks = time_marks(aged(100, between_s));
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_EQ(marks[0].age_s, 60);
  EXPECT_NEAR(marks[0].part, 0.5, 0.01);
}

TEST(SonarPicture, TimesOfAWaterfallKeepADistance) {
  std::vector<double> between_s(40, 0.1);
  std::fill(between_s.begin() + 30, between_s.end(), 10);
  const auto marks = time_marks(aged(40, between_s));
  ASSERT_EQ(marks.size(), 1u) << "100 s would be five rows below 50 s";
  EXPECT_EQ(marks[0].age_s, 50);
}

TEST(SonarPicture, AWaterfallWithoutTimesHasNone) {
  EXPECT_TRUE(time_marks(SonarPicture{.kind = PictureKind::waterfall, .image = cells(50, 20)}).empty());
  EXPECT_TRUE(time_marks(aged(50, {0})).empty());
}

TEST(SonarPicture, TimesOfAWaterfallAreDrawnAcrossIt) {
  const Raster raster = *PicturePainter(style(true)).draw(aged(100, {0.1}));
  const auto y = static_cast<int>(0.205 * (raster.height - 1));  // 2 s
  EXPECT_GT(raster.at(340, y).r, raster.at(340, y + 6).r);
}

TEST(Labels, LettersOfUnitsAreDrawn) {
  for (const char* const unit : {"m", "s"}) {
    Raster raster(8, 8);
    draw_text(raster, 0, 0, unit, {255, 255, 255}, 1);
    EXPECT_GT(std::ranges::count(raster.pixels, Rgb{255, 255, 255}), 4) << unit;
  }
}

TEST(SonarPicture, LabelsCanBeReadOverTheBrightestEchoes) {
  SonarPicture picture{.kind = PictureKind::waterfall, .image = cells(20, 100)};
  picture.image.samples.assign(20 * 100, 255);
  const Raster raster = *PicturePainter(style(true)).draw(picture);
  int dark = 0, bright = 0;
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 12; ++x) ++(raster.at(x, y).r < 100 ? dark : bright);
  EXPECT_GT(dark, 3 * bright) << "around the first label";
  EXPECT_GT(bright, 5) << "its dots";
  EXPECT_GT(raster.at(60, 20).r, 200) << "the echoes";
}

TEST(SonarPicture, PointsLieOverAFanThatOpensDownwards) {
  SonarPicture picture{.kind = PictureKind::points, .image = cells(100, 2), .elevation_rad = -1, .points = {{0.3, 5}, {0, 99}}};
  picture.image.azimuth_rad = {0.7, -0.7};
  const Raster raster = *PicturePainter(style()).draw(picture);
  const FanLayout layout = fan_layout(picture.image, style(), Opens::downwards);
  const auto x = static_cast<int>(layout.x_of(0.3, 5)), y = static_cast<int>(layout.y_of(0.3, 5));
  EXPECT_EQ(raster.at(x, y).r, 255);
  EXPECT_EQ(raster.at(raster.width - x, y).r, 0);
  EXPECT_LT(layout.apex_y, y);
  EXPECT_EQ(raster.height, fan_layout(picture.image, style()).height);
  EXPECT_LT(x, raster.width / 2) << "port is on the left";
}

TEST(SonarPicture, WhatAWaterfallHasNotMeasuredIsNotBlack) {
  SonarPicture picture{.kind = PictureKind::waterfall, .image = cells(100, 2)};
  for (std::size_t row = 0; row < 100; ++row) picture.image.samples[2 * row] = 0, picture.image.samples[2 * row + 1] = -1;
  const Raster raster = *PicturePainter(style()).draw(picture);
  EXPECT_EQ(raster.at(raster.width / 4, 10).b, 0);
  EXPECT_EQ(raster.at(3 * raster.width / 4, 10).b, outside_colour.b);
}

TEST(SonarPicture, GammaBrightensWhatIsDark) {
  for (const PictureKind kind : {PictureKind::fan, PictureKind::waterfall}) {
    SonarPicture picture{.kind = kind, .image = cells(100, 2)};
    picture.image.azimuth_rad = {0.7, -0.7};
    picture.image.samples.assign(200, 4);
    picture.image.samples[199] = 100;
    picture.image.shade({.per_mille = 1000, .gamma = 0.5f});
    ASSERT_EQ(picture.image.full_scale, 100);
    const Raster raster = *PicturePainter(style()).draw(picture);
    EXPECT_NEAR(raster.at(raster.width / 2, raster.height / 3).r, 255 * 0.2, 1);
    picture.image.shade({.per_mille = 990});
    EXPECT_EQ(picture.image.full_scale, 4) << "the brightest may saturate";
  }
}

TEST(SonarPicture, AFanThatOpensDownwardsIsTheOtherUpsideDown) {
  SonarPicture picture{.kind = PictureKind::fan, .image = cells(100, 2)};
  picture.image.azimuth_rad = {0.7, -0.7};
  for (std::size_t i = 0; i < picture.image.samples.size(); ++i) picture.image.samples[i] = static_cast<float>(i % 255);
  PicturePainter painter(style());
  const Raster up = *painter.draw(picture);
  picture.kind = PictureKind::points;
  picture.elevation_rad = -1;
  const Raster down = *painter.draw(picture);
  ASSERT_EQ(up.height, down.height);
  const int y = up.height / 3, x = up.width / 2 - 20;
  EXPECT_NEAR(up.at(x, y).r, down.at(x, fan_layout(picture.image, style()).height - 1 - y).r, 8);
  EXPECT_NE(up.at(x, y).r, down.at(x, y).r);
}

}  // namespace
}  // namespace sonar::draw_picture_test
