// A picture in memory: RGB pixels, row 0 at the top, and the drawing that a fan image needs on top of its samples. Filled by
// draw_fan; write_png writes a whole file or none.
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

/// Mixes `colour` over a pixel; places outside the picture are ignored.
void blend(Raster& raster, int x, int y, Rgb colour, float opacity);

/// Digits, '.', '-', ' ' and 'm' in a 3 x 5 face, `scale` pixels a dot; other characters leave a gap.
void draw_text(Raster& raster, int left, int top, std::string_view text, Rgb colour, int scale);
int text_width(std::string_view text, int scale);

/// The bytes of a PNG file.
Result<std::vector<std::byte>> encode_png(const Raster& raster);

/// One part after the other into a file that is written beside its final name and renamed: what has the name is whole. io: the
/// file and the system's reason; of a file that cannot be written nothing is left.
Result<void> write_whole_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts);

/// Into a whole file; makes the folder.
Result<void> write_png(const Raster& raster, const std::filesystem::path& file);

}  // namespace sonar
