// Tests images: the position of an echo, the size, and the effects of settings.
#include "clients/bvtsdk/core/imaging.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <thread>

#include "tests/clients/bvtsdk/made_ping.hpp"

namespace sonar::bvt {
namespace {

MagImage image_of(const PolarPing& ping, ImageType type, const ImageSettings& settings = {}) {
  Imager imager;
  MagImage image;
  EXPECT_EQ(imager.make(ping, type, settings, image), success);
  return image;
}

struct Spot {
  double row = 0, col = 0;
  std::uint16_t strongest = 0;
};

/// Returns the centre of gravity of the bright pixels.
Spot spot_of(const MagImage& image) {
  Spot spot;
  double weight = 0;
  for (int row = 0; row < image.height; ++row)
    for (int col = 0; col < image.width; ++col) {
      const std::uint16_t v = image.pixels[static_cast<std::size_t>(row * image.width + col)];
      spot.strongest = std::max(spot.strongest, v);
      spot.row += row * static_cast<double>(v);
      spot.col += col * static_cast<double>(v);
      weight += v;
    }
  EXPECT_GT(weight, 0);
  spot.row /= weight;
  spot.col /= weight;
  return spot;
}

double mean_of(const MagImage& image) {
  return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0) / static_cast<double>(image.pixels.size());
}

TEST(XyImage, ShowsATargetAtItsPlaceAndNotMirrored) {
  for (const double bearing : {-40.0, -12.5, 0.0, 30.0})
    for (const double range : {2.0, 6.0, 10.5}) {
      const MagImage image = image_of(make_ping_with_target(range, bearing), ImageType::xy);
      const Spot spot = spot_of(image);
      const int row = static_cast<int>(std::lround(spot.row)), col = static_cast<int>(std::lround(spot.col));
      EXPECT_NEAR(image.pixel_range_m(row, col), range, 0.04) << range << " " << bearing;
      EXPECT_NEAR(image.pixel_bearing_deg(row, col), bearing, 0.6) << range << " " << bearing;
      // The image as OpenCV shows it: up is ahead, right is starboard.
      const double ahead = (image.origin_row - spot.row) * image.range_resolution_m;
      const double starboard = (spot.col - image.origin_col) * image.range_resolution_m;
      EXPECT_NEAR(ahead, range * std::cos(bearing / 57.29578), 0.04);
      EXPECT_NEAR(starboard, range * std::sin(bearing / 57.29578), 0.04);
    }
}

TEST(XyImage, HasTheSizesOfItsDefinition) {
  // 1 to 11 m, 400 bins: as many rows as bins; 45 degrees to each side.
  const MagImage image = image_of(make_ping_with_target(5, 0), ImageType::xy);
  const double shown_m = 11 - std::sqrt(0.5);
  EXPECT_EQ(image.height, 400);
  EXPECT_EQ(image.width, 2 * static_cast<int>(std::ceil(11 * std::sqrt(0.5) / (shown_m / 400))));
  EXPECT_NEAR(image.range_resolution_m, shown_m / 400, 1e-8);
  EXPECT_EQ(image.origin_row, 400 + 27);  // 0.707 m in pixels of 25.7 mm
  EXPECT_EQ(image.origin_col, image.width / 2);
  EXPECT_EQ(image.bearing_resolution_deg, 0);
  EXPECT_EQ(image.fov_min_deg, -45);
  EXPECT_EQ(image.pixels.size(), image.pixel_count());
}

TEST(XyImage, PutsPixelsWhereTheVendorsLibraryPutThem) {
  // A public table of every pixel's range and bearing, from a 45 degree head with a requested range of 2 to 15 m and 640 x 480,
  // follows x = (col - 197) 0.026401 m, y = (550 - row) 0.026401 m in 394 x 480. It lacks the ping's sector and stop range; here
  // they have the values from which these numbers follow.
  PolarPing ping = make_ping(256, 500, 2, 0.02508f, [](int, int) { return 100; });
  ping.fov_min_deg = -20.95f;
  ping.fov_max_deg = 20.95f;
  ASSERT_NEAR(ping.stop_m, 14.54, 1e-4);
  ImageSettings settings;
  settings.requested_height = 480;
  settings.requested_width = 640;
  const MagImage image = image_of(ping, ImageType::xy, settings);
  EXPECT_EQ(image.height, 480);
  EXPECT_EQ(image.width, 394);
  EXPECT_EQ(image.origin_row, 550);
  EXPECT_EQ(image.origin_col, 197);
  EXPECT_NEAR(image.range_resolution_m, 0.026401, 1e-6);
  for (int row = 0; row <= 480; row += 60)
    for (int col = 0; col <= 394; ++col) {
      const double x = (col - 197) * 0.026401, y = (550 - row) * 0.026401;
      EXPECT_NEAR(image.pixel_range_m(row, col), std::hypot(x, y), 0.001);
      EXPECT_NEAR(image.pixel_bearing_deg(row, col), 57.29577951 * std::atan2(x, y), 1e-6);
    }
  EXPECT_NEAR(image.pixel_range_m(12, 360), 14.841354, 0.0005);  // one entry of that table
  EXPECT_NEAR(image.pixel_bearing_deg(12, 360), 16.855444, 1e-5);
}

TEST(XyImage, ReachesToTheSonarIfConfigured) {
  const PolarPing ping = make_ping_with_target(4, 0);
  for (const bool sonar : {false, true}) {
    ASSERT_EQ(setenv("BVE_XY", sonar ? "sonar" : "sector", 1), 0);
    const ImageSettings settings;
    unsetenv("BVE_XY");
    const MagImage image = image_of(ping, ImageType::xy, settings);
    EXPECT_EQ(image.origin_row == image.height, sonar);
    const Spot spot = spot_of(image);
    EXPECT_NEAR((image.origin_row - spot.row) * image.range_resolution_m, 4, 0.04);
  }
}

TEST(XyImage, KeepsARequestedHeightAndAdjustsTheWidth) {
  const PolarPing ping = make_ping(256, 500, 2, 0.026f, [](int, int) { return 100; });
  ImageSettings settings;
  settings.requested_height = 480;
  settings.requested_width = 640;
  const MagImage image = image_of(ping, ImageType::xy, settings);
  EXPECT_EQ(image.height, 480);
  EXPECT_EQ(image.width, 750);  // 15 m sin 45 degrees to each side, pixels of (15 m - 2 m cos 45 degrees) / 480
  settings.requested_height = 0;
  const MagImage wide = image_of(ping, ImageType::xy, settings);
  EXPECT_NEAR(wide.width, 640, 2);
}

TEST(XyImage, FollowsTheResolutionPolicies) {
  const PolarPing ping = make_ping(64, 900, 0.5f, 0.01f, [](int, int) { return 100; });
  ImageSettings settings;
  const auto height = [&] {
    ImageGeometry g;
    EXPECT_EQ(plan_image(ping, ImageType::xy, settings, g), success);
    return g.height;
  };
  settings.resolution = ImageRes::low;
  EXPECT_EQ(height(), 256);
  settings.resolution = ImageRes::medium;
  EXPECT_EQ(height(), 512);
  settings.resolution = ImageRes::high;
  EXPECT_EQ(height(), 1000);
  settings.resolution = ImageRes::automatic;
  EXPECT_EQ(height(), 825);  // 900 rows would be more than a million pixels
  settings.range_resolution_m = 0.05f;
  EXPECT_EQ(height(), 183);  // 9.5 m less 0.35 m
  settings.range_resolution_m = 1e-9f;
  EXPECT_LE(height() * height() * std::sqrt(2) * 9.5 / 9.15, 1e6);
  settings.requested_height = 300;
  EXPECT_EQ(height(), 300);
}

TEST(XyImage, IsZeroOutsideTheSectorAndSmoothInside) {
  const PolarPing ping = make_ping(512, 400, 1, 0.025f, [](int, int) { return 40000; });
  const MagImage image = image_of(ping, ImageType::xy);
  int inside = 0;
  for (int row = 0; row < image.height; ++row)
    for (int col = 0; col < image.width; ++col) {
      const double range = image.pixel_range_m(row, col), bearing = image.pixel_bearing_deg(row, col);
      const int v = image.pixels[static_cast<std::size_t>(row * image.width + col)];
      if (range < 0.999 || range > 11.001 || std::abs(bearing) > 45.001) {
        EXPECT_EQ(v, 0) << row << " " << col;
      } else if (range > 1.001 && range < 10.999 && std::abs(bearing) < 44.999) {
        EXPECT_EQ(v, 40000) << row << " " << col;
        ++inside;
      }
    }
  const double sector_m2 = 3.14159265 / 4 * (11 * 11 - 1);
  EXPECT_NEAR(inside * image.range_resolution_m * image.range_resolution_m / sector_m2, 1, 0.01);
}

TEST(XyImage, InterpolatesBetweenBeamsAndBins) {
  // Samples that are linear in bearing and range give an image that is linear in them too.
  const PolarPing ping = make_ping(90, 200, 1, 0.05f, [](int j, int k) { return 1000 + 300 * j + 100 * k; });
  const MagImage image = image_of(ping, ImageType::xy);
  for (int row = 0; row < image.height; row += 7)
    for (int col = 0; col < image.width; col += 5) {
      const double beam = image.pixel_bearing_deg(row, col) + 45 - 0.5, bin = (image.pixel_range_m(row, col) - 1) / 0.05 - 0.5;
      if (beam < 0 || beam > 89 || bin < 0 || bin > 199) continue;
      EXPECT_NEAR(image.pixels[static_cast<std::size_t>(row * image.width + col)], 1000 + 300 * beam + 100 * bin, 1.5);
    }
}

TEST(XyImage, LosesNoEchoWhenItsRowsAreCoarse) {
  for (int bin = 100; bin < 130; ++bin) {
    const PolarPing ping = make_ping(64, 2400, 0, 0.01f, [&](int, int k) { return k == bin * 16 ? 50000 : 0; });
    ImageSettings settings;
    settings.requested_height = 250;
    const MagImage image = image_of(ping, ImageType::xy, settings);
    EXPECT_GT(spot_of(image).strongest, 40000) << bin;
    const MagImage flat = image_of(ping, ImageType::r_theta, settings);
    EXPECT_EQ(std::count(flat.pixels.begin(), flat.pixels.end(), 50000), 64) << bin;
  }
}

TEST(RThetaImage, HasTheNearestRowLastAndTheLeftBeamFirst) {
  const MagImage image = image_of(make_ping_with_target(4, -20), ImageType::r_theta);
  EXPECT_EQ(image.width, 512);
  EXPECT_EQ(image.height, 400);
  const Spot spot = spot_of(image);
  EXPECT_NEAR(image.stop_m - (spot.row + 0.5) * image.range_resolution_m, 4, 0.03);
  EXPECT_NEAR(-45 + (spot.col + 0.5) * image.bearing_resolution_deg, -20, 0.1);
  EXPECT_NEAR(image.pixel_bearing_deg(0, 256), 0, 1e-9);
  EXPECT_EQ(image.origin_col, 256);
  EXPECT_EQ(image.origin_row, 400 + 40);
  EXPECT_EQ(spot.strongest, 60000);
}

TEST(RThetaImage, IsThePingItselfAtItsOwnSize) {
  const PolarPing ping = make_ping(16, 250, 2, 0.04f, [](int j, int k) { return 1000 * j + k; });
  const MagImage image = image_of(ping, ImageType::r_theta);
  ASSERT_EQ(image.height, 250);
  for (int row = 0; row < 250; ++row)
    for (int col = 0; col < 16; ++col)
      ASSERT_EQ(image.pixels[static_cast<std::size_t>(row * 16 + col)], 1000 * col + (249 - row)) << row << " " << col;
}

TEST(RThetaImage, AcceptsOtherWidths) {
  const PolarPing ping = make_ping(16, 250, 2, 0.04f, [](int j, int) { return 1000 * j; });
  ImageSettings settings;
  settings.r_theta_width = 32;
  const MagImage wide = image_of(ping, ImageType::r_theta, settings);
  ASSERT_EQ(wide.width, 32);
  for (std::size_t col = 0; col < 32; ++col) EXPECT_EQ(wide.pixels[col], 1000 * (col / 2));
  settings.r_theta_width = 4;
  const MagImage narrow = image_of(ping, ImageType::r_theta, settings);
  ASSERT_EQ(narrow.width, 4);
  for (std::size_t col = 0; col < 4; ++col) EXPECT_EQ(narrow.pixels[col], 1000 * (4 * col + 3));
}

TEST(Image, AnswersForPixelsOutsideItself) {
  for (const ImageType type : {ImageType::xy, ImageType::r_theta}) {
    const MagImage image = image_of(make_ping_with_target(4, -20), type);
    for (const int row : {-1, image.height, 1 << 30})
      for (const int col : {-1, image.width, 1 << 30}) {
        EXPECT_TRUE(std::isfinite(image.pixel_range_m(row, col)));
        EXPECT_TRUE(std::isfinite(image.pixel_bearing_deg(row, col)));
        EXPECT_GE(image.pixel_range_m(row, col), 0);
      }
  }
}

TEST(Image, ScalesItsRangesWithTheSoundSpeed) {
  ImageSettings settings;
  settings.sound_speed_override_mps = 1650;  // 1.1 times the ping's 1500, so 1.1 times as far
  for (const ImageType type : {ImageType::xy, ImageType::r_theta}) {
    const MagImage image = image_of(make_ping_with_target(5, 10), type, settings);
    EXPECT_NEAR(image.start_m, 1.1, 1e-6);
    EXPECT_NEAR(image.stop_m, 12.1, 1e-5);
    const Spot spot = spot_of(image);
    EXPECT_NEAR(image.pixel_range_m(static_cast<int>(std::lround(spot.row)), static_cast<int>(std::lround(spot.col))), 5.5, 0.04);
  }
}

TEST(Image, CutsBelowAndAboveItsThresholds) {
  const PolarPing ping = make_ping(64, 200, 1, 0.05f, [](int, int k) { return k < 100 ? 10000 : 50000; });
  ImageSettings settings;
  settings.noise_threshold = 0.2f;  // 13107
  settings.clipping_threshold = 0.5f;
  const MagImage image = image_of(ping, ImageType::r_theta, settings);
  EXPECT_EQ(image.pixels.front(), 32768);
  EXPECT_EQ(image.pixels.back(), 0);
  settings.noise_threshold = 1.5f;
  EXPECT_EQ(mean_of(image_of(ping, ImageType::xy, settings)), 0);
}

TEST(Image, IsSmoothedByItsFilters) {
  const PolarPing ping = make_ping(64, 200, 1, 0.05f, [](int j, int k) { return j == 30 && k == 100 ? 54000 : 0; });
  ImageSettings settings;
  settings.filter_flags = mean_3x3 | mean_9x2;
  const MagImage square = image_of(ping, ImageType::r_theta, settings);
  EXPECT_EQ(std::count(square.pixels.begin(), square.pixels.end(), 6000), 9);
  EXPECT_EQ(std::count(square.pixels.begin(), square.pixels.end(), 0), 64 * 200 - 9);
  settings.filter_flags = mean_9x2;
  const MagImage tall = image_of(ping, ImageType::r_theta, settings);
  EXPECT_EQ(std::count(tall.pixels.begin(), tall.pixels.end(), 3000), 18);
  // A flat image stays flat to its edges.
  const PolarPing flat = make_ping(64, 200, 1, 0.05f, [](int, int) { return 65535; });
  for (const int flags : {2, 16}) {
    settings.filter_flags = flags;
    const MagImage image = image_of(flat, ImageType::r_theta, settings);
    EXPECT_EQ(std::count(image.pixels.begin(), image.pixels.end(), 65535), 64 * 200);
  }
}

TEST(Image, IsRefusedWithACode) {
  Imager imager;
  MagImage image;
  PolarPing ping = make_ping_with_target(4, 0);
  ImageSettings settings;
  settings.requested_height = -1;
  EXPECT_EQ(imager.make(ping, ImageType::xy, settings, image), bad_parameter);
  settings.requested_height = 100000;
  EXPECT_EQ(imager.make(ping, ImageType::xy, settings, image), invalid_image_size);
  settings.requested_height = 2000000000;
  EXPECT_EQ(imager.make(ping, ImageType::r_theta, settings, image), invalid_image_size);
  EXPECT_TRUE(image.pixels.empty());
  ping.samples.clear();
  EXPECT_EQ(imager.make(ping, ImageType::xy, {}, image), no_ping_signal);
}

TEST(Image, IsMadeOfPingsWithASingleBeamOrBin) {
  for (const int beams : {1, 2, 3})
    for (const int bins : {1, 2, 3}) {
      const PolarPing ping = make_ping(beams, bins, 1, 4, [](int, int) { return 777; });
      for (const ImageType type : {ImageType::xy, ImageType::r_theta}) {
        const MagImage image = image_of(ping, type);
        EXPECT_EQ(*std::max_element(image.pixels.begin(), image.pixels.end()), 777);
      }
    }
}

TEST(Imager, MakesTheSameImageFromAStoredTable) {
  Imager imager;
  MagImage first, again;
  const PolarPing ping = make_ping_with_target(4, 5), other = make_ping_with_target(6, 5, 60000, 256);
  ASSERT_EQ(imager.make(ping, ImageType::xy, {}, first), success);
  for (int i = 0; i < 3; ++i) {
    ImageSettings settings;
    settings.requested_height = 300 + i;
    for (int k = 0; k < 2; ++k) {
      ASSERT_EQ(imager.make(other, ImageType::xy, settings, again), success);
    }
    ASSERT_EQ(imager.make(ping, ImageType::xy, {}, again), success);
    EXPECT_EQ(again.pixels, first.pixels);
  }
}

TEST(Imager, ServesSeveralThreads) {
  Imager imager;
  const PolarPing ping = make_ping_with_target(4, 5, 60000, 64, 200);
  const auto image_in_rows = [&](int rows) {
    ImageSettings settings;
    settings.requested_height = rows;
    MagImage image;
    EXPECT_EQ(imager.make(ping, ImageType::xy, settings, image), success);
    return image.pixels;
  };
  std::vector<std::vector<std::uint16_t>> expected;
  for (int rows = 100; rows < 106; ++rows) expected.push_back(image_in_rows(rows));
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 30; ++i) {
        const int which = (i + 2 * t) % 6;
        EXPECT_EQ(image_in_rows(100 + which), expected[static_cast<std::size_t>(which)]);
      }
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(Image, SurvivesBinsFarShorterThanItsRows) {
  PolarPing ping = make_ping(4, 6, 1, 0.5f, [](int, int) { return 9; });
  ping.bin_m = 1e-38f;
  ImageSettings settings;
  settings.requested_height = 10;
  for (const ImageType type : {ImageType::xy, ImageType::r_theta}) EXPECT_EQ(image_of(ping, type, settings).height, 10);
}

}  // namespace
}  // namespace sonar::bvt
