// Binary STL files, read a few triangles at a time: the importer of the other formats would hold three times the file in memory.
#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "core/scene/files/clean_mesh.hpp"

namespace sonar {

/// How many triangles the file holds; nothing when its length says that it is not binary STL.
std::optional<std::uint64_t> triangles_of_binary_stl(std::FILE* file);
/// Gives `count` triangles as they stand in the file, material 0. False: the file could not be read so far.
bool each_triangle_of_binary_stl(std::FILE* file, std::uint64_t count, const TriangleSink& take);

}  // namespace sonar
