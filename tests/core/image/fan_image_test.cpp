// The fan: port must be on the left, far ranges at the top, and each sample must be visible in the pixels.
#include "core/image/draw_fan.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "core/base/geometry.hpp"
#include "tests/small_disk.hpp"

namespace sonar {
namespace {

PolarImage black_fan(std::size_t rows, std::size_t beams, double half_aperture_deg) {
  PolarImage image;
  image.rows = rows;
  image.beams = beams;
  image.row_spacing_m = 10.0 / static_cast<double>(rows);
  for (std::size_t i = 0; i < beams; ++i)
    image.azimuth_rad.push_back(
        rad_from_deg(half_aperture_deg * (1 - 2 * static_cast<double>(i) / static_cast<double>(beams - 1))));
  image.samples.assign(rows * beams, 0);
  return image;
}

FanStyle plain_gray(int width = 400) { return {width, *find_colour_map("gray"), false}; }

struct Centroid {
  double x = 0, y = 0, brightness = 0;
};
/// Returns the centroid of the pixels that are brighter than the background.
Centroid brightest_place(const Raster& raster) {
  Centroid c;
  for (int y = 0; y < raster.height; ++y) {
    for (int x = 0; x < raster.width; ++x) {
      const double value = raster.at(x, y).r > 40 ? raster.at(x, y).r : 0;
      c.x += value * x, c.y += value * y, c.brightness += value;
    }
  }
  c.x /= c.brightness, c.y /= c.brightness;
  return c;
}

TEST(Fan, PutsPortLeftStarboardRightAndFarUp) {
  PolarImage port = black_fan(100, 64, 60), starboard = port, near = port;
  for (std::size_t row = 79; row < 82; ++row) {
    port.samples[row * 64 + 5] = 255;
    starboard.samples[row * 64 + 58] = 255;
  }
  for (std::size_t row = 29; row < 32; ++row) near.samples[row * 64 + 31] = 255;
  const Centroid p = brightest_place(*draw_fan(port, plain_gray()));
  const Centroid s = brightest_place(*draw_fan(starboard, plain_gray()));
  const Centroid n = brightest_place(*draw_fan(near, plain_gray()));
  EXPECT_LT(p.x, 100);
  EXPECT_GT(s.x, 300);
  EXPECT_NEAR(p.x + s.x, 399, 1) << "beams 5 and 58 mirror each other";
  EXPECT_GT(n.y, p.y) << "nearer is lower";
}

TEST(Fan, PlacesASampleByItsRangeAndBearing) {
  PolarImage image = black_fan(200, 121, 60);  // a beam each degree
  const std::size_t beam = 60 - 30;            // 30 degrees to port
  image.samples[100 * 121 + beam] = 255;       // range 5.025 m
  const Raster fan = *draw_fan(image, plain_gray(800));
  const Centroid c = brightest_place(fan);
  const double pixel_m = 2 * 10 * std::sin(rad_from_deg(60)) / (800 - 8);
  EXPECT_NEAR((400 - c.x - 0.5) * pixel_m, 5.025 * std::sin(rad_from_deg(30)), 2 * pixel_m);
  EXPECT_NEAR((4 + 10 / pixel_m - c.y - 0.5) * pixel_m, 5.025 * std::cos(rad_from_deg(30)), 2 * pixel_m);
}

TEST(Fan, ShowsNothingNearerThanItsStart) {
  PolarImage image = black_fan(100, 61, 30);
  image.row_spacing_m = 0.05;
  image.start_m = 5;
  image.samples[50 * 61 + 30] = 255;  // ahead, 7.525 m
  const Centroid c = brightest_place(*draw_fan(image, plain_gray(800)));
  const double pixel_m = 2 * 10 * std::sin(rad_from_deg(30)) / (800 - 8);
  EXPECT_NEAR((4 + 10 / pixel_m - c.y - 0.5) * pixel_m, 7.525, 2 * pixel_m);
  std::fill(image.samples.begin(), image.samples.end(), 50.0f);
  const Raster fan = *draw_fan(image, plain_gray(800));
  const auto grey_at = [&](double range_m) { return fan.at(400, static_cast<int>(4 + (10 - range_m) / pixel_m)); };
  EXPECT_EQ(grey_at(4.9).b, 23) << "nearer than the start is background";
  EXPECT_EQ(grey_at(5.1).b, 50);
}

/// Returns an image with beams all around: the last bearing is one step from the first, as for a head that keeps turning.
PolarImage full_turn(std::size_t beams, double first_rad) {
  PolarImage image = black_fan(10, beams, 180);
  for (std::size_t i = 0; i < beams; ++i)
    image.azimuth_rad[i] = first_rad - 2 * pi * static_cast<double>(i) / static_cast<double>(beams);
  image.samples.assign(10 * beams, 200);
  return image;
}

TEST(Fan, AFullTurnHasNoGap) {
  for (const double first_rad : {pi, pi - 2 * pi / 16}) {
    const Raster fan = *draw_fan(full_turn(16, first_rad), plain_gray());
    const double pixel_m = 20.0 / (400 - 8);
    for (int degrees = 0; degrees < 360; ++degrees) {
      const double bearing = rad_from_deg(degrees + 0.5);
      const int x = static_cast<int>(200 - 8 / pixel_m * std::sin(bearing));
      const int y = static_cast<int>(4 + (10 - 8 * std::cos(bearing)) / pixel_m);
      EXPECT_EQ(fan.at(x, y).r, 200) << "bearing " << degrees;
    }
  }
  PolarImage gap = full_turn(16, pi);
  for (double& azimuth : gap.azimuth_rad) azimuth *= 0.9;  // 56 degrees without a bearing, 36 without a beam
  const Raster fan = *draw_fan(gap, plain_gray());
  EXPECT_EQ(fan.at(195, fan.height - 10).b, outside_colour.b) << "a sector is not closed to a circle";
}

TEST(Fan, KeepsTheMeanWhenPixelsAreCoarserThanSamples) {
  PolarImage image = black_fan(1000, 512, 60);
  for (std::size_t i = 0; i < image.samples.size(); ++i) image.samples[i] = i % 2 == 0 ? 200.0f : 100.0f;
  const Raster fan = *draw_fan(image, plain_gray(128));
  const Rgb middle = fan.at(64, fan.height / 2);
  EXPECT_NEAR(middle.r, 150, 8) << "an alternating pattern must blend, not alias";
}

TEST(Fan, APainterDrawsPingsOfChangingShapesAsOneByOne) {
  FanPainter painter(plain_gray(300));
  const auto speckle = [](std::size_t rows, double aperture_deg, std::size_t seed) {
    PolarImage image = black_fan(rows, 64, aperture_deg);
    for (std::size_t i = 0; i < image.samples.size(); ++i) image.samples[i] = static_cast<float>((i * 7919 + seed) % 256);
    return image;
  };
  PolarImage later = speckle(40, 60, 5);
  later.start_m = 1;
  PolarImage spread = speckle(40, 60, 6);
  spread.azimuth_rad[3] += 0.001;
  for (const PolarImage& image : {speckle(40, 60, 1), speckle(40, 60, 2), speckle(50, 60, 3), speckle(50, 40, 4), later, spread})
    EXPECT_EQ(painter.draw(image)->pixels, draw_fan(image, plain_gray(300))->pixels);
  EXPECT_FALSE(painter.draw(black_fan(10, 16, 190)));
  const PolarImage first = speckle(40, 60, 1);
  EXPECT_EQ(painter.draw(first)->pixels, draw_fan(first, plain_gray(300))->pixels) << "drawing works after a refused image";
}

TEST(Fan, RefusesWhatCannotBeDrawn) {
  PolarImage none;
  EXPECT_THAT(draw_fan(none, plain_gray()).error().text, testing::HasSubstr("cannot be drawn"));
  PolarImage twisted = black_fan(10, 16, 60);
  std::swap(twisted.azimuth_rad[3], twisted.azimuth_rad[4]);
  EXPECT_THAT(draw_fan(twisted, plain_gray()).error().text, testing::HasSubstr("bearing table"));
  EXPECT_THAT(draw_fan(black_fan(10, 16, 190), plain_gray()).error().text, testing::HasSubstr("more than a circle"));
  EXPECT_EQ(draw_fan(black_fan(10, 16, 60), plain_gray(10)).error().kind, ErrorKind::usage);
}

TEST(Fan, ChoosesRoundRings) {
  EXPECT_DOUBLE_EQ(ring_spacing_m(10), 1);
  EXPECT_DOUBLE_EQ(ring_spacing_m(30), 5);
  EXPECT_DOUBLE_EQ(ring_spacing_m(2), 0.2);
  EXPECT_DOUBLE_EQ(ring_spacing_m(120), 20);
}

TEST(ColourMap, RunsFromItsFirstToItsLastAnchorAndNeverBeyond) {
  for (const ColourMap& map : colour_maps()) {
    const Rgb first = map.colour(0), last = map.colour(1);
    EXPECT_EQ(map.colour(-5).g, first.g) << map.name;
    EXPECT_EQ(map.colour(std::nanf("")).g, first.g) << map.name;
    EXPECT_EQ(map.colour(7).g, last.g) << map.name;
    EXPECT_GT(last.r + last.g + last.b, first.r + first.g + first.b) << map.name << " must brighten";
    for (const ColourMap::Anchor& anchor : map.anchors)
      EXPECT_NEAR(map.colour(anchor.at).r, anchor.r * 255, 0.51) << map.name << " at " << anchor.at;
  }
  EXPECT_THAT(find_colour_map("grey").error().text, testing::HasSubstr("gray, copper"));
}

TEST(Png, IsWrittenCompletelyOrRefused) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "fan_image_test";
  const auto file = folder / "deep" / "fan.png";
  ASSERT_TRUE(write_png(*draw_fan(black_fan(10, 16, 60), plain_gray(64)), file));
  std::ifstream in(file, std::ios::binary);
  std::string start(8, ' ');
  in.read(start.data(), 8);
  EXPECT_EQ(start, "\x89PNG\r\n\x1a\n");
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".tmp"));
  EXPECT_EQ(write_png(Raster(4, 4), "/dev/null/fan.png").error().kind, ErrorKind::io);
  std::filesystem::remove_all(folder);
}

