// Rewrites glTF files whose vertices are whole numbers (KHR_mesh_quantization), which the importer would read as floating-point
// numbers, and files with skins without matrices, on which it would crash.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace sonar {

/// Reads a file that the glTF file names; nullopt if it cannot be read.
using ReadBeside = std::function<std::optional<std::string>(const std::string& name)>;

/// Makes a GLB file, version 2, with the nodes, meshes and skins of `file`, and floating-point positions and weights of bones.
/// It has no normals, colours, textures or animations, and only the names of materials. `file`: text or GLB, version 2.
/// `most_bytes`: limit of the result's size; GLB files have sizes of 32 bits. Errors do not contain the file's name.
Result<std::string> gltf_with_floats(std::string_view file, const ReadBeside& beside,
                                     std::uint64_t most_bytes = std::numeric_limits<std::uint32_t>::max());

/// Replaces "%20" with a blank, and other codes likewise. A zero byte ("%00") stays as it is.
std::string without_percents(const std::string& uri);

}  // namespace sonar
