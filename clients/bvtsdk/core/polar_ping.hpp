// One ping as the link delivers it: polar samples, their geometry, and navigation data. Images, range lists and recordings are
// made from it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/bvtsdk/core/bytes.hpp"

namespace sonar::bvt {

// The interface of the libraries has angles in degrees; the code inside uses radians.

inline constexpr double degrees = 57.29577951308232;  // degrees in a radian

/// The samples of a ping, beam after beam; at least 2 beams and 2 bins.
struct PolarGrid {
  const std::uint16_t* samples = nullptr;
  int beams = 0, bins = 0;
};

/// A table of the samples from which each pixel of an XY image is interpolated. All angles and square roots are computed
/// once for a geometry; the table then serves all pings of that geometry.
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
  /// Writes the pixels inside the sector, interpolated in bearing and range; does not change other pixels.
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

/// Bits of NavData::present; the fields follow in this order on the link.
enum NavField : std::uint16_t {
  nav_time = 1 << 0,
  nav_latitude = 1 << 1,
  nav_longitude = 1 << 2,
  nav_depth = 1 << 3,
  nav_altitude = 1 << 4,
  nav_pitch = 1 << 5,
  nav_roll = 1 << 6,
  nav_heading = 1 << 7,
  nav_heading_velocity = 1 << 8,
  nav_course = 1 << 9,
  nav_text = 1 << 10,
};

/// A field is valid only when its bit of `present` is set.
struct NavData {
  std::uint16_t present = 0;
  double time_s = 0;  // seconds since 1970 UTC
  double latitude_deg = 0, longitude_deg = 0;
  float depth_m = 0, altitude_m = 0;
  float pitch_deg = 0;    // bow up
  float roll_deg = 0;     // port up
  float heading_deg = 0;  // clockwise from true north
  float heading_velocity_mps = 0;
  float course_deg = 0;
  std::string text;

  bool has(NavField field) const { return (present & field) != 0; }
};

/// Sample k of beam j is samples[j * bins + k]: it covers start_m + k bin_m ... start_m + (k + 1) bin_m, and its bearing is
/// fov_min_deg + (j + 1/2) (fov_max_deg - fov_min_deg) / beams, clockwise from ahead. 65535 is full scale.
/// A decoded ping is finite throughout, 0 <= start_m < stop_m, bin_m > 0, sound_speed_mps > 0 and
/// -180 <= fov_min_deg < fov_max_deg <= 180.
struct PolarPing {
  std::int32_t head = 0;
  std::uint32_t number = 0;
  double time_s = 0;  // seconds since 1970 UTC
  std::int32_t time_zone_s = 0;
  float start_m = 0, stop_m = 0;
  std::int32_t sound_speed_mps = 1500;
  float fov_min_deg = 0, fov_max_deg = 0;
  float bin_m = 0;
  int beams = 0, bins = 0;  // if one is 0, the ping has no signal (error 4011)
  NavData nav;              // present == 0: none
  std::vector<std::uint16_t> samples;

  bool has_signal() const { return !samples.empty(); }
  double bearing_deg(double beam) const {
    return static_cast<double>(fov_min_deg) + (beam + 0.5) * static_cast<double>(fov_max_deg - fov_min_deg) / beams;
  }
  double range_m(double bin) const { return static_cast<double>(start_m) + (bin + 0.5) * static_cast<double>(bin_m); }
};

/// Decodes the payload of PING_DATA; nullopt when it is invalid, with the reason in `why`. Allocates no more
/// than the payload can hold, and never more than 64 MiB.
std::optional<PolarPing> decode_ping(BytesView payload, std::string* why = nullptr);

/// The three encodings of samples in PING_DATA: plain; a zlib stream; a zlib stream of all high bytes followed by all low bytes.
/// Most high bytes are 0, so the third is 15 to 23 % smaller than the second, and not slower.
enum class Packing : std::uint8_t { plain = 0, deflate = 1, planes = 2 };

/// Encodes a ping as the payload of PING_DATA.
Bytes encode_ping(const PolarPing& ping, Packing packing = Packing::plain);

/// Appends the bitmap and the values, as in PING_DATA and NAV_DATA; unknown bits are omitted.
void put_nav(Bytes& out, const NavData& nav);
/// Reads what put_nav() wrote. `reader.ok()` is false if it was incomplete or had unknown fields. Values that are not finite
/// count as absent.
NavData decode_nav(Reader& reader);

/// Returns the factor for ranges: override / the ping's sound speed, or 1 without an override (0).
double range_scale(const PolarPing& ping, int sound_speed_override_mps);
/// Returns the smallest sample that a noise threshold, a fraction of full scale, does not set to 0.
std::uint16_t lowest_significant(float noise_threshold);

/// A ping's samples made ready for imaging: thresholds applied, bins pooled, at least two beams of two bins. If none of this is
/// needed, the samples are read in place.
class SampleGrid {
 public:
  /// The ping must have samples and outlive this object. `pool`: number of bins that become one; its sample is the strongest of
  /// them. May throw bad_alloc.
  SampleGrid(const PolarPing& ping, float noise_threshold, float clipping_threshold, int pool);
  SampleGrid(const SampleGrid&) = delete;
  SampleGrid& operator=(const SampleGrid&) = delete;

  const PolarGrid& view() const { return view_; }
  /// Returns the length of a bin of the view in bins of the ping: the pool, or half of it if a single bin appears twice.
  double pooled() const { return pooled_; }

 private:
  PolarGrid view_;
  double pooled_ = 1;
  std::vector<std::uint16_t> made_;
};

}  // namespace sonar::bvt
