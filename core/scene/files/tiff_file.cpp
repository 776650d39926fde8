#include "core/scene/files/tiff_file.hpp"

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace sonar {
namespace {

/// The library's error text for the file that this thread reads.
thread_local std::string last_error;
void on_error(const char*, const char* pattern, va_list arguments) {
  std::array<char, 200> text{};
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  last_error = text.data();
}

tl::unexpected<Error> bad(const std::string& what) { return failure(ErrorKind::bad_data, what); }
tl::unexpected<Error> unreadable() { return bad("cannot be read; is it cut short? Fetch it again: " + last_tiff_error()); }

/// The name of a compression that is not read; its code if the name is unknown.
std::string name_of_compression(std::uint16_t code) {
  static const std::map<std::uint16_t, const char*> names{
      {6, "JPEG"},        {7, "JPEG"},        {34712, "JPEG 2000"},           {34887, "LERC"}, {34925, "LZMA"}, {50001, "WebP"},
      {50002, "JPEG XL"}, {52546, "JPEG XL"}, {COMPRESSION_ZSTD, "Zstandard"}};
  const auto name = names.find(code);
  return name != names.end() ? name->second : "code " + std::to_string(code);
}

/// Sparse files do not contain blocks without data.
bool is_left_out(TIFF* file, std::uint32_t block) { return TIFFGetStrileByteCount(file, block) == 0; }

/// Unpacks whole strips, because some writers pack a run of equal bytes across the end of a row.
Result<void> each_row_of_strips(TIFF* file, const Picture& picture, const TakeCells& take) {
  std::uint32_t height = 0;
  TIFFGetFieldDefaulted(file, TIFFTAG_ROWSPERSTRIP, &height);
  const auto row_bytes = static_cast<std::size_t>(TIFFScanlineSize64(file));
  std::vector<std::byte> strip(static_cast<std::size_t>(TIFFStripSize64(file)));
  if (height == 0) return unreadable();
  for (std::uint32_t row = 0, rows = 0; row < picture.rows; row += rows) {
    rows = std::min(height, picture.rows - row);
    const std::uint32_t number = TIFFComputeStrip(file, row, 0);
    const bool left_out = is_left_out(file, number);
    const std::size_t size = rows * row_bytes;
    if (!left_out && (size > strip.size() || TIFFReadEncodedStrip(file, number, strip.data(), static_cast<tmsize_t>(size)) !=
                                                 static_cast<tmsize_t>(size)))
      return unreadable();
    for (std::uint32_t j = 0; j < rows; ++j) {
      const auto bytes = left_out ? std::span<const std::byte>() : std::span<const std::byte>(strip).subspan(j * row_bytes);
      if (auto r = take(bytes, 0, row + j, picture.columns); !r) return r;
    }
  }
  return {};
}

Result<void> each_row_of_tiles(TIFF* file, const Picture& picture, const TakeCells& take) {
  std::uint32_t width = 0, height = 0;
  TIFFGetField(file, TIFFTAG_TILEWIDTH, &width);
  TIFFGetField(file, TIFFTAG_TILELENGTH, &height);
  const std::uint64_t row_bytes = TIFFTileRowSize64(file);
  std::vector<std::byte> tile(static_cast<std::size_t>(TIFFTileSize64(file)));
  if (width == 0 || height == 0 || row_bytes == 0 || row_bytes * height > tile.size()) return unreadable();
  // Every tile is unpacked as a whole, even if few of its cells lie in the picture.
  if (TIFFNumberOfTiles(file) * std::uint64_t{tile.size()} >
      most_block_bytes + 4 * std::uint64_t{picture.rows} * picture.bytes_of(picture.columns))
    return bad("its tiles are much larger than the picture; write it without: gdal_translate -co TILED=NO");
  for (std::uint32_t row = 0; row < picture.rows; row += std::min(height, picture.rows - row))
    for (std::uint32_t column = 0; column < picture.columns; column += std::min(width, picture.columns - column)) {
      const bool left_out = is_left_out(file, TIFFComputeTile(file, column, row, 0, 0));
      if (!left_out && TIFFReadTile(file, tile.data(), column, row, 0, 0) < 0) return unreadable();
      for (std::uint32_t j = 0; j < std::min(height, picture.rows - row); ++j) {
        const auto bytes = left_out ? std::span<const std::byte>()
                                    : std::span<const std::byte>(tile).subspan(static_cast<std::size_t>(j * row_bytes));
        if (auto r = take(bytes, column, row + j, std::min(width, picture.columns - column)); !r) return r;
      }
    }
  return {};
}

}  // namespace

void CloseTiff::operator()(tiff* file) const { TIFFClose(file); }

Tiff open_tiff(const std::filesystem::path& file) {
  TIFFSetErrorHandler(on_error);
  TIFFSetWarningHandler(nullptr);  // libtiff would warn of every unknown tag
  last_error.clear();
#if TIFFLIB_VERSION >= 20221213
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(4 * most_block_bytes));
  return Tiff(TIFFOpenExt(file.c_str(), "rm", options.get()));
#else
  return Tiff(TIFFOpen(file.c_str(), "rm"));  // m: do not map the file, which could shrink
#endif
}

std::string last_tiff_error() { return last_error.empty() ? "damaged" : last_error; }

std::optional<std::uint16_t> mask_of(tiff* file) {
  constexpr std::uint16_t most_pictures = 64;
  std::optional<std::uint16_t> mask;
  for (std::uint16_t n = 1; n < most_pictures && !mask && TIFFReadDirectory(file) == 1; ++n) {
    std::uint32_t kind = 0;
    TIFFGetField(file, TIFFTAG_SUBFILETYPE, &kind);
    if ((kind & FILETYPE_MASK) != 0 && (kind & FILETYPE_REDUCEDIMAGE) == 0) mask = n;
  }
  TIFFSetDirectory(file, 0);
  last_error.clear();
  return mask;
}

Picture picture_at(tiff* file) {
  Picture picture;
  TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &picture.columns);
  TIFFGetField(file, TIFFTAG_IMAGELENGTH, &picture.rows);
  TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &picture.bits);
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &picture.format);
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &picture.samples);
  return picture;
}

Result<void> check_blocks(tiff* file) {
  std::uint16_t compression = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(file, TIFFTAG_COMPRESSION, &compression);
  static const std::set<std::uint16_t> codecs{COMPRESSION_NONE,    COMPRESSION_LZW,      COMPRESSION_ADOBE_DEFLATE,
                                              COMPRESSION_DEFLATE, COMPRESSION_PACKBITS, COMPRESSION_ZSTD};
  if (!codecs.contains(compression) || !TIFFIsCODECConfigured(compression))
    return bad("compressed in a way that is not read here (" + name_of_compression(compression) +
               "); write it otherwise: gdal_translate -co COMPRESS=DEFLATE IN OUT.tif");
  const std::uint64_t block = TIFFIsTiled(file) ? TIFFTileSize64(file) : TIFFScanlineSize64(file);
  if (block == 0 || block > most_block_bytes || (!TIFFIsTiled(file) && TIFFStripSize64(file) > 4 * most_block_bytes))
    return bad("its blocks have more than 64 MiB; write it in tiles: gdal_translate -co TILED=YES");
  return {};
}

Result<void> each_row_of_blocks(tiff* file, const Picture& picture, const TakeCells& take) {
  return TIFFIsTiled(file) ? each_row_of_tiles(file, picture, take) : each_row_of_strips(file, picture, take);
}

}  // namespace sonar
