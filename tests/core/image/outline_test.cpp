#include "core/image/draw_fan.hpp"

#include <gtest/gtest.h>

#include <string>

#include "core/image/raster.hpp"

namespace sonar {
namespace {

std::vector<Outline> outlines_of(const std::vector<std::string>& picture) {
  return outlines(0, 0, static_cast<int>(picture[0].size()), static_cast<int>(picture.size()),
                  [&](int x, int y) { return picture[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '#'; });
}

TEST(Outline, GoesRoundAPixelClockwise) {
  EXPECT_EQ(outlines_of({"...", ".#.", "..."}), (std::vector<Outline>{{{1, 1}, {2, 1}, {2, 2}, {1, 2}}}));
}

TEST(Outline, TurnsAtCornersOnly) {
  EXPECT_EQ(outlines_of({"###", "#.."}), (std::vector<Outline>{{{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2}, {0, 2}}}));
}

TEST(Outline, LeavesHolesOut) {
  EXPECT_EQ(outlines_of({"###", "#.#", "###"}), (std::vector<Outline>{{{0, 0}, {3, 0}, {3, 3}, {0, 3}}}));
}

TEST(Outline, PixelsThatTouchAtACornerAreTwoRegions) {
  const auto found = outlines_of({"#.", ".#"});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[1], (Outline{{1, 1}, {2, 1}, {2, 2}, {1, 2}}));
  EXPECT_EQ(outlines_of({".#", "#."}).size(), 2u);
}

TEST(Outline, NoPixelsGiveNoOutline) { EXPECT_TRUE(outlines_of({"..", ".."}).empty()); }

TEST(GrayPng, RefusesAWrongNumberOfBytesOrBits) {
  const std::vector<std::byte> values(6);
  EXPECT_TRUE(encode_gray_png(values, 3, 2, 8));
  EXPECT_TRUE(encode_gray_png(values, 3, 1, 16));
  EXPECT_FALSE(encode_gray_png(values, 3, 2, 16));
  EXPECT_FALSE(encode_gray_png(values, 3, 2, 12));
}

}  // namespace
}  // namespace sonar
