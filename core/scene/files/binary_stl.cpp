// Layout: 80 bytes of any kind, the count, then for each triangle its normal, three corners and two bytes of attributes; all
// little-endian.
#include "core/scene/files/binary_stl.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <vector>

namespace sonar {
namespace {

constexpr std::size_t header_bytes = 84, triangle_bytes = 50;

static_assert(std::endian::native == std::endian::little);
template <class T>
T value_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

}  // namespace

std::optional<std::uint64_t> triangles_of_binary_stl(std::FILE* file) {
  std::array<char, header_bytes> header{};
  if (std::fseek(file, 0, SEEK_SET) != 0 || std::fread(header.data(), 1, header.size(), file) != header.size()) return {};
  const std::uint64_t count = value_at<std::uint32_t>(&header[80]);
  if (std::fseek(file, 0, SEEK_END) != 0) return {};
  const long size = std::ftell(file);
  if (count == 0 || size < 0 || static_cast<std::uint64_t>(size) != header_bytes + triangle_bytes * count) return {};
  return count;
}

void each_triangle_of_binary_stl(std::FILE* file, const TriangleSink& take) {
  std::vector<char> block(triangle_bytes * 4096);
  if (std::fseek(file, header_bytes, SEEK_SET) != 0) return;
  while (const std::size_t read = std::fread(block.data(), triangle_bytes, block.size() / triangle_bytes, file)) {
    for (std::size_t t = 0; t < read; ++t) {
      std::array<Vec3d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto p = value_at<std::array<float, 3>>(&block[triangle_bytes * t + 12 + 12 * k]);
        corners[k] = to_double(Vec3{p[0], p[1], p[2]});
      }
      take(corners, 0);
    }
  }
}

}  // namespace sonar
