// Binary STL files, read a few triangles at a time: the importer of the other formats would hold three times the file in memory.
#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "core/scene/files/clean_mesh.hpp"

namespace sonar {

inline constexpr std::size_t bytes_of_stl_triangle = 50;

struct BinaryStl {
  std::uint64_t triangles = 0;     // as its header says
  std::uint64_t bytes_behind = 0;  // what a program has put behind them
};

/// Nothing when the file is too short for the triangles of its header, as every text is: then it is not binary STL.
std::optional<BinaryStl> binary_stl(std::FILE* file);
/// Gives `count` triangles as they stand in the file, material 0. False: the file could not be read so far.
bool each_triangle_of_binary_stl(std::FILE* file, std::uint64_t count, const TriangleSink& take);

}  // namespace sonar