TEST(Png, LinksAndPipesStayWhatTheyAre) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "fan_image_test_links";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "pictures");
  std::filesystem::create_symlink("pictures/real.png", folder / "link.png");
  for (int i = 0; i < 2; ++i) {  // at first the target of the link does not exist
    ASSERT_TRUE(write_png(Raster(4, 4), folder / "link.png"));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.png"));
    EXPECT_GT(std::filesystem::file_size(folder / "pictures/real.png"), 8u);
  }
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_TRUE(write_png(Raster(4, 4), pipe));
  std::array<char, 8> start{};
  EXPECT_EQ(::read(reader, start.data(), start.size()), 8);
  EXPECT_EQ(start[1], 'P');
  ::close(reader);
  EXPECT_EQ(std::filesystem::status(pipe).type(), std::filesystem::file_type::fifo);
  std::filesystem::remove_all(folder);
}

TEST(Png, SeveralWritersOfOneFileDoNotMeet) {
  const auto file = std::filesystem::path(testing::TempDir()) / "fan_image_test_several";
  std::filesystem::remove(file);
  std::vector<std::thread> writers;
  for (int writer = 0; writer < 4; ++writer)
    writers.emplace_back([&, writer] {
      const std::vector<std::byte> bytes(100'000 + 1000 * static_cast<std::size_t>(writer),
                                         std::byte{static_cast<unsigned char>(writer)});
      for (int i = 0; i < 50; ++i) EXPECT_TRUE(write_whole_file(file, {bytes, bytes}));
    });
  for (int i = 0; i < 50; ++i) {
    std::ifstream in(file, std::ios::binary);
    const std::string there{std::istreambuf_iterator<char>(in), {}};
    if (there.empty()) continue;  // the file does not exist yet
    const auto writer = static_cast<std::size_t>(there[0]);
    EXPECT_EQ(there, std::string(2 * (100'000 + 1000 * writer), there[0]));
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".tmp"));
  std::filesystem::remove(file);
}

TEST(Png, AFullDiskIsAnErrorThatNamesTheFileAndTheReason) {
  const auto file = std::filesystem::path(testing::TempDir()) / "fan_image_test_full.png";
  std::filesystem::remove(file);
  Raster noise(100, 100);
  std::uint32_t state = 1;
  for (Rgb& p : noise.pixels) p = {static_cast<std::uint8_t>((state = state * 1664525 + 1013904223) >> 24), 0, 0};
  {
    const SmallDisk disk(1000);
    const auto r = write_png(noise, file);
    ASSERT_FALSE(r);
    EXPECT_EQ(r.error().kind, ErrorKind::io);
    EXPECT_THAT(r.error().text, testing::HasSubstr("fan_image_test_full.png: File too large"));
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".tmp"));
}

}  // namespace
}  // namespace sonar
