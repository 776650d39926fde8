// Tests the images of a Sonar 3D-15 that its host draws, and their figures.
#include "protocol/waterlinked/waterlinked.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/geometry.hpp"

namespace sonar::waterlinked::host_test {
namespace {

using testing::HasSubstr;

constexpr std::uint32_t columns = 5, rows = 3;

RangeMessage nothing_there() {
  RangeMessage m;
  m.shot.sequence = 7;
  m.shot.range_m = 15;
  m.shot.width = columns;
  m.shot.height = rows;
  m.shot.horizontal_deg = 90;
  m.shot.vertical_deg = 40;
  m.pixel_scale_m = 0.5;
  m.pixels.assign(columns * rows, 0);
  return m;
}

TEST(WaterlinkedHost, DrawsAReturnAtItsColumnAndHorizontalRange) {
  auto ranges = nothing_there();
  StrengthMessage strengths{ranges.shot, std::vector<std::uint8_t>(columns * rows)};
  ranges.pixels[0] = 20;  // the lowest row, most to port: 10 m at 45 degrees to port, 20 down
  strengths.pixels[0] = 99;
  const auto ping = ping_from(ranges, &strengths);
  ASSERT_TRUE(ping);
  const PolarImage image = *ping->picture();
  ASSERT_EQ(image.beams, columns);
  EXPECT_DOUBLE_EQ(image.azimuth_rad.front(), pi / 4);
  EXPECT_DOUBLE_EQ(image.azimuth_rad.back(), -pi / 4);
  const auto at = static_cast<std::size_t>(10 * std::cos(rad_from_deg(20)) / image.row_spacing_m);
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = 0; beam < image.beams; ++beam)
      EXPECT_EQ(image.at(row, beam), row == at && beam == 0 ? 99 : 0) << row << " " << beam;
  EXPECT_EQ(ping->facts.number, 7u);
  EXPECT_EQ(ping->facts.frequency_hz, 1.2e6);
  EXPECT_THAT(ping->facts.note, HasSubstr("1 returns from 10.00 to 10.00 m"));
}

TEST(WaterlinkedHost, DrawsRangesWithoutStrengthsWithANote) {
  auto ranges = nothing_there();
  EXPECT_THAT(ping_from(ranges, nullptr)->facts.note, HasSubstr("no returns; no strengths given"));
  ranges.pixels[columns + 2] = 10;
  EXPECT_EQ(ping_from(ranges, nullptr)->picture()->at(100, 2), 255) << "the return is 5 m of 15 m ahead";
  EXPECT_FALSE(ping_from(ranges, nullptr)->drawing().nothing_detected());
  EXPECT_TRUE(ping_from(nothing_there(), nullptr)->drawing().nothing_detected());
}

TEST(WaterlinkedHost, RefusesImagesWithImpossibleFields) {
  const auto refuses = [](auto change) {
    auto ranges = nothing_there();
    change(ranges);
    return !ping_from(ranges, nullptr);
  };
  EXPECT_FALSE(refuses([](auto&) {}));
  EXPECT_TRUE(refuses([](auto& r) { r.pixels.pop_back(); }));
  EXPECT_TRUE(refuses([](auto& r) { r.shot.width = 1; }));
  EXPECT_TRUE(refuses([](auto& r) { r.shot.width = r.shot.height = 0xFFFFFFFFu; }));
  EXPECT_TRUE(refuses([](auto& r) { r.shot.range_m = 0; }));
  EXPECT_TRUE(refuses([](auto& r) { r.shot.range_m = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refuses([](auto& r) { r.shot.horizontal_deg = 0; }));
  EXPECT_TRUE(refuses([](auto& r) { r.pixel_scale_m = std::numeric_limits<float>::infinity(); }));
  auto ranges = nothing_there();
  const StrengthMessage of_another{ranges.shot, std::vector<std::uint8_t>(columns)};
  EXPECT_FALSE(ping_from(ranges, &of_another));
}

}  // namespace
}  // namespace sonar::waterlinked::host_test
