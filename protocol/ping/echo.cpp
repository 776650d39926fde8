#include "protocol/ping/echo.hpp"

#include <algorithm>
#include <cmath>

namespace sonar::ping {
namespace {

constexpr double full = 255;

/// Returns the amplitudes of the samples, of linear or logarithmic codes, on a scale of 0 to `full`.
std::vector<double> amplitudes_of(const Ping& ping) {
  const SampleFormat& format = ping.request.settings.format;
  const auto width = static_cast<std::size_t>(format.bits / 8);
  const double max_code = format.max_code;
  const double floor_db = static_cast<double>(format.floor_db), span_db = static_cast<double>(format.ceiling_db) - floor_db;
  std::vector<double> amplitudes(ping.samples.size() / width);
  for (std::size_t i = 0; i < amplitudes.size(); ++i) {
    const double code = sample_code(ping.samples, i, width);
    amplitudes[i] = format.scale == SampleFormat::Scale::linear ? full * code / max_code
                    : code > 0                                  ? full * std::pow(10, (floor_db + code / max_code * span_db) / 20)
                                                                : 0;
  }
  return amplitudes;
}

}  // namespace

Echo find_echo(const Ping& ping) {
  constexpr double least_snr_db = 10;  // unknown: assumed; the highest of 200 points of noise seldom reaches it
  constexpr double certain_snr_db = 30;
  constexpr int longest_gap = 2;  // number of successive points in an echo that speckle may weaken
  const PingSettings& s = ping.request.settings;
  const std::vector<double> amplitudes = amplitudes_of(ping);
  const auto amplitude = [&](int row) { return amplitudes[static_cast<std::size_t>(row)]; };
  const int rows = std::min(s.range_bin_count, static_cast<int>(amplitudes.size()));
  int first = 0;
  while (first < rows && s.range_of_row(first) < nearest_echo_m) ++first;
  if (first >= rows) return {};
  // Points nearer than nearest_echo_m count neither for the peak nor for the noise.
  std::vector<double> counted(amplitudes.begin() + first, amplitudes.begin() + rows);
  const int top = first + static_cast<int>(std::max_element(counted.begin(), counted.end()) - counted.begin());
  const auto middle = counted.begin() + static_cast<std::ptrdiff_t>(counted.size() / 2);
  std::nth_element(counted.begin(), middle, counted.end());
  Echo echo{.peak = amplitude(top)};
  if (echo.peak == 0) return echo;
  const double half = echo.peak / 2;
  // The echo extends from the peak towards the sonar, across short gaps. Its first point is the front.
  int front = top;
  for (int row = top - 1; row >= first && front - row <= longest_gap + 1; --row)
    if (amplitude(row) >= half) front = row;
  // The amplitude crosses half the peak at this part of the way from the front to the point before it (interpolated).
  const double below = front > 0 ? amplitude(front - 1) : half;
  const double part = front > 0 && below < half ? (amplitude(front) - half) / (amplitude(front) - below) : 0;
  // The echo of an even bed reaches half its peak at the distance of the bed, that of a mirror 0.7 pulses earlier. So half a
  // pulse is added, as a compromise.
  echo.range_m = s.range_of_row(front - part) + static_cast<double>(s.pulse_width_m) / 2;
  // A linear code of 0 may hide any noise below one code, so the noise counts as at least one code.
  const double least_noise = s.format.scale == SampleFormat::Scale::linear ? full / s.format.max_code : 1e-9;
  const double snr_db = 20 * std::log10(echo.peak / std::max(*middle, least_noise));
  echo.confidence =
      static_cast<int>(std::lround(100 * std::clamp((snr_db - least_snr_db) / (certain_snr_db - least_snr_db), 0.0, 1.0)));
  return echo;
}

Reach adjusted(const Reach& made_with, const Echo& echo, const ReachLimits& limits) {
  constexpr int sure = 50;      // least confidence of a valid distance, per cent
  constexpr double loud = 250;  // with this amplitude or more, the peak may be limited
  constexpr double loudest_wanted = 200;
  // The echo should be between the first two fractions of the range; a new range puts it at the third.
  constexpr double nearest_part = 0.35, farthest_part = 0.85, wanted_part = 0.6;
  constexpr std::uint32_t length_step_mm = 500, first_length_mm = 5000;
  const auto gain_of = [&](int index) { return limits.gains[static_cast<std::size_t>(index)]; };
  const int most_gain = static_cast<int>(limits.gains.size()) - 1;
  Reach next = made_with;
  if (echo.peak >= loud)
    next.gain = std::max(next.gain - 1, 0);
  else
    while (next.gain < most_gain && echo.peak * gain_of(next.gain + 1) / gain_of(made_with.gain) <= loudest_wanted) ++next.gain;
  const double length_mm = next.length_mm, at = 1000 * echo.range_m / length_mm;
  if (echo.confidence < sure) {  // searches: doubles the range, and after the longest begins again with the first
    next.length_mm = length_mm >= limits.most_mm ? first_length_mm : std::min(2 * next.length_mm, limits.most_mm);
  } else if (at < nearest_part || at > farthest_part) {
    const auto steps = static_cast<std::uint32_t>(std::ceil(1000 * echo.range_m / wanted_part / length_step_mm));
    next.length_mm = std::clamp(steps * length_step_mm, shortest_range_mm, limits.most_mm);
  }
  return next;
}

}  // namespace sonar::ping
