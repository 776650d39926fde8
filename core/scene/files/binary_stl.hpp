// Binary STL files, read a few triangles at a time: the importer of the other formats would hold three times the file in memory.
#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "core/scene/files/load_mesh.hpp"

namespace sonar {

/// How many triangles the file holds; nothing when its length says that it is not binary STL.
std::optional<std::uint64_t> triangles_of_binary_stl(std::FILE* file);
/// Every triangle as it stands in the file, material 0. Ends early where the file does.
void each_triangle_of_binary_stl(std::FILE* file, const TriangleSink& take);

}  // namespace sonar
