// Reads heights from a GeoTIFF, and its keys separately, because after a changed byte the keys of a file are seldom readable.
#include <cstring>

#include "core/scene/files/geo_keys.hpp"
#include "tests/fuzz/heights.hpp"

namespace {

/// Returns the bytes as values; a rest at the end is dropped.
template <class T>
std::vector<T> values_of(const std::uint8_t* data, std::size_t size) {
  std::vector<T> values(size / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), data, values.size() * sizeof(T));  // data is null when there are no bytes
  return values;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sonar::fuzz::check_grid_reader(data, size, [](const auto& file) { return sonar::read_geo_tiff_heights(file, {}); });
  const sonar::GeoKeys keys(values_of<std::uint16_t>(data, size), values_of<double>(data, size),
                            {reinterpret_cast<const char*>(data), size});
  const auto system = sonar::system_of_keys(keys, std::nullopt);
  sonar::fuzz::require(system ? system->name.size() <= 100 : !system.error().text.empty());
  return 0;
}
