// Writes NumPy arrays (.npy, format version 1.0): a short header, then the bytes, little-endian, last index fastest.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

namespace sonar::render {

/// `type`: "<f4", "<c8", "|u1", "<u2", "<u4". The header's size is a multiple of 64.
std::string npy_header(std::string_view type, std::initializer_list<std::size_t> shape);

inline std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

}  // namespace sonar::render
