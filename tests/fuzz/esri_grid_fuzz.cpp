// ESRI ASCII grids: whatever the text, the answer is a sound grid of heights or a sentence that starts with the file's name.
#include "tests/fuzz/heights.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  static const fuzz::MemoryFile file;
  file.fill({data, size});
  const auto grid = read_esri_heights(file.path(), {.z_scale = size % 2 == 0 ? 1.0 : -1.0});
  if (grid) {
    fuzz::check(*grid);
  } else {
    fuzz::require(grid.error().text.starts_with(file.path().string() + ": "));
  }
  return 0;
}
