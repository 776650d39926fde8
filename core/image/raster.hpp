// A picture in memory: RGB pixels, row 0 at the top, and functions that draw pixels and texts on it. write_png writes either a
// complete file or no file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/image/colour_map.hpp"

namespace sonar {

struct Raster {
  int width = 0, height = 0;
  std::vector<Rgb> pixels;  // [height][width]

  Raster(int width_px, int height_px)
      : width(width_px), height(height_px), pixels(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {}
  Rgb& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  const Rgb& at(int x, int y) const { return const_cast<Raster*>(this)->at(x, y); }
};

/// Mixes `colour` over a pixel. Pixels outside the picture are ignored.
void blend(Raster& raster, int x, int y, Rgb colour, float opacity);

/// Draws digits, '.', '-', 'm' and 's' in a 3 x 5 font, with dots of `scale` pixels; other characters are blank.
void draw_text(Raster& raster, int left, int top, std::string_view text, Rgb colour, int scale);
int text_width(std::string_view text, int scale);

/// Returns the bytes of a PNG file.
Result<std::vector<std::byte>> encode_png(const Raster& raster);

/// Writes the parts to a temporary file and renames it, so that `file` is always complete. If `file` is a symbolic link, its
/// target is replaced and the link stays. Devices and pipes are written directly. On an error (io, with the file and the
/// system's reason) the temporary file is removed.
Result<void> write_whole_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts);

/// Writes a PNG file with write_whole_file(), and makes its folder if needed.
Result<void> write_png(const Raster& raster, const std::filesystem::path& file);

// Encodes 8-bit or 16-bit integers, such as samples and labels, as grey PNG files without a colour map.

/// Encodes little-endian values, `bits` / 8 bytes each, [height][width]; 8 or 16 bits. Equal values give equal bytes.
Result<std::vector<std::byte>> encode_gray_png(std::span<const std::byte> values, int width, int height, int bits);

}  // namespace sonar
