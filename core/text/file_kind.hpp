// Recognises files of unexpected kinds by their first bytes: archives, web pages and other results of failed downloads. So
// errors of the readers of meshes, grids and trajectories name the kind of file, instead of a wrong word in the file.
#pragma once

#include <string>
#include <string_view>

namespace sonar::text {

/// Number of bytes that unusable_kind() needs.
inline constexpr std::size_t kind_bytes = 64;

enum class FileUse { mesh, height_map, poses };

/// Returns, for example, "is compressed with gzip; unpack it", with advice only if it fits the use. The text follows "FILE: ".
/// Empty for other files.
std::string unusable_kind(std::string_view begin, FileUse use);

}  // namespace sonar::text
