// GeoTIFF: heights with coordinates (OGC 19-008r4), through libtiff.
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <sstream>

#include "core/base/memory_left.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/geo_keys.hpp"
#include "core/scene/files/height_values.hpp"
#include "core/scene/files/tiff_file.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

constexpr std::uint64_t most_file_bytes = std::uint64_t{2} << 30;
constexpr std::uint64_t memory_of_a_cell = 4;
constexpr std::uint16_t most_bands = 16;

// Numbers of tags.
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

/// Reads the values of a tag that is unknown to the library; empty if the tag is missing or has another type.
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

/// Coordinates of the middle of the first cell, and steps; y usually decreases.
struct Georeference {
  double x = 0, y = 0, step_x = 0, step_y = 0;
};

/// Converts a floating-point number of 16 bits.
double half_number(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31, fraction = bits & 1023;
  const double size = exponent == 31  ? (fraction == 0 ? std::numeric_limits<double>::infinity() : NAN)
                      : exponent == 0 ? std::ldexp(fraction, -24)
                                      : std::ldexp(fraction + 1024, exponent - 25);
  return (bits & 0x8000) != 0 ? -size : size;
}

/// Reads a whole number of `bits` bits that may begin within a byte. The first bit is the most significant one in files of both
/// byte orders. GDAL writes numbers of NBITS bits, and numbers of 24 bits, in this order.
double packed_number(std::span<const std::byte> bytes, std::size_t first_bit, std::size_t bits) {
  std::uint32_t value = 0;
  for (std::size_t bit = first_bit; bit < first_bit + bits; ++bit)
    value = value << 1 | (std::to_integer<std::uint32_t>(bytes[bit / 8]) >> (7 - bit % 8) & 1u);
  return value;
}

class GeoTiffReader {
 public:
  GeoTiffReader(TIFF* tiff, const std::filesystem::path& file, const HeightOptions& options)
      : tiff_(tiff), file_(file), options_(options) {}

