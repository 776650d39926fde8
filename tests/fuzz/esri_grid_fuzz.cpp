// Fuzzes ESRI ASCII grids, and the file with WKT (well-known text) beside them.
#include "core/scene/files/height_values.hpp"
#include "tests/fuzz/heights.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sonar::fuzz::check_grid_reader(
      data, size, [size](const auto& file) { return sonar::read_esri_heights(file, {.z_scale = size % 2 == 0 ? 1.0 : -1.0}); });
  const auto system = sonar::system_of_wkt({reinterpret_cast<const char*>(data), size});
  sonar::fuzz::require(system.unit_m > 0 && system.height_unit_m > 0 && system.name.size() <= 100);
  sonar::fuzz::require(!system.utm || (system.utm->number >= 1 && system.utm->number <= 60));
  return 0;
}
