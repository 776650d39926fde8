// Tests colour maps, their files, the mapping, and pictures on disk.
#include "clients/bvtsdk/core/colour_maps.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

namespace sonar::bvt {
namespace {

struct ColourMaps : testing::Test {
  std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
  ColourMaps() { std::filesystem::create_directories(folder); }
  ~ColourMaps() override { std::filesystem::remove_all(folder); }

  std::string read(const std::string& name) const {
    std::ifstream file(folder / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
};

MagImage image_with(std::vector<std::uint16_t> pixels) {
  MagImage image;
  image.width = static_cast<int>(pixels.size());
  image.height = 1;
  image.pixels = std::move(pixels);
  return image;
}

/// Returns a mapper whose colours encode the number of the entry; entry_of() decodes it.
ColourMapper numbering_mapper(PixelOrder order = PixelOrder::bgra) {
  ColourMap map;
  for (int i = 0; i < 4096; ++i) map.push_back({static_cast<std::uint8_t>(i / 16), 7, static_cast<std::uint8_t>(i % 16)});
  ColourMapper mapper(order);
  mapper.use(map);
  return mapper;
}

int entry_of(std::uint32_t pixel) {
  std::uint8_t b[4];
  std::memcpy(b, &pixel, 4);
  return 16 * b[0] + b[2];
}

std::vector<int> entries(ColourMapper& mapper, std::vector<std::uint16_t> pixels) {
  ColourImage colours;
  EXPECT_EQ(mapper.map(image_with(std::move(pixels)), colours), success);
  std::vector<int> out;
  for (const std::uint32_t pixel : colours.pixels) out.push_back(entry_of(pixel));
  return out;
}

std::string bytes_of(std::uint32_t pixel) {
  std::string b(4, 0);
  std::memcpy(b.data(), &pixel, 4);
  return b;
}

TEST_F(ColourMaps, AreFilesOf4096BlueGreenRed) {
  for (const std::string_view name : colour_map_names) {
    const std::string file = std::string(name) + ".cmap";
    const ColourMap made = make_colour_map(name);
    ASSERT_EQ(save_colour_map(folder / file, made), success);
    ASSERT_EQ(read(file).size(), 12288u);
    ColourMap back;
    ASSERT_EQ(load_colour_map(folder / file, back), success);
    ASSERT_EQ(back.size(), 4096u);
    for (std::size_t i = 0; i < back.size(); ++i) {
      EXPECT_EQ(back[i].blue, made[i].blue);
      EXPECT_EQ(back[i].red, made[i].red);
    }
  }
  // Jet: dark blue first, dark red last.
  EXPECT_EQ(read("jet.cmap").substr(0, 3), std::string("\x80\x00\x00", 3));
  EXPECT_EQ(read("jet.cmap").substr(12285), std::string("\x00\x00\x80", 3));
}

TEST_F(ColourMaps, FollowTheirFormulas) {
  const auto expect = [](std::string_view name, std::size_t i, int red, int green, int blue) {
    const Colour c = make_colour_map(name)[i];
    EXPECT_NEAR(c.red, red, 1) << name << i;
    EXPECT_NEAR(c.green, green, 1) << name << i;
    EXPECT_NEAR(c.blue, blue, 1) << name << i;
  };
  expect("jet", 2048, 128, 255, 128);
  expect("hot", 0, 0, 0, 0);
  expect("hot", 2048, 255, 85, 0);
  expect("hot", 4095, 255, 255, 255);
  expect("bone", 2048, 112, 122, 143);
  expect("bone", 4095, 255, 255, 255);
  expect("copper", 4095, 255, 199, 127);
  expect("cool", 0, 0, 255, 255);
  expect("cool", 4095, 255, 0, 255);
  expect("green", 4095, 0, 255, 0);
  EXPECT_TRUE(make_colour_map("mauve").empty());
}

TEST_F(ColourMaps, FilesThatAreNotMapsAreRefused) {
  ColourMapper mapper = numbering_mapper();
  EXPECT_EQ(mapper.load(folder / "missing.cmap"), file_open);
  for (const std::size_t size : {0u, 12287u, 12289u}) {
    std::ofstream(folder / "odd.cmap", std::ios::binary) << std::string(size, 'x');
    EXPECT_EQ(mapper.load(folder / "odd.cmap"), load_color_map) << size;
  }
  EXPECT_EQ(mapper.load(folder), load_color_map);               // a folder can be opened, but has no content
  EXPECT_EQ(entries(mapper, {65535}), std::vector<int>{4095});  // the old map stays
  ColourImage colours;
  EXPECT_EQ(ColourMapper(PixelOrder::bgra).map(image_with({1}), colours), bad_color_map);
}

TEST_F(ColourMaps, AreReadBetweenTheThresholds) {
  ColourMapper mapper = numbering_mapper();
  EXPECT_EQ(entries(mapper, {0, 8, 16, 32768, 65535}), (std::vector<int>{0, 0, 1, 2048, 4095}));
  ASSERT_EQ(mapper.set_thresholds(30000, 10000), success);
  EXPECT_EQ(entries(mapper, {0, 10000, 20000, 30000, 65535}), (std::vector<int>{0, 0, 2048, 4095, 4095}));
  ASSERT_EQ(mapper.set_gamma(2), success);
  EXPECT_EQ(entries(mapper, {10000, 15000, 30000}), (std::vector<int>{0, 2048, 4095}));  // a quarter, and its square root
  EXPECT_EQ(mapper.set_gamma(0), bad_parameter);
  EXPECT_EQ(mapper.set_gamma(std::numeric_limits<float>::quiet_NaN()), bad_parameter);
  EXPECT_EQ(mapper.set_thresholds(10, 10), bad_parameter);
  EXPECT_EQ(mapper.set_thresholds(65536, 10), bad_parameter);
  EXPECT_EQ(mapper.set_thresholds(10, -1), bad_parameter);
  EXPECT_EQ(mapper.top(), 30000);
  EXPECT_EQ(mapper.gamma(), 2);
}

TEST_F(ColourMaps, FindTheirTopThemselvesInAutoMode) {
  ColourMapper mapper = numbering_mapper();
  mapper.set_auto_mode(true);
  EXPECT_EQ(mapper.set_thresholds(30000, 10000), bad_parameter);
  std::vector<std::uint16_t> pixels(3000, 0);  // pixels outside the sector have no effect
  for (std::uint16_t v = 1; v <= 1000; ++v) pixels.push_back(static_cast<std::uint16_t>(20 * v));
  entries(mapper, pixels);
  EXPECT_EQ(mapper.top(), 19900);
  entries(mapper, {0, 1, 2, 3});
  EXPECT_EQ(mapper.top(), ColourMapper::lowest_auto_top);
  EXPECT_EQ(entries(mapper, {0, 0}), (std::vector<int>{0, 0}));
  mapper.set_auto_mode(false);
  EXPECT_EQ(mapper.set_thresholds(65535, 0), success);
}

TEST_F(ColourMaps, AreBlueGreenRedAlphaInMemoryByDefault) {
  for (const bool rgba : {false, true}) {
    ASSERT_EQ(setenv("BVE_PIXEL", rgba ? "rgba" : "bgra", 1), 0);
    ColourMapper mapper;
    unsetenv("BVE_PIXEL");
    mapper.use(ColourMap(4096, Colour{1, 2, 3}));
    ColourImage colours;
    MagImage image = image_with({0, 65535});
    image.origin_row = 12;
    ASSERT_EQ(mapper.map(image, colours), success);
    EXPECT_EQ(bytes_of(colours.pixels[0]), rgba ? "\x03\x02\x01\xFF" : "\x01\x02\x03\xFF");
    EXPECT_EQ(colours.origin_row, 12);
    ASSERT_EQ(save_ppm(folder / "a.ppm", colours), success);
    EXPECT_EQ(read("a.ppm"), "P6\n2 1\n255\n\x03\x02\x01\x03\x02\x01");
  }
  EXPECT_EQ(pixel_order_from_environment(), PixelOrder::bgra);
}

TEST_F(ColourMaps, PicturesOfMagnitudesHave16BitsBigEndian) {
  ASSERT_EQ(save_pgm(folder / "a.pgm", image_with({0x0102, 0xFFFE})), success);
  EXPECT_EQ(read("a.pgm"), "P5\n2 1\n65535\n\x01\x02\xFF\xFE");
  EXPECT_EQ(save_pgm(folder / "no" / "such" / "folder.pgm", image_with({1})), file_create);
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_EQ(save_pgm("/dev/full", image_with({1})), file_write);
  }
}

}  // namespace
}  // namespace sonar::bvt
