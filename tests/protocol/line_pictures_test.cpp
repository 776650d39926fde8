// Tests pictures of sonars that send single lines.
#include "protocol/line_pictures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/geometry.hpp"
#include "core/image/draw_picture.hpp"

namespace sonar::protocol::line_pictures_test {
namespace {

TEST(Waterfall, EarlierLinesHaveTheRangesOfTheNewest) {
  Waterfall waterfall;
  HostPing ping;
  waterfall.add({-60, 0, -30, -6}, 0, 1, Time{}, ping);  // 0 to 4 m
  waterfall.add({0, -30}, 0.5, 0.5, Time{}, ping);       // 0.5 to 1.5 m
  waterfall.add({-30, 0, -60}, 0, 1, Time{}, ping);      // 0 to 3 m
  const SonarPicture seen = ping.drawing();
  EXPECT_EQ(ping.lines, 3u);
  EXPECT_EQ(seen.image.rows, 3u);
  EXPECT_EQ(seen.image.beams, 3u);
  EXPECT_EQ(seen.range_m(), 3);
  EXPECT_THAT(seen.image.samples, testing::ElementsAre(127.5, 255, 0, 255, 127.5, -1, 0, 255, 127.5));
}

TEST(Waterfall, AThinEchoStaysWhenTheNewestLineHasLargerRows) {
  Waterfall waterfall;
  HostPing ping;
  std::vector<float> thin(30, -60);
  thin[4] = thin[25] = 0;
  waterfall.add(thin, 0, 0.1, Time{}, ping);           // 0 to 3 m
  waterfall.add({-60, -60, -60}, 0, 1, Time{}, ping);  // 0 to 3 m
  EXPECT_THAT(ping.drawing().image.samples, testing::ElementsAre(0, 0, 0, 255, 0, 255));
}

TEST(Waterfall, ShowsTheRangeOfDecibelsOfItsSamples) {
  Waterfall waterfall(48);
  HostPing ping;
  waterfall.add({0, -24, -48, -68}, 0, 1, Time{}, ping);
  EXPECT_THAT(ping.drawing().image.samples, testing::ElementsAre(255, 127.5, 0, 0));
}

TEST(EmptyFan, APictureIsEmptyInsideAndOutsideOfTheFan) {
  SonarPicture points{.kind = PictureKind::points, .image = empty_fan(pi / 4, 10)};
  const Raster seen = *PicturePainter({360, *find_colour_map("gray"), false}).draw(points);  // the fan opens downwards
  EXPECT_EQ(seen.at(180, seen.height / 2).r, 0) << "the fan has no echo";
  for (const int x : {20, 340}) EXPECT_EQ(seen.at(x, 60).r, outside_colour.r) << x;
}

TEST(Waterfall, RowsHaveTheirAgesAndNoneIsInTheFuture) {
  Waterfall waterfall;
  HostPing ping;
  for (const int s : {10, 12, 9}) waterfall.add({0, 0}, 0, 1, Time{std::chrono::seconds(s)}, ping);
  EXPECT_THAT(ping.drawing().row_age_s, testing::ElementsAre(0, 0, 0));
  waterfall.add({0, 0}, 0, 1, Time{std::chrono::seconds(15)}, ping);
  EXPECT_THAT(ping.drawing().row_age_s, testing::ElementsAre(0, 6, 3, 5));
}

TEST(Waterfall, ALineWithoutALengthIsEmpty) {
  Waterfall waterfall;
  HostPing ping;
  waterfall.add({0, 0}, 0, 0, Time{}, ping);
  EXPECT_THAT(ping.drawing().image.samples, testing::Each(-1));
}

}  // namespace
}  // namespace sonar::protocol::line_pictures_test
