#include "core/image/gray_png.hpp"

#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstdint>
#include <string>

namespace sonar {
namespace {

void append(png_structp png, png_bytep data, std::size_t size) {
  auto& bytes = *static_cast<std::vector<std::byte>*>(png_get_io_ptr(png));
  const auto* from = reinterpret_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), from, from + size);
}
void flush(png_structp) {}

}  // namespace

Result<std::vector<std::byte>> encode_gray_png(std::span<const std::byte> values, int width, int height, int bits) {
  const auto row_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(bits / 8);
  if ((bits != 8 && bits != 16) || width < 1 || height < 1 || values.size() != row_bytes * static_cast<std::size_t>(height))
    return failure(ErrorKind::bug, "a grey picture needs 8 or 16 bits per value, and as many values as pixels");
  std::vector<std::byte> bytes;
  bytes.reserve(values.size() / 2);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr) {
    png_destroy_write_struct(&png, nullptr);
    return failure(ErrorKind::unavailable, "not enough memory for a picture");
  }
  if (setjmp(png_jmpbuf(png)) != 0) {  // libpng jumps here after an error
    png_destroy_write_struct(&png, &info);
    return failure(ErrorKind::bug, "the picture could not be encoded");
  }
  png_set_write_fn(png, &bytes, append, flush);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits, PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
  png_set_compression_level(png, 1);         // noise hardly compresses: a higher level needs several times as long and saves 3 %
  png_set_compression_strategy(png, Z_RLE);  // labels are runs of equal values; for noise, other strategies produce more bytes
  png_set_filter(png, 0, PNG_FILTER_SUB);
  png_write_info(png, info);
  if (bits == 16) png_set_swap(png);
  for (int row = 0; row < height; ++row)
    png_write_row(png, reinterpret_cast<png_const_bytep>(values.data() + static_cast<std::size_t>(row) * row_bytes));
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

}  // namespace sonar
