// Smooths a finished image as the filter flags request.
#pragma once

#include "clients/bvtsdk/core/imaging.hpp"

namespace sonar::bvt {

/// Means over 3 x 3 pixels, or over 9 rows x 2 columns (unknown: the vendor's orientation; chosen: this column and the next).
/// Pixels outside the image do not count. Other flags change nothing. May throw std::bad_alloc.
void filter_image(int flags, MagImage& image);

}  // namespace sonar::bvt
