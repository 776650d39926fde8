// Reads TIFF files: the list of pictures in a file, and the cells of a picture strip by strip or tile by tile. Only geo_tiff.cpp
// uses it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "core/base/result.hpp"

struct tiff;  // libtiff's TIFF

namespace sonar {

constexpr std::uint64_t most_block_bytes = 64 << 20;

struct CloseTiff {
  void operator()(tiff* file) const;
};
using Tiff = std::unique_ptr<tiff, CloseTiff>;

/// Returns null if the file is not a TIFF or is damaged; last_tiff_error() then returns the reason.
Tiff open_tiff(const std::filesystem::path& file);
/// libtiff's last error of this thread; "damaged" if it gave none.
std::string last_tiff_error();

/// Finds the number of the picture that masks the first one, if any. Before and after the call, the file is at the first picture.
std::optional<std::uint16_t> mask_of(tiff* file);

struct Picture {
  std::uint32_t columns = 0, rows = 0;
  std::uint16_t bits = 1, format = 1, samples = 1;  // format 1: unsigned integers
  std::uint16_t bands = 1;                          // number of adjacent values of a cell; the first is the height
  std::optional<std::uint16_t> alpha;               // the band that is 0 for cells without data
  std::size_t value_bytes() const { return bits / 8u; }
  std::size_t bytes_of(std::uint32_t cells) const { return (std::size_t{bits} * bands * cells + 7) / 8; }
};

/// Describes the file's current picture.
Picture picture_at(tiff* file);
/// Fails if the picture is compressed in a way that is not read, or in blocks that are too large.
Result<void> check_blocks(tiff* file);

/// Receives the bytes of cells of a row, from the given column on; no bytes for a block that a sparse file does not contain.
using TakeCells =
    std::function<Result<void>(std::span<const std::byte> bytes, std::uint32_t column, std::uint32_t row, std::uint32_t width)>;
/// Unpacks the first plane of the picture, strip by strip or tile by tile.
Result<void> each_row_of_blocks(tiff* file, const Picture& picture, const TakeCells& take);

}  // namespace sonar
