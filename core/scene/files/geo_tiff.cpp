// GeoTIFF: heights with coordinates (OGC 19-008r4), through libtiff; the only file that includes it.
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <sstream>

#include "core/base/memory_left.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/gdal_metadata.hpp"
#include "core/scene/files/geo_keys.hpp"
#include "core/scene/files/height_values.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

constexpr std::uint64_t most_file_bytes = std::uint64_t{2} << 30, most_block_bytes = 64 << 20;
constexpr std::uint64_t memory_of_a_cell = 4;
constexpr std::uint16_t most_bands = 16;

// Tags.
enum : std::uint32_t {
  pixel_scale = 33550,
  tie_points = 33922,
  transformation = 34264,
  key_directory = 34735,
  key_numbers = 34736,
  key_texts = 34737,
  gdal_metadata = 42112,
  gdal_no_data = 42113,
};
struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Tiff = std::unique_ptr<TIFF, CloseTiff>;

// The library's error text for the file that this thread reads.
thread_local std::string last_error;
void on_error(const char*, const char* pattern, va_list arguments) {
  std::array<char, 200> text{};
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  last_error = text.data();
}

Tiff open(const std::filesystem::path& file) {
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

/// The values of a tag that is unknown to the library; empty if the tag is missing or has another type.
template <class T>
std::vector<T> values_of(TIFF* tiff, std::uint32_t tag, TIFFDataType type) {
  const TIFFField* field = TIFFFindField(tiff, tag, TIFF_ANY);
  if (field == nullptr || TIFFFieldDataType(field) != type || !TIFFFieldPassCount(field)) return {};
  std::uint32_t count = 0;
  const T* values = nullptr;
  if (TIFFFieldReadCount(field) == TIFF_VARIABLE2) {
    if (TIFFGetField(tiff, tag, &count, &values) != 1) return {};
  } else {
    std::uint16_t few = 0;
    if (TIFFGetField(tiff, tag, &few, &values) != 1) return {};
    count = few;
  }
  return values == nullptr ? std::vector<T>() : std::vector<T>(values, values + std::min<std::uint32_t>(count, 65536));
}

struct Picture {
  std::uint32_t columns = 0, rows = 0;
  std::uint16_t bits = 1, format = SAMPLEFORMAT_UINT, samples = 1;
  std::uint16_t bands = 1;             // values of a cell that lie side by side; the first is the height
  std::optional<std::uint16_t> alpha;  // the one of them that is 0 where there is no data
  std::size_t value_bytes() const { return bits / 8u; }
};

/// Place of the middle of the first cell, and steps; y usually falls.
struct Georeference {
  double x = 0, y = 0, step_x = 0, step_y = 0;
};

/// The name of a compression that is not read; its code if the name is unknown.
std::string name_of_compression(std::uint16_t code) {
  static const std::map<std::uint16_t, const char*> names{
      {6, "JPEG"},        {7, "JPEG"},        {34712, "JPEG 2000"},           {34887, "LERC"}, {34925, "LZMA"}, {50001, "WebP"},
      {50002, "JPEG XL"}, {52546, "JPEG XL"}, {COMPRESSION_ZSTD, "Zstandard"}};
  const auto name = names.find(code);
  return name != names.end() ? name->second : "code " + std::to_string(code);
}

class GeoTiffReader {
 public:
  GeoTiffReader(TIFF* tiff, const std::filesystem::path& file, const HeightOptions& options)
      : tiff_(tiff), file_(file), options_(options) {}

  Result<HeightGrid> read() {
    if (has_mask())
      return bad(
          "marks cells without data in a mask of its own, which is not read; write them as a value: gdalwarp -dstnodata -9999");
    if (auto r = read_description(); !r) return tl::make_unexpected(r.error());
    const auto place = read_georeference();
    if (!place) return tl::make_unexpected(place.error());
    if (auto room = check_memory_for("its heights", memory_of_a_cell * picture_.columns * picture_.rows); !room)
      return tl::make_unexpected(room.error());
    raw_.z.assign(std::size_t{picture_.columns} * picture_.rows, std::numeric_limits<float>::quiet_NaN());
    const auto no_data = values_of<char>(tiff_, gdal_no_data, TIFF_ASCII);
    std::string declared(no_data.begin(), std::find(no_data.begin(), no_data.end(), '\0'));
    declared.erase(0, declared.find_first_not_of(' '));
    declared.erase(declared.find_last_not_of(' ') + 1);
    values_ = declared.empty() ? HeightValues(std::nullopt) : HeightValues(declared);
    if (auto r = TIFFIsTiled(tiff_) ? read_tiles() : read_strips(); !r) return tl::make_unexpected(r.error());
    const bool north_first = place->step_y < 0;
    for (std::uint32_t i = 0; i < picture_.columns; ++i) raw_.x.push_back(place->x + i * place->step_x);
    for (std::uint32_t j = 0; j < picture_.rows; ++j)
      raw_.y.push_back(place->y + (north_first ? picture_.rows - 1 - j : j) * place->step_y);
    if (north_first) raw_.turn_rows(picture_.columns);
    raw_.fill_values = values_.fill_values();
    return finish_heights(std::move(raw_), options_);
  }

 private:
  static tl::unexpected<Error> bad(const std::string& what) { return failure(ErrorKind::bad_data, what); }

  /// A mask is a further picture of the file.
  bool has_mask() {
    constexpr std::uint16_t most_pictures = 64;
    bool mask = false;
    for (std::uint16_t n = 1; n < most_pictures && !mask && TIFFReadDirectory(tiff_) == 1; ++n) {
      std::uint32_t kind = 0;
      TIFFGetField(tiff_, TIFFTAG_SUBFILETYPE, &kind);
      mask = (kind & FILETYPE_MASK) != 0;
    }
    TIFFSetDirectory(tiff_, 0);
    last_error.clear();
    return mask;
  }

  /// The six numbers of a world file beside the grid, relative to the middle of the first cell.
  std::optional<Georeference> world_file() const {
    for (const char* extension : {".tfw", ".tifw", ".TFW", ".wld"}) {
      std::filesystem::path beside = file_;
      const auto text = read_regular(beside.replace_extension(extension), 4096);
      if (!text) continue;
      std::array<double, 6> n{};
      std::istringstream words(*text);
      std::string word;
      for (double& v : n) v = words >> word ? height_number(word).value_or(NAN) : NAN;
      if (n[1] == 0 && n[2] == 0) return Georeference{n[4], n[5], n[0], n[3]};
    }
    return std::nullopt;
  }

  Result<void> read_description() {
    std::uint16_t compression = COMPRESSION_NONE, photometric = PHOTOMETRIC_MINISBLACK, planes = PLANARCONFIG_CONTIG;
    TIFFGetField(tiff_, TIFFTAG_IMAGEWIDTH, &picture_.columns);
    TIFFGetField(tiff_, TIFFTAG_IMAGELENGTH, &picture_.rows);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_BITSPERSAMPLE, &picture_.bits);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_SAMPLEFORMAT, &picture_.format);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_SAMPLESPERPIXEL, &picture_.samples);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_COMPRESSION, &compression);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_PLANARCONFIG, &planes);
    TIFFGetField(tiff_, TIFFTAG_PHOTOMETRIC, &photometric);
    if (picture_.columns < 2 || picture_.rows < 2) return bad("smaller than 2 x 2 heights");
    if (std::uint64_t{picture_.columns} * picture_.rows > max_mesh_triangles / 2)
      return bad(
          text::format("%u x %u heights, more than 10 million; cut a part out (gdal_translate -projwin), or make it coarser "
                       "(-outsize)",
                       picture_.columns, picture_.rows));
    const bool whole = picture_.format == SAMPLEFORMAT_UINT || picture_.format == SAMPLEFORMAT_INT;
    const bool known = whole ? picture_.bits == 8 || picture_.bits == 16 || picture_.bits == 32
                             : picture_.format == SAMPLEFORMAT_IEEEFP && (picture_.bits == 32 || picture_.bits == 64);
    const bool grey = photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE;
    if (grey && picture_.samples == 1 && !known)
      return bad(std::string("has ") + (whole ? "whole" : "floating-point") + " numbers of " + std::to_string(picture_.bits) +
                 " bits, which are not read; write them otherwise: gdal_translate -ot Float32");
    if (!grey || !known || picture_.samples > most_bands ||
        (picture_.samples != 1 && picture_.bits == 8 && planes == PLANARCONFIG_CONTIG))
      return bad("not one band of heights but a picture; choose a band of numbers: gdal_translate -b 1 -ot Float32");
    if (planes == PLANARCONFIG_CONTIG) picture_.bands = picture_.samples;
    if (auto r = find_alpha(); !r) return r;
    static const std::set<std::uint16_t> codecs{COMPRESSION_NONE,    COMPRESSION_LZW,      COMPRESSION_ADOBE_DEFLATE,
                                                COMPRESSION_DEFLATE, COMPRESSION_PACKBITS, COMPRESSION_ZSTD};
    if (!codecs.contains(compression) || !TIFFIsCODECConfigured(compression))
      return bad("compressed in a way that is not read here (" + name_of_compression(compression) +
                 "); write it otherwise: gdal_translate -co COMPRESS=DEFLATE IN OUT.tif");
    const std::uint64_t block = TIFFIsTiled(tiff_) ? TIFFTileSize64(tiff_) : TIFFScanlineSize64(tiff_);
    if (block == 0 || block > most_block_bytes || (!TIFFIsTiled(tiff_) && TIFFStripSize64(tiff_) > 4 * most_block_bytes))
      return bad("its blocks have more than 64 MiB; write it in tiles: gdal_translate -co TILED=YES");
    return {};
  }

  /// Further bands are uncertainties and the like, except the one that says where there are heights.
  Result<void> find_alpha() {
    std::uint16_t count = 0;
    const std::uint16_t* kinds = nullptr;
    if (TIFFGetField(tiff_, TIFFTAG_EXTRASAMPLES, &count, &kinds) != 1 || count >= picture_.samples) count = 0;
    for (std::uint16_t k = 0; k < count; ++k)
      if (kinds[k] != EXTRASAMPLE_UNSPECIFIED) picture_.alpha = static_cast<std::uint16_t>(picture_.samples - count + k);
    if (picture_.alpha && picture_.bands == 1)
      return bad("marks cells without data in a band of its own; write them as a value: gdalwarp -dstnodata -9999 IN OUT.tif");
    const int further_bands = picture_.samples - (picture_.alpha ? 2 : 1);
    if (further_bands > 0) raw_.notes.push_back(text::format("its heights are the first of %d bands", further_bands + 1));
    return {};
  }

  Result<Georeference> read_georeference() {
    const auto more = values_of<char>(tiff_, gdal_metadata, TIFF_ASCII);
    const GdalMetadata metadata = gdal_metadata_of(std::string_view(more.data(), more.size()));
    raw_.scale = metadata.scale, raw_.offset = metadata.offset;
    if (!(std::abs(raw_.scale) > 0 && std::abs(raw_.scale) <= 1000 && std::abs(raw_.offset) <= 1e7))
      return bad(
          "stores heights with a scale or an offset that is not a number or too large; write the heights themselves: "
          "gdal_translate -unscale -ot Float32 IN OUT.tif");
    const auto texts = values_of<char>(tiff_, key_texts, TIFF_ASCII);
    const GeoKeys keys(values_of<std::uint16_t>(tiff_, key_directory, TIFF_SHORT),
                       values_of<double>(tiff_, key_numbers, TIFF_DOUBLE), std::string(texts.begin(), texts.end()));
    auto system = system_of_keys(keys, metadata.height_unit);
    if (!system) return tl::make_unexpected(system.error());
    raw_.system = *std::move(system);

    Georeference place;
    const auto scale = values_of<double>(tiff_, pixel_scale, TIFF_DOUBLE),
               tie = values_of<double>(tiff_, tie_points, TIFF_DOUBLE),
               matrix = values_of<double>(tiff_, transformation, TIFF_DOUBLE);
    if (scale.size() >= 2 && tie.size() >= 6) {
      place = {tie[3] - tie[0] * scale[0], tie[4] + tie[1] * scale[1], scale[0], -scale[1]};
    } else if (matrix.size() == 16) {
      constexpr double rounding = 1e-7;  // it moves no cell by a tenth of its size
      if (std::abs(matrix[1]) > rounding * std::abs(matrix[0]) || std::abs(matrix[4]) > rounding * std::abs(matrix[5]))
        return bad("is rotated against its axes; straighten it: gdalwarp IN OUT.tif");
      place = {matrix[3], matrix[7], matrix[0], matrix[5]};
    } else if (const auto beside = world_file()) {
      if (!raw_.system.geographic) raw_.system = system_by_prj(file_);
      return check(*beside);
    } else if (tie.size() > 6) {
      return bad("has control points instead of a regular grid; make one of them: gdalwarp IN OUT.tif");
    } else {
      return bad("has no coordinates (no GeoTIFF); give it some: gdal_translate -a_ullr WEST NORTH EAST SOUTH");
    }
    if (keys.value_of(GeoKeys::raster_type) != GeoKeys::pixel_is_point)  // the corner of the first cell, not its middle
      place.x += 0.5 * place.step_x, place.y += 0.5 * place.step_y;
    return check(place);
  }

  static Result<Georeference> check(const Georeference& place) {
    const double step = std::abs(place.step_y);
    const bool sound = place.step_x > 1e-7 && place.step_x < 1e5 && step > 1e-7 && step < 1e5 && std::abs(place.x) <= 1e8 &&
                       std::abs(place.y) <= 1e8;
    if (!sound) return bad("has cells whose sizes are not between 1e-7 and 1e5, or lies farther than 1e8 m away");
    return place;
  }

  template <class T>
  static double number_at(const std::byte* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }
  double value_at(const std::byte* at) const {
    const bool sign = picture_.format == SAMPLEFORMAT_INT;
    if (picture_.format == SAMPLEFORMAT_IEEEFP) return picture_.bits == 64 ? number_at<double>(at) : number_at<float>(at);
    if (picture_.bits == 8) return sign ? number_at<std::int8_t>(at) : number_at<std::uint8_t>(at);
    if (picture_.bits == 16) return sign ? number_at<std::int16_t>(at) : number_at<std::uint16_t>(at);
    return sign ? number_at<std::int32_t>(at) : number_at<std::uint32_t>(at);
  }

  /// `width` heights of one row, from a block's bytes, to column and row of the grid.
  Result<void> take(std::span<const std::byte> bytes, std::uint32_t column, std::uint32_t row, std::uint32_t width) {
    const std::size_t size = picture_.value_bytes() * picture_.bands;
    width = std::min(width, picture_.columns - column);
    if (bytes.size() < size * width) return bad("has blocks that are shorter than its cells");
    for (std::uint32_t i = 0; i < width; ++i) {
      const std::byte* const cell = bytes.data() + size * i;
      if (picture_.alpha && value_at(cell + *picture_.alpha * picture_.value_bytes()) == 0) continue;
      const double value = value_at(cell);
      const auto height = values_.height_of(value);
      if (!height) return bad(text::format("the height %g in row %u, column %u is beyond 1e7 m", value, row + 1, column + i + 1));
      raw_.z[std::size_t{row} * picture_.columns + column + i] = *height;
    }
    return {};
  }

  tl::unexpected<Error> unreadable() const { return bad("cannot be read: " + (last_error.empty() ? "damaged" : last_error)); }

  /// Sparse files do not contain blocks without data.
  bool is_left_out(std::uint32_t block) { return TIFFGetStrileByteCount(tiff_, block) == 0; }

  /// Unpacks whole strips: some writers pack a run of equal bytes across the end of a row.
  Result<void> read_strips() {
    std::uint32_t height = 0;
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_ROWSPERSTRIP, &height);
    const auto row_bytes = static_cast<std::size_t>(TIFFScanlineSize64(tiff_));
    std::vector<std::byte> strip(static_cast<std::size_t>(TIFFStripSize64(tiff_)));
    if (height == 0) return unreadable();
    for (std::uint32_t row = 0, rows = 0; row < picture_.rows; row += rows) {
      rows = std::min(height, picture_.rows - row);
      const std::uint32_t number = TIFFComputeStrip(tiff_, row, 0);
      if (is_left_out(number)) continue;
      const std::size_t size = rows * row_bytes;
      if (size > strip.size() ||
          TIFFReadEncodedStrip(tiff_, number, strip.data(), static_cast<tmsize_t>(size)) != static_cast<tmsize_t>(size))
        return unreadable();
      for (std::uint32_t j = 0; j < rows; ++j)
        if (auto r = take(std::span<const std::byte>(strip).subspan(j * row_bytes), 0, row + j, picture_.columns); !r) return r;
    }
    return {};
  }

  Result<void> read_tiles() {
    std::uint32_t width = 0, height = 0;
    TIFFGetField(tiff_, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(tiff_, TIFFTAG_TILELENGTH, &height);
    const std::uint64_t row_bytes = TIFFTileRowSize64(tiff_);
    std::vector<std::byte> tile(static_cast<std::size_t>(TIFFTileSize64(tiff_)));
    if (width == 0 || height == 0 || row_bytes == 0 || row_bytes * height > tile.size()) return unreadable();
    // Every tile is unpacked as a whole, even if few of its cells lie in the picture.
    if (TIFFNumberOfTiles(tiff_) * std::uint64_t{tile.size()} >
        most_block_bytes + 4 * std::uint64_t{raw_.z.size()} * picture_.value_bytes() * picture_.bands)
      return bad("its tiles are much larger than the picture; write it without: gdal_translate -co TILED=NO");
    for (std::uint32_t row = 0; row < picture_.rows; row += std::min(height, picture_.rows - row))
      for (std::uint32_t column = 0; column < picture_.columns; column += std::min(width, picture_.columns - column)) {
        if (is_left_out(TIFFComputeTile(tiff_, column, row, 0, 0))) continue;
        if (TIFFReadTile(tiff_, tile.data(), column, row, 0, 0) < 0) return unreadable();
        for (std::uint32_t j = 0; j < std::min(height, picture_.rows - row); ++j) {
          const auto bytes = std::span<const std::byte>(tile).subspan(static_cast<std::size_t>(j * row_bytes));
          if (auto r = take(bytes, column, row + j, width); !r) return r;
        }
      }
    return {};
  }

  TIFF* tiff_;
  const std::filesystem::path& file_;
  const HeightOptions& options_;
  Picture picture_;
  RawHeights raw_;
  HeightValues values_{std::nullopt};
};

}  // namespace

Result<HeightGrid> read_geo_tiff_heights(const std::filesystem::path& file, const HeightOptions& options) {
  const auto bad = [&](const std::string& what) { return failure(ErrorKind::bad_data, file.string() + ": " + what); };
  if (const auto regular = open_regular(file); !regular) return tl::make_unexpected(regular.error());
  std::error_code error;
  if (std::filesystem::file_size(file, error) > most_file_bytes || error)
    return bad("larger than 2 GiB; cut a part out (gdal_translate)");
  const Tiff tiff = open(file);
  if (!tiff) return bad("no TIFF, or damaged: " + last_error);
  auto grid = GeoTiffReader(tiff.get(), file, options).read();
  if (!grid) return failure(grid.error().kind, file.string() + ": " + grid.error().text);
  return grid;
}

}  // namespace sonar
