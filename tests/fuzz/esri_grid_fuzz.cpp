// ESRI ASCII grids.
#include "tests/fuzz/heights.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sonar::fuzz::check_grid_reader(
      data, size, [size](const auto& file) { return sonar::read_esri_heights(file, {.z_scale = size % 2 == 0 ? 1.0 : -1.0}); });
  return 0;
}
