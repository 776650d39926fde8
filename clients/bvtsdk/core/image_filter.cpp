#include "clients/bvtsdk/core/image_filter.hpp"

#include <algorithm>

namespace sonar::bvt {
namespace {

/// The pixels over which the mean for (row, col) is taken: rows row - above to row + below, columns col - left to col + right.
struct Window {
  int above, below, left, right;
};

/// A sliding window: a row is added to `sums` when the window reaches it, and subtracted when the window has left it. `sums` has
/// zeros on both sides, so that the inner loop needs no tests.
void mean_over(const Window& window, int height, int columns, std::vector<std::uint16_t>& pixels) {
  const auto width = static_cast<std::size_t>(columns);
  const auto margin = static_cast<std::size_t>(window.left + window.right);
  std::vector<std::uint16_t> out(pixels.size());
  std::vector<std::uint32_t> sums(width + margin, 0);  // for each column, the sum over the rows of the window
  std::vector<float> inside(width, 0);                 // for each column, the number of window columns in the image
  for (int col = 0; col < columns; ++col)
    inside[static_cast<std::size_t>(col)] =
        static_cast<float>(std::min(col, window.left) + 1 + std::min(columns - 1 - col, window.right));
  std::uint32_t* const inner = sums.data() + window.left;
  const auto row_at = [&](int row) { return pixels.data() + static_cast<std::size_t>(row) * width; };
  const auto add = [&](int row) {
    const std::uint16_t* const in = row_at(row);
    for (std::size_t c = 0; c < width; ++c) inner[c] += in[c];
  };
  const auto subtract = [&](int row) {
    const std::uint16_t* const in = row_at(row);
    for (std::size_t c = 0; c < width; ++c) inner[c] -= in[c];
  };
  for (int row = 0; row < std::min(window.below, height); ++row) add(row);
  for (int row = 0; row < height; ++row) {
    if (row + window.below < height) add(row + window.below);
    if (row - window.above - 1 >= 0) subtract(row - window.above - 1);
    const int rows = std::min(row, window.above) + 1 + std::min(height - 1 - row, window.below);
    std::uint16_t* const to = out.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t c = 0; c < width; ++c) {
      std::uint32_t sum = 0;
      for (std::size_t i = 0; i <= margin; ++i) sum += sums[c + i];
      // Sums of 18 pixels are exact in a float.
      to[c] = static_cast<std::uint16_t>(
          static_cast<int>(static_cast<float>(static_cast<int>(sum)) / (inside[c] * static_cast<float>(rows)) + 0.5f));
    }
  }
  pixels = std::move(out);
}

}  // namespace

void filter_image(int flags, int rows, int columns, std::vector<std::uint16_t>& pixels) {
  if (pixels.empty()) return;
  if (flags & mean_3x3)
    mean_over({1, 1, 1, 1}, rows, columns, pixels);
  else if (flags & mean_9x2)
    mean_over({4, 4, 0, 1}, rows, columns, pixels);
}

}  // namespace sonar::bvt
