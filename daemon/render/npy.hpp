// Arrays as NumPy reads them (.npy, format version 1.0): a short header, then the bytes, little-endian, last index fastest.
// And whole files: written beside their final name and renamed, so that a file that is there is complete.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace sonar::render {

/// `type`: "<f4", "<c8", "|u1", "<u2", "<u4". The header's size is a multiple of 64.
std::string npy_header(std::string_view type, std::initializer_list<std::size_t> shape);

/// One after the other into one file. io: a full disk, a folder that is not there or not ours.
Result<void> write_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts);
inline std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

}  // namespace sonar::render
