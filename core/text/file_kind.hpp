// Recognises files of unexpected kinds by their first bytes: archives, web pages and other results of failed downloads. Readers
// of meshes, grids and trajectories use it, so that the error names the kind of file instead of a wrong word in it.
#pragma once

#include <string_view>

namespace sonar::text {

/// Number of bytes that unusable_kind() needs.
inline constexpr std::size_t kind_bytes = 64;

/// Returns, for example, "is compressed with gzip; unpack it". The text follows "FILE: ". Empty for other files.
std::string_view unusable_kind(std::string_view begin);

}  // namespace sonar::text
