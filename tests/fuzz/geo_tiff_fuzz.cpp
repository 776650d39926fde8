// GeoTIFF as heights, and its keys alone: a changed byte of a file seldom leaves them readable.
#include <cstring>

#include "core/scene/files/geo_keys.hpp"
#include "tests/fuzz/heights.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sonar::fuzz::check_grid_reader(data, size, [](const auto& file) { return sonar::read_geo_tiff_heights(file, {}); });
  std::vector<std::uint16_t> words(size / 2);
  std::memcpy(words.data(), data, 2 * words.size());
  std::vector<double> numbers(size / 8);
  std::memcpy(numbers.data(), data, 8 * numbers.size());
  const sonar::GeoKeys keys(std::move(words), std::move(numbers), {reinterpret_cast<const char*>(data), size});
  const auto system = sonar::system_of_keys(keys, std::nullopt);
  sonar::fuzz::require(system ? system->name.size() <= 100 : !system.error().text.empty());
  return 0;
}
