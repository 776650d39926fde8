// Ground read from PNG images: steps, colours, transparency, interlacing, and files that are wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <cstdio>

#include "core/scene/shapes/terrain.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::png_heights_test {
namespace {

using ::testing::HasSubstr;
using tests::TemporaryFiles;

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
  EXPECT_THAT(refusal(files.write("cut.png", bytes.substr(0, 30))), HasSubstr("cut short; fetch or export it again"));
  for (std::size_t n = 0; n + 12 < bytes.size(); ++n) {  // if only the last chunk is missing, the picture is whole
    EXPECT_THAT(refusal(files.write("cut.png", bytes.substr(0, n))), HasSubstr("not usable as heights")) << n;
  }
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    std::string bent = bytes;
    bent[n] = static_cast<char>(bent[n] ^ 0x55);
    refusal(files.write("bent.png", bent));
  }
}

// Drawing programs store grey in this way.
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

// gdal_translate marks cells without data in this way.
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

}  // namespace
}  // namespace sonar::png_heights_test
