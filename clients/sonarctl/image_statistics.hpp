// Statistics of the samples of an image: speckle correlation, shadow depth, noise floor over range.
// They are computed from the sent codes; `sonarctl stats` prints them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/image/sonar_picture.hpp"

namespace sonar::clients {

/// The rows [row_begin, row_end) and beams [beam_begin, beam_end).
struct Window {
  std::size_t row_begin = 0, row_end = 0, beam_begin = 0, beam_end = 0;
};
Window whole(const PolarImage& image);
/// Parses "400:650" or "400:650,100:200" (rows, beams); a missing end is that of the image. Error usage: empty or outside.
Result<Window> parse_window(const std::string& text, const PolarImage& image);

double mean(const PolarImage& image, const Window& window);
/// Returns the Pearson correlation of the window's samples with those `rows` and `beams` further on; 0 if all are equal.
double correlation(const PolarImage& image, const Window& window, std::size_t rows, std::size_t beams);
/// Returns the fraction of the window's samples at or above a code.
double share_at_least(const PolarImage& image, const Window& window, float code);
/// Returns the codes below which the given fractions (0..1) of the window's samples lie.
std::vector<double> percentiles(const PolarImage& image, const Window& window, const std::vector<double>& shares);
/// Returns the mean of each block of `rows` rows, all beams; the last block may be shorter.
std::vector<double> block_means(const PolarImage& image, std::size_t rows);
/// Returns the end of the near field: the first row, from 16 on, whose median over the beams is above `code` and above `factor`
/// times the median of the rows before it; image.rows if there is none. Rows 0 to 7 (transmit leak) are ignored.
std::size_t first_echo_row(const PolarImage& image, double factor = 3, double code = 10);

}  // namespace sonar::clients
