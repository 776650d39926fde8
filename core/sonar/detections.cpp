#include "core/sonar/detections.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

/// Levels [dB] of a picture.
class Levels {
 public:
  explicit Levels(const Ping& ping)
      : beams(static_cast<int>(ping.beam_azimuth_rad.size())),
        rows(ping.request.settings.range_bin_count),
        bytes_(ping.request.settings.format.bits / 8),
        samples_(ping.samples),
        format_(ping.request.settings.format) {}

  double operator()(int row, int beam) const {
    const std::size_t at = (static_cast<std::size_t>(row) * static_cast<std::size_t>(beams) + static_cast<std::size_t>(beam)) *
                           static_cast<std::size_t>(bytes_);
    std::uint32_t code = 0;
    for (int i = 0; i < bytes_; ++i)
      code |= std::to_integer<std::uint32_t>(samples_[at + static_cast<std::size_t>(i)]) << (8 * i);
    const double span = static_cast<double>(format_.ceiling_db) - static_cast<double>(format_.floor_db);
    return static_cast<double>(format_.floor_db) + span * code / format_.max_code;
  }
  double median_of(int beam) const {
    std::vector<double> all;
    for (int row = 0; row < rows; ++row) all.push_back((*this)(row, beam));
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
  }

  const int beams, rows;

 private:
  int bytes_;
  const std::vector<std::byte>& samples_;
  const SampleFormat& format_;
};

/// Where a parabola through three levels has its top, from the middle one, within half a step.
double top_of(double before, double middle, double after) {
  const double curve = before - 2 * middle + after;
  return curve < 0 ? std::clamp(0.5 * (before - after) / curve, -0.5, 0.5) : 0;
}

}  // namespace

std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db) {
  const Levels level(ping);
  std::vector<Detection> points;
  int last_row = -1, last_beam = -1;
  for (int d = 0; d < directions; ++d) {
    const int first = d * level.beams / directions, end = (d + 1) * level.beams / directions;
    int row = 0, beam = first;
    for (int r = 0; r < level.rows; ++r)
      for (int b = first; b < end; ++b)
        if (level(r, b) > level(row, beam)) row = r, beam = b;
    if (first == end || level(row, beam) < level.median_of(beam) + above_db) continue;
    // Up the slope of the pattern, to the beam that looks at the echo.
    const int reach = end - first;
    for (int steps = 0; steps < reach; ++steps) {
      const int best = beam > 0 && level(row, beam - 1) > level(row, beam) ? beam - 1 : beam;
      const int next = beam + 1 < level.beams && level(row, beam + 1) > level(row, best) ? beam + 1 : best;
      if (next == beam) break;
      beam = next;
    }
    if (row == last_row && beam == last_beam) continue;
    last_row = row, last_beam = beam;
    Detection point{static_cast<double>(ping.beam_azimuth_rad[static_cast<std::size_t>(beam)]),
                    ping.request.settings.range_of_row(row)};
    if (beam > 0 && beam + 1 < level.beams) {
      const double shift = top_of(level(row, beam - 1), level(row, beam), level(row, beam + 1));
      const std::size_t neighbour = static_cast<std::size_t>(shift < 0 ? beam - 1 : beam + 1);
      point.azimuth_rad += std::abs(shift) * (static_cast<double>(ping.beam_azimuth_rad[neighbour]) - point.azimuth_rad);
    }
    if (row > 0 && row + 1 < level.rows)
      point.range_m =
          ping.request.settings.range_of_row(row + top_of(level(row - 1, beam), level(row, beam), level(row + 1, beam)));
    points.push_back(point);
  }
  return points;
}

}  // namespace sonar
