// Layout: 80 bytes of any kind, the count, then for each triangle its normal, three corners and two bytes of attributes; all
// little-endian.
#include "core/scene/files/binary_stl.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

namespace sonar {
namespace {

constexpr std::size_t header_bytes = 84, triangle_bytes = bytes_of_stl_triangle;

static_assert(std::endian::native == std::endian::little);
template <class T>
T value_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

}  // namespace

std::optional<BinaryStl> binary_stl(std::FILE* file) {
  std::array<char, header_bytes> header{};
  if (std::fseek(file, 0, SEEK_SET) != 0 || std::fread(header.data(), 1, header.size(), file) != header.size()) return {};
  const std::uint64_t count = value_at<std::uint32_t>(&header[80]);
  if (std::fseek(file, 0, SEEK_END) != 0) return {};
  const long size = std::ftell(file);
  const std::uint64_t whole = header_bytes + triangle_bytes * count;
  if (count == 0 || size < 0 || static_cast<std::uint64_t>(size) < whole) return {};
  return BinaryStl{count, static_cast<std::uint64_t>(size) - whole};
}

bool each_triangle_of_binary_stl(std::FILE* file, std::uint64_t count, const TriangleSink& take) {
  constexpr std::uint64_t at_once = 4096;
  std::vector<char> block(triangle_bytes * at_once);
  if (std::fseek(file, header_bytes, SEEK_SET) != 0) return false;
  for (std::uint64_t given = 0; given < count; given += at_once) {
    const std::size_t wanted = std::min(at_once, count - given);
    if (std::fread(block.data(), triangle_bytes, wanted, file) != wanted) return false;
    for (std::size_t t = 0; t < wanted; ++t) {
      std::array<Vec3d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto p = value_at<std::array<float, 3>>(&block[triangle_bytes * t + 12 + 12 * k]);
        corners[k] = to_double(Vec3{p[0], p[1], p[2]});
      }
      take(corners, 0);
    }
  }
  return true;
}

}  // namespace sonar
