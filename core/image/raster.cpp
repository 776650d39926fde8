#include "core/image/raster.hpp"

#include <fcntl.h>
#include <png.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>
#include <array>
#include <cerrno>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>

#include "core/base/regular_file.hpp"

namespace sonar {
namespace {

/// Each character has five rows of three dots. The top row is in the highest bits.
std::uint16_t glyph(char c) {
  static constexpr std::array<std::uint16_t, 10> digits{
      0b111'101'101'101'111, 0b010'110'010'010'111, 0b111'001'111'100'111, 0b111'001'111'001'111, 0b101'101'111'001'001,
      0b111'100'111'001'111, 0b111'100'111'101'111, 0b111'001'001'010'010, 0b111'101'111'101'111, 0b111'101'111'001'111};
  if (c >= '0' && c <= '9') return digits[static_cast<std::size_t>(c - '0')];
  if (c == '.') return 0b000'000'000'000'010;
  if (c == '-') return 0b000'000'111'000'000;
  if (c == 'm') return 0b000'000'111'111'101;
  if (c == 's') return 0b000'000'011'010'110;
  return 0;
}

std::uint8_t mix(std::uint8_t under, std::uint8_t over, float opacity) {
  return static_cast<std::uint8_t>(std::lround(static_cast<float>(under) * (1 - opacity) + static_cast<float>(over) * opacity));
}

/// Opens an empty file and locks it, so that no other process or thread writes or renames it before it is closed. On failure,
/// returns -1 and sets errno.
int open_alone(const std::filesystem::path& file) {
  while (true) {
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0) return -1;
    ::flock(descriptor, LOCK_EX);  // some file systems have no locks: the file is then written without one
    struct stat opened {
    }, named{};
    const bool is_named = ::fstat(descriptor, &opened) == 0 && ::stat(file.c_str(), &named) == 0 &&
                          opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
    if (is_named && (!S_ISREG(opened.st_mode) || ::ftruncate(descriptor, 0) == 0)) return descriptor;
    const int why = errno;
    ::close(descriptor);
    errno = why;
    if (is_named) return -1;  // otherwise another process or thread has renamed the file to its final name: try again
  }
}

/// The target of a symbolic link. The target need not exist.
std::filesystem::path behind_links(std::filesystem::path file) {
  constexpr int most_links = 40;  // the same limit as in the operating system
  std::error_code error;
  for (int i = 0; i < most_links && std::filesystem::is_symlink(file, error); ++i)
    file = file.parent_path() / std::filesystem::read_symlink(file, error);
  return file;
}

bool is_device_or_pipe(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) && !std::filesystem::is_directory(status);
}

}  // namespace

void blend(Raster& raster, int x, int y, Rgb colour, float opacity) {
  if (x < 0 || y < 0 || x >= raster.width || y >= raster.height) return;
  Rgb& p = raster.at(x, y);
  p = {mix(p.r, colour.r, opacity), mix(p.g, colour.g, opacity), mix(p.b, colour.b, opacity)};
}

int text_width(std::string_view text, int scale) { return static_cast<int>(text.size()) * 4 * scale - scale; }

void draw_text(Raster& raster, int left, int top, std::string_view text, Rgb colour, int scale) {
  for (const char c : text) {
    const std::uint16_t dots = glyph(c);
    for (int dot = 0; dot < 15; ++dot) {
      if ((dots >> (14 - dot) & 1) == 0) continue;
      for (int i = 0; i < scale * scale; ++i)
        blend(raster, left + dot % 3 * scale + i % scale, top + dot / 3 * scale + i / scale, colour, 1);
    }
    left += 4 * scale;
  }
}

Result<std::vector<std::byte>> encode_png(const Raster& raster) {
  std::vector<std::uint8_t> rgb;
  rgb.reserve(raster.pixels.size() * 3);
  for (const Rgb& p : raster.pixels) rgb.insert(rgb.end(), {p.r, p.g, p.b});
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(raster.width);
  image.height = static_cast<png_uint_32>(raster.height);
  image.format = PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;  // no row filters: for few colours, files are smaller and take a quarter of the time
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);  // the largest possible size
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0)
    return failure(ErrorKind::bug, std::string("the picture could not be encoded: ") + image.message);
  bytes.resize(size);
  return bytes;
}

Result<void> write_whole_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts) {
  const bool replaces = !is_device_or_pipe(file);  // devices and pipes are written, not replaced
  const std::filesystem::path target = replaces ? behind_links(file) : file;
  const std::filesystem::path unfinished = replaces ? target.string() + ".tmp" : target.string();
  const int lock = replaces ? open_alone(unfinished) : open_to_write(target, 0);
  const auto failed = [&](int why) {
    std::error_code ignored;
    if (lock >= 0 && replaces) std::filesystem::remove(unfinished, ignored);
    if (lock >= 0) ::close(lock);
    return failure(ErrorKind::io, "cannot write " + file.string() + ": " + why_not_written(target, why));
  };
  if (lock < 0) return failed(errno);
  const int descriptor = ::fcntl(lock, F_DUPFD_CLOEXEC, 0);
  std::FILE* out = descriptor < 0 ? nullptr : ::fdopen(descriptor, "wb");
  if (out == nullptr) return failed(errno);
  int why = 0;
  for (const auto part : parts)
    if (why == 0 && std::fwrite(part.data(), 1, part.size(), out) != part.size()) why = errno;
  if (std::fclose(out) != 0 && why == 0) why = errno;  // the buffered bytes did not fit on the disk
  std::error_code error;
  if (why == 0 && replaces) std::filesystem::rename(unfinished, target, error);
  if (why != 0 || error) return failed(why != 0 ? why : error.value());
  ::close(lock);
  return {};
}

Result<void> write_png(const Raster& raster, const std::filesystem::path& file) {
  const auto bytes = encode_png(raster);
  if (!bytes) return tl::make_unexpected(bytes.error());
  std::error_code error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  return write_whole_file(file, {*bytes});
}

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
