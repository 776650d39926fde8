// Decodes the keys of a GeoTIFF (OGC 19-008r4, annex B), which state the coordinate system of its cells, without libtiff.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.hpp"
#include "core/scene/files/height_values.hpp"

namespace sonar {

class GeoKeys {
 public:
  enum : std::uint16_t { raster_type = 1025 };
  static constexpr std::uint16_t pixel_is_point = 2;

  /// The values of the tags 34735, 34736 and 34737, which may be invalid.
  GeoKeys(std::vector<std::uint16_t> directory, std::vector<double> numbers, std::string texts)
      : words_(std::move(directory)), numbers_(std::move(numbers)), texts_(std::move(texts)) {}

  std::optional<std::uint16_t> value_of(std::uint16_t key) const;
  std::optional<double> number_of(std::uint16_t key) const;
  /// Returns at most `longest` letters.
  std::string text_of(std::uint16_t key, std::size_t longest = 80) const;

 private:
  struct Place {
    std::uint16_t tag, count, at;
  };
  std::optional<Place> place_of(std::uint16_t key) const;
  std::vector<std::uint16_t> words_;
  std::vector<double> numbers_;
  std::string texts_;
};

/// Reads the coordinate system. `height_unit`: the code of a unit that another part of the file states. Errors do not contain the
/// file name.
Result<CoordinateSystem> system_of_keys(const GeoKeys& keys, std::optional<std::uint16_t> height_unit);

/// Codes of units of length.
enum : std::uint16_t {
  unit_millimetre = 1025,
  unit_centimetre = 1033,
  unit_metre = 9001,
  unit_foot = 9002,
  unit_us_survey_foot = 9003,
  unit_fathom = 9014,
  unit_kilometre = 9036
};

// Reads TIFF tag 42112, in which GDAL stores the unit, scale and offset of a band.

/// The metadata of the first band. A height is scale * value + offset.
struct GdalMetadata {
  std::optional<std::uint16_t> height_unit = {};  // code of the unit of length; none if the unit is missing or unknown
  std::string unit_name = {};                     // as in the file
  double scale = 1, offset = 0;                   // NaN if they are not finite numbers
};

GdalMetadata gdal_metadata_of(std::string_view text);

}  // namespace sonar
