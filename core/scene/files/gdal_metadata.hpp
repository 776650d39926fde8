// Reads TIFF tag 42112, in which GDAL stores the unit, scale and offset of a band.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace sonar {

/// The metadata of the first band. A height is scale * value + offset.
struct GdalMetadata {
  std::optional<std::uint16_t> height_unit = {};  // code of the unit of length; other units, as of a sensor, are ignored
  double scale = 1, offset = 0;                   // NaN if they are not finite numbers
};

GdalMetadata gdal_metadata_of(std::string_view text);

}  // namespace sonar
