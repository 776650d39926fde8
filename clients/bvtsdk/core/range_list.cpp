#include "clients/bvtsdk/core/range_list.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "clients/bvtsdk/core/polar_ping.hpp"

namespace sonar::bvt {
namespace {

/// Returns the index of the selected sample, or n if there is none. Of equally strong samples it selects the nearest.
std::size_t chosen_bin(const std::uint16_t* samples, std::size_t first, std::size_t n, std::uint16_t lowest,
                       RangeListSettings::Policy policy) {
  if (first >= n) return n;
  // The compiler vectorises this loop. It is enough for most beams, which have no sample of `lowest` or more.
  std::uint16_t strongest = 0;
  for (std::size_t k = first; k < n; ++k) strongest = std::max(strongest, samples[k]);
  if (strongest < lowest) return n;
  const std::uint16_t* const from = samples + first;
  const std::uint16_t* const found = policy == RangeListSettings::Policy::nearest
                                         ? std::find_if(from, samples + n, [=](std::uint16_t v) { return v >= lowest; })
                                         : std::find(from, samples + n, strongest);
  return static_cast<std::size_t>(found - samples);
}

/// A bearing in the list is the left edge of a beam; the echoes of the beam are at its centre.
double centre_rad(const RangeList& list, int i) {
  return (static_cast<double>(list.bearing_deg[static_cast<std::size_t>(i)]) + 0.5 * list.bearing_resolution_deg) / degrees;
}

}  // namespace

int RangeList::valid_count() const {
  return static_cast<int>(std::count_if(range_m.begin(), range_m.end(), [](float r) { return r < 999; }));
}

float RangeList::x_m(int i) const {
  const double range = static_cast<double>(range_m[static_cast<std::size_t>(i)]);
  return valid(i) ? static_cast<float>(range * std::sin(centre_rad(*this, i))) : 0;
}

float RangeList::y_m(int i) const {
  const double range = static_cast<double>(range_m[static_cast<std::size_t>(i)]);
  return valid(i) ? static_cast<float>(range * std::cos(centre_rad(*this, i))) : 0;
}

Code make_range_list(const PolarPing& ping, const RangeListSettings& settings, RangeList& list) {
  list = {};
  if (!ping.has_signal()) return no_ping_signal;
  const double scale = range_scale(ping, settings.sound_speed_override_mps);
  const auto beams = static_cast<std::size_t>(ping.beams), bins = static_cast<std::size_t>(ping.bins);
  // The smallest sample that can be selected: above `threshold`, and not set to 0 by the noise threshold.
  const int lowest = std::max(settings.threshold + 1, static_cast<int>(lowest_significant(settings.noise_threshold)));
  const double skipped = (static_cast<double>(settings.start_range_m) / scale - static_cast<double>(ping.start_m)) /
                             static_cast<double>(ping.bin_m) -
                         0.5;  // a bin counts if its centre is not nearer than start_range_m
  const auto first = skipped > 0 ? static_cast<std::size_t>(std::ceil(std::min(skipped, static_cast<double>(bins)))) : 0;
  RangeList made;
  try {
    made.range_m.assign(beams, no_range_m);
    made.intensity.assign(beams, 0);
    made.bearing_deg.resize(beams);
  } catch (const std::bad_alloc&) {
    return memory_alloc;
  }
  made.fov_min_deg = ping.fov_min_deg;
  made.fov_max_deg = ping.fov_max_deg;
  made.range_resolution_m = scale * static_cast<double>(ping.bin_m);
  made.bearing_resolution_deg = (static_cast<double>(ping.fov_max_deg) - static_cast<double>(ping.fov_min_deg)) / ping.beams;
  for (std::size_t j = 0; j < beams; ++j) {
    made.bearing_deg[j] =
        static_cast<float>(static_cast<double>(ping.fov_min_deg) + static_cast<double>(j) * made.bearing_resolution_deg);
    if (lowest > 65535) continue;
    const std::uint16_t* const samples = ping.samples.data() + j * bins;
    const std::size_t bin = chosen_bin(samples, first, bins, static_cast<std::uint16_t>(lowest), settings.policy);
    const double range = scale * ping.range_m(static_cast<double>(bin));
    if (bin == bins || range >= 999) continue;
    made.range_m[j] = static_cast<float>(range);
    made.intensity[j] = samples[bin];
  }
  list = std::move(made);
  return success;
}

}  // namespace sonar::bvt
