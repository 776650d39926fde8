// This file replaces geo_tiff.cpp in builds without libtiff.
#include "core/scene/shapes/terrain.hpp"

namespace sonar {

Result<HeightGrid> read_geo_tiff_heights(const std::filesystem::path& file, const HeightOptions&) {
  return failure(ErrorKind::unavailable, file.string() +
                                             ": this sonard was built without libtiff, so it reads no GeoTIFF; build it "
                                             "with libtiff-dev, or convert the file: gdal_translate -of AAIGrid " +
                                             file.filename().string() + " " + file.stem().string() + ".asc");
}

}  // namespace sonar
