// A list with one range for each bearing. The range profile of 4.x and the range data of 3.x are both such a list.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/polar_ping.hpp"

namespace sonar::bvt {

/// Value of a bearing without an echo above the threshold. Clients treat values above 999 as no echo (verified).
inline constexpr float no_range_m = 1000;

/// The threshold until a program sets another. The vendor's is unknown. Ours is above the noise of the P900, P450, M450, M900 and
/// MB profiles at all ranges without gain adjustment (measured: at most 8100, at 60 m), so that empty water has no ranges.
/// Programs set 1000, 2000 or 30000 (verified).
inline constexpr std::uint16_t default_range_threshold = 10000;

struct RangeListSettings {
  enum class Policy { strongest = 1, nearest = 2 };
  Policy policy = Policy::strongest;                  // chosen default
  std::uint16_t threshold = default_range_threshold;  // an echo is stronger than this; 0: any sample that is not 0
  float start_range_m = 0;                            // nearer samples are ignored
  float noise_threshold = 0;                          // as in ImageSettings
  int sound_speed_override_mps = 0;                   // as in ImageSettings
};

/// Entry i belongs to beam i, from left to right. Its bearing, fov_min + i * resolution, is the left edge of the beam, whose
/// centre is half a step further right (verified for columns of R-Theta images, inferred for range lists).
struct RangeList {
  std::vector<float> range_m, bearing_deg;
  std::vector<std::uint16_t> intensity;  // 0 where there is no range
  float fov_min_deg = 0, fov_max_deg = 0;
  double range_resolution_m = 0, bearing_resolution_deg = 0;

  int count() const { return static_cast<int>(range_m.size()); }
  bool valid(int i) const { return range_m[static_cast<std::size_t>(i)] < 999; }
  int valid_count() const;
  /// Return the position in metres, 0 without a range. The vendor's axes are unknown; ours are those of XY images: x to
  /// starboard, y ahead.
  float x_m(int i) const;
  float y_m(int i) const;
};

/// Returns no_ping_signal for a ping without samples, or memory_alloc. On failure the list is empty.
Code make_range_list(const PolarPing& ping, const RangeListSettings& settings, RangeList& list);

}  // namespace sonar::bvt
