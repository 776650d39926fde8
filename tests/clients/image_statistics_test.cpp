// Tests the figures that describe a picture, on made-up images with known figures and on a real device's pings.
#include "clients/sonarctl/image_statistics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "clients/sonarctl/ping_stream.hpp"
#include "clients/sonarctl/source.hpp"
#include "core/base/random.hpp"

namespace sonar::clients {
namespace {

PolarImage image_of(std::size_t rows, std::size_t beams, float (*value)(std::size_t row, std::size_t beam)) {
  PolarImage image;
  image.rows = rows;
  image.beams = beams;
  image.row_spacing_m = 0.01;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t beam = 0; beam < beams; ++beam) image.samples.push_back(value(row, beam));
  return image;
}

float noise(std::size_t row, std::size_t beam) {
  return uniform_open(philox(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(beam), 0, 0, 7, 0).v[0]);
}

TEST(Correlation, IsZeroForIndependentSamplesAndHalfForSharedHalves) {
  const PolarImage independent = image_of(200, 200, noise);
  EXPECT_NEAR(correlation(independent, whole(independent), 0, 1), 0, 0.03);
  const PolarImage shared = image_of(200, 200, [](std::size_t r, std::size_t b) { return noise(r, b) + noise(r, b + 1); });
  EXPECT_NEAR(correlation(shared, whole(shared), 0, 1), 0.5, 0.03);
  EXPECT_NEAR(correlation(shared, whole(shared), 1, 0), 0, 0.03);
  const PolarImage flat = image_of(20, 20, [](std::size_t, std::size_t) { return 5.0f; });
  EXPECT_EQ(correlation(flat, whole(flat), 1, 0), 0);
}

TEST(Windows, AreParsedWithOpenEndsAndRefusedOutside) {
  const PolarImage image = image_of(100, 50, noise);
  const Window w = *parse_window("10:20,5:", image);
  EXPECT_EQ(w.row_begin, 10u);
  EXPECT_EQ(w.row_end, 20u);
  EXPECT_EQ(w.beam_begin, 5u);
  EXPECT_EQ(w.beam_end, 50u);
  EXPECT_EQ(parse_window("", image)->row_end, 100u);
  for (const char* bad : {"20:10", "10:101", "a:b", "10", "5:5", "1:2,3", "-1:5", "1:2,3:4x"}) {
    ASSERT_FALSE(parse_window(bad, image)) << bad;
    EXPECT_THAT(parse_window(bad, image).error().text, testing::HasSubstr("100 rows by 50 beams"));
  }
}

TEST(Means, FollowTheirWindows) {
  const PolarImage image = image_of(120, 4, [](std::size_t row, std::size_t) { return static_cast<float>(row / 50); });
  EXPECT_THAT(block_means(image, 50), testing::ElementsAre(0, 1, 2));
  EXPECT_DOUBLE_EQ(mean(image, {40, 60, 0, 4}), 0.5);
  EXPECT_DOUBLE_EQ(share_at_least(image, whole(image), 2), 20.0 / 120);
  EXPECT_THAT(percentiles(image, whole(image), {0, 0.5, 1}), testing::ElementsAre(0, 1, 2));
}

TEST(FirstEcho, IsWhereTheQuietEnds) {
  const PolarImage echo = image_of(200, 9, [](std::size_t row, std::size_t) {
    return row < 5 ? 45.0f : row < 90 ? 6.0f : 80.0f;
  });
  EXPECT_EQ(first_echo_row(echo), 90u);
  const PolarImage quiet = image_of(200, 9, [](std::size_t, std::size_t) { return 6.0f; });
  EXPECT_EQ(first_echo_row(quiet), 200u);
}

// Source: the published figures of the capture three_pings_8bit.raw (rows 400-649).
TEST(Capture, HasItsPublishedFigures) {
  const char* folder = std::getenv("SONARD_CAPTURES");
  if (folder == nullptr) GTEST_SKIP() << "SONARD_CAPTURES names no folder of recordings";
  std::filesystem::path file = std::filesystem::path(folder) / "oculus/three_pings_8bit.raw";
  if (!std::filesystem::exists(file)) file = std::filesystem::path(folder) / "three_pings_8bit.raw";
  const auto ping = read_ping(file, 0);
  ASSERT_TRUE(ping) << ping.error().text;
  ASSERT_TRUE(read_ping(file, 2));
  ASSERT_FALSE(read_ping(file, 3));
  const PolarImage image = *ping->picture();
  const Window w = *parse_window("400:650", image);
  EXPECT_NEAR(correlation(image, w, 0, 1), 0.80, 0.005);
  EXPECT_NEAR(correlation(image, w, 0, 2), 0.61, 0.005);
  EXPECT_NEAR(correlation(image, w, 1, 0), 0.58, 0.005);
  EXPECT_NEAR(correlation(image, w, 2, 0), 0.54, 0.005);
  EXPECT_EQ(percentiles(image, whole(image), {0.5}).front(), 43);
  EXPECT_EQ(share_at_least(image, whole(image), 255), 0) << "the device saturates at 254";
  EXPECT_NEAR(block_means(image, 50)[6], 142, 1);
}

}  // namespace
}  // namespace sonar::clients