  Result<HeightGrid> read() {
    const auto mask = mask_of(tiff_);
    if (std::error_code error; std::filesystem::exists(file_.string() + ".msk", error))
      return bad(
          "marks cells without data in a file beside it (.msk), which is not read; write them as a value: gdalwarp -dstnodata "
          "-9999");
    if (const auto more = read_regular(file_.string() + ".aux.xml", 65536);
        more && (more->find("<Scale>") != more->npos || more->find("<Offset>") != more->npos))
      return bad(
          "has its scale or offset in a file beside it (.aux.xml), which is not read; apply them: gdal_translate -unscale -ot "
          "Float32 IN OUT.tif");
    if (auto r = read_description(); !r) return tl::make_unexpected(r.error());
    const auto place = read_georeference();
    if (!place) return tl::make_unexpected(place.error());
    if (!unknown_unit_.empty())
      raw_.notes.push_back(
          "the unit of its heights, " + text::printable(unknown_unit_) + ", is not known: " +
          (raw_.system.height_unit_m == 1 ? "they are read as metres" : "that of its coordinate system is used") +
          "; z_scale converts them");
    if (auto room = check_memory_for("its heights", memory_of_a_cell * picture_.columns * picture_.rows); !room)
      return tl::make_unexpected(room.error());
    raw_.z.assign(std::size_t{picture_.columns} * picture_.rows, std::numeric_limits<float>::quiet_NaN());
    const auto no_data = values_of<char>(tiff_, gdal_no_data, TIFF_ASCII);
    std::string declared(no_data.begin(), std::find(no_data.begin(), no_data.end(), '\0'));
    declared.erase(0, declared.find_first_not_of(' '));
    declared.erase(declared.find_last_not_of(' ') + 1);
    values_ = declared.empty() ? HeightValues(std::nullopt) : HeightValues(declared);
    const auto take_heights = [this](std::span<const std::byte> bytes, std::uint32_t column, std::uint32_t row,
                                     std::uint32_t width) { return take(bytes, column, row, width); };
    if (auto r = each_row_of_blocks(tiff_, picture_, take_heights); !r) return tl::make_unexpected(r.error());
    if (mask)
      if (auto r = apply_mask(*mask); !r) return tl::make_unexpected(r.error());
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

  /// Removes the heights of cells that are 0 in the mask, a picture of 1 or 8 bits.
  Result<void> apply_mask(std::uint16_t number) {
    TIFFSetDirectory(tiff_, number);
    const Picture mask = picture_at(tiff_);
    if (mask.columns != picture_.columns || mask.rows != picture_.rows || mask.samples != 1 || (mask.bits != 1 && mask.bits != 8))
      return bad("marks cells without data in a mask of another size or kind; write them as a value: gdalwarp -dstnodata -9999");
    if (auto r = check_blocks(tiff_); !r) return r;
    return each_row_of_blocks(
        tiff_, mask,
        [&](std::span<const std::byte> bytes, std::uint32_t column, std::uint32_t row, std::uint32_t width) -> Result<void> {
          if (!bytes.empty() && bytes.size() < mask.bytes_of(width)) return bad("has a mask with blocks that are too short");
          for (std::uint32_t i = 0; i < width; ++i) {
            const bool shown = !bytes.empty() && (mask.bits == 8 ? bytes[i] != std::byte{0}
                                                                 : (bytes[i / 8] >> (7 - i % 8) & std::byte{1}) != std::byte{0});
            if (!shown) raw_.z[std::size_t{row} * picture_.columns + column + i] = std::numeric_limits<float>::quiet_NaN();
          }
          return {};
        });
  }

  /// The position and steps in a world file beside the grid, which states the middle of the first cell.
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
    std::uint16_t photometric = PHOTOMETRIC_MINISBLACK, planes = PLANARCONFIG_CONTIG;
    picture_ = picture_at(tiff_);
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_PLANARCONFIG, &planes);
    TIFFGetField(tiff_, TIFFTAG_PHOTOMETRIC, &photometric);
    if (picture_.columns < 2 || picture_.rows < 2) return bad("smaller than 2 x 2 heights");
    if (std::uint64_t{picture_.columns} * picture_.rows > max_mesh_triangles / 2)
      return bad(
          text::format("%u x %u heights, more than 10 million; cut a part out (gdal_translate -projwin), or make it coarser "
                       "(-outsize)",
                       picture_.columns, picture_.rows));
    const bool whole = picture_.format == SAMPLEFORMAT_UINT || picture_.format == SAMPLEFORMAT_INT;
    const bool known =
        whole ? picture_.bits == 8 || picture_.bits == 16 || picture_.bits == 32 || is_packed()
              : picture_.format == SAMPLEFORMAT_IEEEFP && (picture_.bits == 16 || picture_.bits == 32 || picture_.bits == 64);
    const bool is_complex = picture_.format == SAMPLEFORMAT_COMPLEXINT || picture_.format == SAMPLEFORMAT_COMPLEXIEEEFP;
    const bool grey = photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE;
    if (grey && picture_.samples == 1 && !known)
      return bad(std::string("has ") +
                 (whole                                    ? "whole"
                  : picture_.format == SAMPLEFORMAT_IEEEFP ? "floating-point"
                  : is_complex                             ? "complex"
                                                           : "unknown") +
                 " numbers of " + std::to_string(picture_.bits) +
                 " bits, which are not read; convert them: gdal_translate -ot Float32");
    if (!grey || !known || picture_.samples > most_bands ||
        (picture_.samples != 1 && picture_.bits <= 8 && planes == PLANARCONFIG_CONTIG))
      return bad("not one band of heights but a picture; choose a band of numbers: gdal_translate -b 1 -ot Float32");
    if (planes == PLANARCONFIG_CONTIG) picture_.bands = picture_.samples;
    if (auto r = find_alpha(); !r) return r;
    return check_blocks(tiff_);
  }

  /// Finds the band that marks cells with heights. Other bands (uncertainties, for example) are ignored.
  Result<void> find_alpha() {
    std::uint16_t count = 0;
    const std::uint16_t* kinds = nullptr;
    if (TIFFGetField(tiff_, TIFFTAG_EXTRASAMPLES, &count, &kinds) != 1 || count >= picture_.samples) count = 0;
    for (std::uint16_t k = 0; k < count; ++k)
      if (kinds[k] != EXTRASAMPLE_UNSPECIFIED) picture_.alpha = static_cast<std::uint16_t>(picture_.samples - count + k);
    if (picture_.alpha && picture_.bands == 1)
      return bad("marks cells without data in a separate band; write them as a value: gdalwarp -dstnodata -9999 IN OUT.tif");
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
    if (!metadata.height_unit) unknown_unit_ = metadata.unit_name;

    Georeference place;
    const auto scale = values_of<double>(tiff_, pixel_scale, TIFF_DOUBLE),
               tie = values_of<double>(tiff_, tie_points, TIFF_DOUBLE),
               matrix = values_of<double>(tiff_, transformation, TIFF_DOUBLE);
    if (scale.size() >= 2 && tie.size() >= 6) {
      place = {tie[3] - tie[0] * scale[0], tie[4] + tie[1] * scale[1], scale[0], -scale[1]};
    } else if (matrix.size() == 16) {
      constexpr double rounding = 1e-7;  // rounding by this amount moves no cell by a tenth of its size
      if (std::abs(matrix[1]) > rounding * std::abs(matrix[0]) || std::abs(matrix[4]) > rounding * std::abs(matrix[5]))
        return bad("is rotated against its axes; straighten it: gdalwarp IN OUT.tif");
      place = {matrix[3], matrix[7], matrix[0], matrix[5]};
    } else if (const auto beside = world_file()) {
      const double height_unit_m = raw_.system.height_unit_m;
      if (!raw_.system.geographic) raw_.system = system_by_prj(file_);
      if (metadata.height_unit) raw_.system.height_unit_m = height_unit_m;
      return check(*beside);
    } else if (tie.size() > 6) {
      return bad("has control points instead of a regular grid; make a grid of them: gdalwarp IN OUT.tif");
    } else {
      return bad("has no coordinates (no GeoTIFF); give it some: gdal_translate -a_ullr WEST NORTH EAST SOUTH");
    }
    if (keys.value_of(GeoKeys::raster_type) !=
        GeoKeys::pixel_is_point)  // the position is that of the first cell's corner, not of its middle
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
  bool is_packed() const {
    return picture_.format == SAMPLEFORMAT_UINT && picture_.bits < 32 && picture_.bits % 16 != 0 && picture_.bits != 8;
  }

  /// Reads the value with this number in a row of a block.
  double value_at(std::span<const std::byte> row, std::size_t number) const {
    if (is_packed()) return packed_number(row, number * picture_.bits, picture_.bits);
    const std::byte* const at = row.data() + number * picture_.value_bytes();
    const bool sign = picture_.format == SAMPLEFORMAT_INT;
    if (picture_.format == SAMPLEFORMAT_IEEEFP && picture_.bits == 16) {
      std::uint16_t half = 0;
      std::memcpy(&half, at, sizeof half);
      return half_number(half);
    }
    if (picture_.format == SAMPLEFORMAT_IEEEFP) return picture_.bits == 64 ? number_at<double>(at) : number_at<float>(at);
    if (picture_.bits == 8) return sign ? number_at<std::int8_t>(at) : number_at<std::uint8_t>(at);
    if (picture_.bits == 16) return sign ? number_at<std::int16_t>(at) : number_at<std::uint16_t>(at);
    return sign ? number_at<std::int32_t>(at) : number_at<std::uint32_t>(at);
  }

  /// Stores `width` heights of one row, from a block's bytes, at a column and row of the grid.
  Result<void> take(std::span<const std::byte> bytes, std::uint32_t column, std::uint32_t row, std::uint32_t width) {
    if (bytes.empty()) return {};
    if (bytes.size() < picture_.bytes_of(width)) return bad("has blocks that are shorter than its cells");
    for (std::uint32_t i = 0; i < width; ++i) {
      const std::size_t cell = std::size_t{i} * picture_.bands;
      if (picture_.alpha && value_at(bytes, cell + *picture_.alpha) == 0) continue;
      const double value = value_at(bytes, cell);
      const auto height = values_.height_of(value);
      if (!height) return bad(text::format("the height %g in row %u, column %u is beyond 1e7 m", value, row + 1, column + i + 1));
      raw_.z[std::size_t{row} * picture_.columns + column + i] = *height;
    }
    return {};
  }

  TIFF* tiff_;
  const std::filesystem::path& file_;
  const HeightOptions& options_;
  Picture picture_;
  RawHeights raw_;
  std::string unknown_unit_;  // name of the unit of the heights; empty if it is known or not stated
  HeightValues values_{std::nullopt};
};

}  // namespace

Result<HeightGrid> read_geo_tiff_heights(const std::filesystem::path& file, const HeightOptions& options) {
  const auto bad = [&](const std::string& what) { return failure(ErrorKind::bad_data, file.string() + ": " + what); };
  if (const auto regular = open_regular(file); !regular) return tl::make_unexpected(regular.error());
  std::error_code error;
  if (std::filesystem::file_size(file, error) > most_file_bytes || error)
    return bad("larger than 2 GiB; cut a part out (gdal_translate)");
  const Tiff tiff = open_tiff(file);
  if (!tiff) return bad("not a TIFF, or damaged: " + last_tiff_error());
  auto grid = GeoTiffReader(tiff.get(), file, options).read();
  if (!grid) return failure(grid.error().kind, file.string() + ": " + grid.error().text);
  return grid;
}

}  // namespace sonar
