// GeoTIFF: whatever the bytes, the answer is a sound grid of heights or a sentence that starts with the file's name.
#include "tests/fuzz/heights.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  static const fuzz::MemoryFile file;
  file.fill({data, size});
  const auto grid = read_geo_tiff_heights(file.path(), {});
  if (grid) {
    fuzz::check(*grid);
  } else {
    fuzz::require(grid.error().text.starts_with(file.path().string() + ": "));
  }
  return 0;
}
