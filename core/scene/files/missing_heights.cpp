// Heights that mean no data: declared values, fill values beyond every height, and usual fill values far from all heights.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "core/scene/files/height_values.hpp"
#include "core/text/format.hpp"

namespace sonar {
namespace {

constexpr double highest_m = 1e7, least_fill = 1e20;
constexpr float none = std::numeric_limits<float>::quiet_NaN();
/// Limits of 32-bit integers. No height is as large.
constexpr std::array<double, 4> ends_of_32_bits{-2147483648.0, -2147483647.0, 2147483647.0, 4294967295.0};

/// The value of one unit in the last digit of a number as it is written.
double last_digit(std::string_view word, double value) {
  int digits = 0;
  for (const char c : word.substr(0, word.find_first_of("eE"))) digits += (c >= '0' && c <= '9') && (digits > 0 || c != '0');
  return std::pow(10.0, std::floor(std::log10(std::abs(value))) - std::max(digits, 1) + 1);
}

/// True for usual fill values that could also be heights: limits of 16-bit integers, -10000, and numbers whose only digit is 9,
/// such as -9999 and 99999.99.
bool is_usual_fill(float z) {
  static const std::vector<float> fills = [] {
    std::vector<float> all{-32768, -32767, 32767, 65535, -10000};
    for (const double decimals : {0.0, 0.9, 0.99})
      for (double nines = 999; nines < highest_m; nines = 10 * nines + 9)
        for (const double sign : {-1.0, 1.0}) all.push_back(static_cast<float>(sign * (nines + decimals)));
    std::sort(all.begin(), all.end());
    return all;
  }();
  return std::abs(z) >= 999 && std::binary_search(fills.begin(), fills.end(), z);
}

struct Span {
  float low = std::numeric_limits<float>::infinity(), high = -std::numeric_limits<float>::infinity();
};

/// Returns a text such as "3 cells of -9999".
std::string cells_text(std::size_t count, float z) {
  return text::counted(count, "cell") + text::format(" of %.7g", static_cast<double>(z));
}

/// Adds a note about a lowest or highest value that is far from all others, as undeclared fill values are.
void note_far_value(const RawHeights& raw, float sign, std::vector<std::string>& notes) {
  Span others;
  float end = others.low;  // the lowest of sign * z
  std::size_t cells = 0, all = 0;
  for (const float height : raw.z) {
    const float z = sign * height;
    if (std::isnan(z)) continue;
    ++all;
    if (z == end) {
      ++cells;
    } else if (z < end) {
      others = {end, std::max(others.high, std::isinf(end) ? others.high : end)};
      end = z, cells = 1;
    } else {
      others = {std::min(others.low, z), std::max(others.high, z)};
    }
  }
  constexpr float least_gap = 50, spans_apart = 10;
  const float gap = others.low - end;
  const bool is_rarer = 2 * cells < all || others.low < others.high;  // the rarer one, if there are two values
  if (is_rarer && std::isfinite(gap) && gap > std::max(least_gap, spans_apart * (others.high - others.low)))
    notes.push_back(cells_text(cells, sign * end) +
                    text::format(", %.4g away from all other heights: missing values? Declare them in the file (NODATA_value; "
                                 "gdal_translate -a_nodata)",
                                 static_cast<double>(gap)));
}

}  // namespace

void take_out_fills(RawHeights& raw, std::vector<std::string>& notes) {
  Span rest;
  for (const float z : raw.z)
    if (!std::isnan(z) && !is_usual_fill(z)) rest = {std::min(rest.low, z), std::max(rest.high, z)};
  if (rest.low > rest.high) return;
  std::map<float, std::size_t> cells;
  constexpr float gap_m = 100;
  for (float& z : raw.z) {
    if (!is_usual_fill(z) || (z > rest.low - gap_m && z < rest.high + gap_m)) continue;
    ++cells[z];
    z = none;
  }
  for (const auto& [z, count] : cells)
    notes.push_back(cells_text(count, z) + ", far from all heights, treated as missing, although the file does not declare it");
  if (raw.fill_values > 0)
    notes.push_back(text::counted(raw.fill_values, "cell") +
                    " beyond every height treated as missing, although the file does not declare it");
  for (const float sign : {1.0f, -1.0f}) note_far_value(raw, sign, notes);
}

HeightValues::HeightValues(std::optional<std::string_view> declared) {
  if (!declared) return;
  declared_ = height_number(*declared);
  if (!declared_ || std::isnan(*declared_)) {
    declared_.reset();
    return;
  }
  // Accepts the same value in single precision. A value beyond every height may also have been rounded to few digits. The
  // tolerance is limited, so that no height counts as missing: without the limit, the tolerance of 1e20 would include 0.
  const double size = std::abs(*declared_);
  tolerance_ = size > highest_m ? std::min(last_digit(*declared, *declared_), 0.5 * (size - highest_m)) : 1e-6 * size;
}

std::optional<float> HeightValues::height_of(double value) {
  if (std::isnan(value) || (declared_ && std::abs(value - *declared_) <= tolerance_)) return none;
  if (std::abs(value) <= highest_m) return static_cast<float>(value);
  const bool is_end = std::any_of(ends_of_32_bits.begin(), ends_of_32_bits.end(),
                                  [&](double end) { return std::abs(value - end) <= 1; });  // single precision rounds them
  if (std::abs(value) < least_fill && !is_end) return std::nullopt;
  ++fill_values_;
  return none;
}

}  // namespace sonar
