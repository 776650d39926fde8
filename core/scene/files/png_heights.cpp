// Reads heights from grey PNG images, even if they are stored as colours. No other file of the scene includes libpng.
#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <string>

#include "core/base/regular_file.hpp"
#include "core/scene/shapes/terrain.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

struct Picture {
  std::size_t columns = 0, rows = 0;
  std::vector<std::uint16_t> grey;
  std::vector<bool> transparent;
  std::string error;
};

void on_error(png_structp png, png_const_charp message) {
  const bool is_short = std::strcmp(message, "Read Error") == 0;  // libpng's only message for this
  static_cast<Picture*>(png_get_error_ptr(png))->error = is_short ? "it is cut short; fetch or export it again" : message;
  png_longjmp(png, 1);
}
void on_warning(png_structp, png_const_charp) {}

void read_rows(png_structp png, png_infop info, Picture& picture, std::vector<png_byte>& rows_read) {
  png_read_info(png, info);
  const std::size_t columns = png_get_image_width(png, info), rows = png_get_image_height(png, info);
  const bool grey = (png_get_color_type(png, info) & ~PNG_COLOR_MASK_ALPHA) == PNG_COLOR_TYPE_GRAY;
  if (columns < 2 || rows < 2) png_error(png, "smaller than 2 x 2 pixels");
  if (columns * rows > max_mesh_triangles / 2) png_error(png, "more than 10 million pixels; use a coarser image");
  if (grey && png_get_bit_depth(png, info) < 8) png_set_expand_gray_1_2_4_to_8(png);
  if (!grey) png_set_palette_to_rgb(png);  // only palettes need this
  if (png_get_valid(png, info, PNG_INFO_tRNS)) png_set_tRNS_to_alpha(png);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  const bool wide = png_get_bit_depth(png, info) == 16;
  const std::size_t sample = wide ? 2 : 1, channels = png_get_channels(png, info), pixel = channels * sample;
  const bool has_alpha = channels % 2 == 0;
  // If the image is interlaced, rows are complete only after the last pass, which adds to the values of earlier passes.
  const std::size_t row_bytes = png_get_rowbytes(png, info);
  rows_read.resize(passes > 1 ? row_bytes * rows : row_bytes);
  for (int pass = 1; pass < passes; ++pass)
    for (std::size_t j = 0; j < rows; ++j) png_read_row(png, rows_read.data() + row_bytes * j, nullptr);
  picture.columns = columns;
  picture.rows = rows;
  picture.grey.resize(columns * rows);
  picture.transparent.resize(has_alpha ? columns * rows : 0);
  for (std::size_t j = 0; j < rows; ++j) {
    png_byte* const row = rows_read.data() + (passes > 1 ? row_bytes * j : 0);
    png_read_row(png, row, nullptr);
    for (std::size_t i = 0; i < columns; ++i) {
      const png_byte* at = row + pixel * i;
      const png_byte* const alpha = at + pixel - sample;
      const bool hidden = has_alpha && alpha[0] == 0 && (!wide || alpha[1] == 0);
      if (has_alpha) picture.transparent[j * columns + i] = hidden;
      if (!grey && !hidden && (std::memcmp(at, at + sample, sample) != 0 || std::memcmp(at, at + 2 * sample, sample) != 0))
        png_error(png, "not a grey image: it has colours, where red, green and blue differ; save it in grey");
      const unsigned v = wide ? (unsigned{at[0]} << 8 | at[1]) : at[0] * 257u;
      picture.grey[j * columns + i] = static_cast<std::uint16_t>(v);
    }
  }
  png_read_end(png, nullptr);
}

// libpng leaves the function with longjmp. Therefore all objects with a destructor must be in the caller.
bool read_picture(std::FILE* file, Picture& picture, std::vector<png_byte>& row) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &picture, on_error, on_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  if (!info) {
    png_destroy_read_struct(&png, nullptr, nullptr);
    picture.error = "not enough memory";
    return false;
  }
  if (setjmp(png_jmpbuf(png))) {
    png_destroy_read_struct(&png, &info, nullptr);
    return false;
  }
  png_set_user_limits(png, 65536, 65536);
  png_init_io(png, file);
  read_rows(png, info, picture, row);
  png_destroy_read_struct(&png, &info, nullptr);
  return true;
}

}  // namespace

Result<HeightGrid> read_png_heights(const std::filesystem::path& file, double size_x_m, double size_y_m, double low_m,
                                    double high_m) {
  const auto in = open_regular(file);
  if (!in) return tl::make_unexpected(in.error());
  Picture picture;
  std::vector<png_byte> row;
  if (!read_picture(in->get(), picture, row)) {
    return failure(ErrorKind::bad_data, file.string() + ": not usable as heights: " + picture.error);
  }
  HeightGrid grid;
  const auto axis = [](std::size_t n, double size) {
    std::vector<double> at;
    for (std::size_t i = 0; i < n; ++i) at.push_back(size * (static_cast<double>(i) / static_cast<double>(n - 1) - 0.5));
    return at;
  };
  grid.x = axis(picture.columns, size_x_m);
  grid.y = axis(picture.rows, size_y_m);
  grid.z_m.resize(picture.grey.size());
  for (std::size_t j = 0; j < picture.rows; ++j) {
    for (std::size_t i = 0; i < picture.columns; ++i) {
      const std::size_t at = (picture.rows - 1 - j) * picture.columns + i;
      const bool hidden = !picture.transparent.empty() && picture.transparent[at];
      const double v = picture.grey[at] / 65535.0;
      grid.z_m[j * picture.columns + i] = hidden ? NAN : static_cast<float>(low_m + v * (high_m - low_m));
    }
  }
  if (const auto holes = std::count(picture.transparent.begin(), picture.transparent.end(), true); holes > 0)
    grid.notes.push_back(text::format("%zu of its %zu pixels are transparent: holes in the ground",
                                      static_cast<std::size_t>(holes), picture.grey.size()));
  return grid;
}

}  // namespace sonar
