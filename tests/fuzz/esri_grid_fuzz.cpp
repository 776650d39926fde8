// ESRI ASCII grids, and the WKT beside them.
#include "core/scene/files/height_values.hpp"
#include "tests/fuzz/heights.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sonar::fuzz::check_grid_reader(
      data, size, [size](const auto& file) { return sonar::read_esri_heights(file, {.z_scale = size % 2 == 0 ? 1.0 : -1.0}); });
  (void)sonar::system_of_wkt({reinterpret_cast<const char*>(data), size});
  return 0;
}
