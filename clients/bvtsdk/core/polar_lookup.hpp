// A table of the samples from which each pixel of an XY image is interpolated. All angles and square roots are computed
// once for a geometry; the table then serves all pings of that geometry.
#pragma once

#include <cstdint>
#include <vector>

namespace sonar::bvt {

/// The samples of a ping, beam after beam; at least 2 beams and 2 bins.
struct PolarGrid {
  const std::uint16_t* samples = nullptr;
  int beams = 0, bins = 0;
};

class PolarLookup {
 public:
  struct Key {
    int height = 0, width = 0;
    int origin_row = 0, origin_col = 0;  // position of the sonar
    double pixel_m = 0;
    double start_m = 0, stop_m = 0, bin_m = 0;
    double fov_min_deg = 0, fov_max_deg = 0;
    int beams = 0, bins = 0;

    bool operator==(const Key& o) const {
      return height == o.height && width == o.width && origin_row == o.origin_row && origin_col == o.origin_col &&
             pixel_m == o.pixel_m && start_m == o.start_m && stop_m == o.stop_m && bin_m == o.bin_m &&
             fov_min_deg == o.fov_min_deg && fov_max_deg == o.fov_max_deg && beams == o.beams && bins == o.bins;
    }
  };

  /// May throw std::bad_alloc.
  explicit PolarLookup(const Key& key);
  const Key& key() const { return key_; }
  /// Writes the pixels inside the sector by bilinear interpolation in bearing and range; does not change the others.
  /// `grid` must have the beams and bins of the key, `pixels` its height x width.
  void apply(const PolarGrid& grid, std::uint16_t* pixels) const;

 private:
  struct Entry {
    std::uint32_t sample;                    // index of the first of four samples: the near left one
    std::uint16_t along_range, along_beams;  // weights of the far and of the right samples, 0 to 32768
  };
  struct Span {
    std::uint32_t pixel, count;
  };

  Key key_;
  std::vector<Span> spans_;     // runs of pixels inside the sector
  std::vector<Entry> entries_;  // entries of the pixels of all spans, in order
};

}  // namespace sonar::bvt
