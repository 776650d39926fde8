// Fuzzes files of points, one per line, that are read as a grid of heights.
#include "tests/fuzz/heights.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sonar::fuzz::check_grid_reader(data, size, [](const auto& file) { return sonar::read_xyz_heights(file, {}); });
  return 0;
}
