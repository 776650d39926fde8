// Smooths a finished image as the filter flags request.
#pragma once

#include <cstdint>
#include <vector>

namespace sonar::bvt {

/// The lowest set flag wins (verified values; chosen: applied to the finished image).
enum FilterFlags : int { no_filter = 0, mean_3x3 = 2, mean_9x2 = 16 };

/// `pixels`: row-major, rows x columns. Means over 3 x 3 pixels, or over 9 rows x 2 columns (unknown: the vendor's orientation;
/// chosen: this column and the next). Pixels outside the image do not count. Other flags change nothing. May throw
/// std::bad_alloc.
void filter_image(int flags, int rows, int columns, std::vector<std::uint16_t>& pixels);

}  // namespace sonar::bvt
