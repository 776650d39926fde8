// Tables of the samples that make each pixel of an XY image. They are computed once for a geometry and used for every ping with
// it. The slow part of imaging (angles, square roots) is done here.
#pragma once

#include <cstdint>
#include <vector>

namespace sonar::bvt {

/// Samples of a ping as imaging reads them: beam after beam, at least 2 x 2.
struct PolarGrid {
  const std::uint16_t* samples = nullptr;
  int beams = 0, bins = 0;
};

class PolarLookup {
 public:
  struct Key {
    int height = 0, width = 0;
    int origin_row = 0, origin_col = 0;  // the sonar
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
  /// Writes the pixels inside the sector by bilinear interpolation in bearing and range; leaves the others as they are.
  /// `grid` has the key's beams and bins, `pixels` its height x width.
  void apply(const PolarGrid& grid, std::uint16_t* pixels) const;

 private:
  struct Entry {
    std::uint32_t sample;                    // the one of the four to the left and nearest
    std::uint16_t along_range, along_beams;  // weight of the further ones, 0 to 32768
  };
  struct Span {
    std::uint32_t pixel, count;
  };

  Key key_;
  std::vector<Span> spans_;     // runs of pixels inside the sector
  std::vector<Entry> entries_;  // for all of them, in order
};

}  // namespace sonar::bvt
