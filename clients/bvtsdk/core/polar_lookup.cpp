#include "clients/bvtsdk/core/polar_lookup.hpp"

#include <algorithm>
#include <cmath>

#include "clients/bvtsdk/core/degrees.hpp"

namespace sonar::bvt {
namespace {

constexpr std::uint32_t one = 32768;  // a weight of 1: products with 16 bits still fit 32

struct Place {
  int low;
  std::uint16_t weight;
};

/// The two of n samples between whose centres `index` lies; beyond the outermost centres, the outermost sample counts.
Place place_of(double index, int n) {
  const double inside = std::clamp(index, 0.0, static_cast<double>(n - 1));
  const int low = std::min(static_cast<int>(inside), n - 2);
  return {low, static_cast<std::uint16_t>(std::lround((inside - low) * one))};
}

std::uint32_t between(std::uint32_t a, std::uint32_t b, std::uint32_t weight) {
  return (a * (one - weight) + b * weight + one / 2) / one;
}

}  // namespace

PolarLookup::PolarLookup(const Key& key) : key_(key) {
  const double beam_deg = (key.fov_max_deg - key.fov_min_deg) / key.beams;
  const double end_m = std::min(key.stop_m, key.start_m + key.bins * key.bin_m * (1 + 1e-6));
  for (int row = 0; row < key.height; ++row) {
    const double ahead_m = (key.origin_row - row) * key.pixel_m;
    if (ahead_m > end_m) continue;
    bool inside_before = false;
    for (int col = 0; col < key.width; ++col) {
      const double starboard_m = (col - key.origin_col) * key.pixel_m;
      const double range_m = std::sqrt(starboard_m * starboard_m + ahead_m * ahead_m);
      bool inside = range_m >= key.start_m && range_m <= end_m;
      double bearing_deg = 0;
      if (inside) {
        bearing_deg = degrees * std::atan2(starboard_m, ahead_m);
        inside = bearing_deg >= key.fov_min_deg && bearing_deg <= key.fov_max_deg;
      }
      if (inside) {
        const Place beam = place_of((bearing_deg - key.fov_min_deg) / beam_deg - 0.5, key.beams);
        const Place bin = place_of((range_m - key.start_m) / key.bin_m - 0.5, key.bins);
        const auto pixel =
            static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(key.width) + static_cast<std::uint32_t>(col);
        if (!inside_before) spans_.push_back({pixel, 0});
        ++spans_.back().count;
        const auto sample = static_cast<std::uint32_t>(beam.low) * static_cast<std::uint32_t>(key.bins);
        entries_.push_back({sample + static_cast<std::uint32_t>(bin.low), bin.weight, beam.weight});
      }
      inside_before = inside;
    }
  }
}

void PolarLookup::apply(const PolarGrid& grid, std::uint16_t* pixels) const {
  const std::uint16_t* const samples = grid.samples;
  const auto next_beam = static_cast<std::size_t>(grid.bins);
  const Entry* entry = entries_.data();
  for (const Span& span : spans_) {
    std::uint16_t* const run = pixels + span.pixel;
    for (std::uint32_t i = 0; i < span.count; ++i) {
      const Entry e = entry[i];
      const std::uint16_t* const s = samples + e.sample;
      const std::uint32_t left = between(s[0], s[1], e.along_range);
      const std::uint32_t right = between(s[next_beam], s[next_beam + 1], e.along_range);
      run[i] = static_cast<std::uint16_t>(between(left, right, e.along_beams));
    }
    entry += span.count;
  }
}

}  // namespace sonar::bvt
