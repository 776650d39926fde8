// Smooths a finished image as the filter flags request.
#pragma once

#include <cstdint>
#include <vector>

namespace sonar::bvt {

/// If several flags are set, the lowest applies (the values are verified; that the finished image is filtered is our choice).
enum FilterFlags : int { no_filter = 0, mean_3x3 = 2, mean_9x2 = 16 };

/// `pixels`: row-major, rows x columns. Replaces each pixel by the mean of 3 x 3 pixels, or of 9 rows x 2 columns (this column
/// and the next: our choice, because the vendor's is unknown). Pixels outside the image do not count. Other flags have no effect.
/// May throw std::bad_alloc.
void filter_image(int flags, int rows, int columns, std::vector<std::uint16_t>& pixels);

}  // namespace sonar::bvt
