// Numbers the vertices of a mesh. Equal positions are one vertex.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// A hash table of indices: 8 to 16 bytes per vertex. Positions are compared by their bits, with -0 equal to 0. Neighbouring
/// triangles share vertices. Therefore a small table, which fits in the processor's cache, holds the vertices that were found
/// last.
class VertexTable {
 public:
  /// Appends new vertices to `vertices`. No other code may append to it. `expected` is their approximate number.
  VertexTable(std::vector<Vec3>& vertices, std::size_t expected)
      : vertices_(vertices), slots_(std::bit_ceil(2 * expected + 1), none) {}

  std::uint32_t index_of(Vec3 v) {
    const Key key = key_of(v);
    const std::uint64_t hash = hash_of(key);
    std::uint32_t& recent = recent_[hash >> (64 - recent_bits)];
    if (recent >= vertices_.size() || key_of(vertices_[recent]) != key) recent = find_or_add(v, key, hash);
    return recent;
  }

 private:
  using Key = std::array<std::uint32_t, 3>;
  static constexpr std::uint32_t none = 0xFFFFFFFFu;

  static Key key_of(Vec3 v) {
    return {std::bit_cast<std::uint32_t>(v.x + 0.0f), std::bit_cast<std::uint32_t>(v.y + 0.0f),
            std::bit_cast<std::uint32_t>(v.z + 0.0f)};
  }
  static std::uint64_t hash_of(const Key& key) {
    std::uint64_t h = 0x9E3779B97F4A7C15u;
    for (const std::uint32_t b : key) h = (h ^ b) * 0xBF58476D1CE4E5B9u, h ^= h >> 29;
    return h;
  }
  std::uint32_t find_or_add(Vec3 v, const Key& key, std::uint64_t hash) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = hash & mask;
    for (; slots_[at] != none; at = (at + 1) & mask)
      if (key_of(vertices_[slots_[at]]) == key) return slots_[at];
    const auto index = static_cast<std::uint32_t>(vertices_.size());
    slots_[at] = index;
    vertices_.push_back(v);
    if (2 * vertices_.size() > slots_.size()) grow();
    return index;
  }
  void grow() {
    const std::size_t size = 2 * slots_.size(), mask = size - 1;
    slots_ = {};  // freed before the larger one is made
    slots_.resize(size, none);
    for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
      std::size_t at = hash_of(key_of(vertices_[i])) & mask;
      while (slots_[at] != none) at = (at + 1) & mask;
      slots_[at] = i;
    }
  }

  static constexpr int recent_bits = 15;
  std::vector<Vec3>& vertices_;
  std::vector<std::uint32_t> slots_;                                                                     // size is a power of two
  std::vector<std::uint32_t> recent_ = std::vector<std::uint32_t>(std::size_t{1} << recent_bits, none);  // by hash
};

}  // namespace sonar
