// The header of a PLY file: the format, and the counts and properties of its elements.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace sonar {

constexpr std::size_t ply_head_bytes = 64 << 10;  // limit of a header

struct PlyProperty {
  bool is_list = false;
  std::uint64_t bytes = 0;  // size in a binary file; of a list: of its count
};
struct PlyElement {
  std::string name;
  std::uint64_t count = 0;  // the largest number if it is larger than that
  std::vector<PlyProperty> properties;
};
struct PlyHead {
  std::size_t bytes = 0;  // size with its last line end; 0 if it is not whole, and then nothing else is known
  bool is_text = false;
  std::vector<PlyElement> elements;

  /// Number of faces that the header counts.
  std::uint64_t faces() const;
};

/// Reads the header at the beginning of `file`, within its first ply_head_bytes. Words may be in capitals.
PlyHead ply_head_of(std::string_view file);

}  // namespace sonar
