// Names what a file is instead of what was expected, by its first bytes: archives, web pages and other results of a download
// that went wrong. Used by readers of meshes, grids and trajectories, before a reader complains of single words.
#pragma once

#include <string_view>

namespace sonar::text {

/// How many bytes of a file it looks at.
inline constexpr std::size_t kind_bytes = 64;

/// "is compressed with gzip; unpack it": follows "FILE: ". Empty for all else.
std::string_view unusable_kind(std::string_view begin);

}  // namespace sonar::text
