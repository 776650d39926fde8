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

/// Where a parabola through three levels has its top, from the middle one, within less than half a step.
double top_of(double before, double middle, double after) {
  const double curve = before - 2 * middle + after;
  return curve < 0 ? std::clamp(0.5 * (before - after) / curve, -0.49, 0.49) : 0;
}

/// What an echo shows beside its place: at most this is heard of it in other beams and at other ranges.
class Flanks {
 public:
  Flanks(const Ping& ping, const Levels& level, double beam_width_rad) : beams_(level.beams) {
    const double width = 2 * std::sin(beam_width_rad / 2);
    for (int k = 0; k < beams_; ++k)
      for (int b = 0; b < beams_; ++b) {
        const auto sine = [&](int j) {
          return std::sin(static_cast<double>(ping.beam_azimuth_rad[static_cast<std::size_t>(j)]));
        };
        below_.push_back(std::min(9 * std::pow((sine(k) - sine(b)) / width, 2), side_lobes_db));
      }
    // Along the range a pulse falls faster than this.
    const double pulse_rows =
        std::max(static_cast<double>(ping.request.settings.pulse_width_m) / ping.request.settings.range_bin_m, 0.5);
    const int reach = static_cast<int>(std::ceil(2 * pulse_rows));
    for (int row = 0; row < level.rows; ++row)
      for (int b = 0; b < beams_; ++b) {
        double most = level(row, b);
        for (int k = -reach; k <= reach; ++k)
          if (row + k >= 0 && row + k < level.rows)
            most = std::max(most, level(row + k, b) - 6 * std::max(std::abs(k) / pulse_rows - 0.5, 0.0));
        heard_.push_back(most);
      }
  }
  /// Whether the echo that another beam hears in this row may be all that there is in this one.
  bool explain(double level_db, double above_noise_db, int row, int beam, int other_beam) const {
    const double other_db = heard_[index(row, other_beam)];
    if (other_db < level_db || (other_db == level_db && other_beam > beam)) return false;
    return level_db <= other_db - below_[index(beam, other_beam)] + margin_db + by_noise_db(above_noise_db);
  }
  /// Whether so little is heard that the other beam's echo, alone, would have shown more: something takes part of it away.
  bool is_too_faint(double level_db, double above_noise_db, double other_level_db, int beam, int other_beam) const {
    const double below_db = below_[index(beam, other_beam)];
    return below_db <= main_lobe_db && level_db < other_level_db - 1.5 * below_db - fade_db - by_noise_db(above_noise_db);
  }

 private:
  static double by_noise_db(double above_noise_db) { return 20 * std::log10(1 + 3 * std::pow(10, -above_noise_db / 20)); }
  static constexpr double side_lobes_db = 25, margin_db = 0.7, main_lobe_db = 6, fade_db = 1;
  std::size_t index(int row, int beam) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(beams_) + static_cast<std::size_t>(beam);
  }
  int beams_;
  std::vector<double> below_;  // [beams][beams]: less than the pattern falls, which is 3 dB at half a width
  std::vector<double> heard_;  // [rows][beams]
};

struct Sample {
  int row = -1, beam = -1;
};

Detection placed(const Ping& ping, const Levels& level, Sample at) {
  const auto [row, beam] = at;
  Detection point{static_cast<double>(ping.beam_azimuth_rad[static_cast<std::size_t>(beam)]),
                  ping.request.settings.range_of_row(row)};
  const auto is_top = [&](double before, double after) { return level(at.row, at.beam) >= std::max(before, after); };
  if (beam > 0 && beam + 1 < level.beams && is_top(level(row, beam - 1), level(row, beam + 1))) {
    const double shift = top_of(level(row, beam - 1), level(row, beam), level(row, beam + 1));
    const std::size_t neighbour = static_cast<std::size_t>(shift < 0 ? beam - 1 : beam + 1);
    point.azimuth_rad += std::abs(shift) * (static_cast<double>(ping.beam_azimuth_rad[neighbour]) - point.azimuth_rad);
  }
  if (row > 0 && row + 1 < level.rows && is_top(level(row - 1, beam), level(row + 1, beam)))
    point.range_m =
        ping.request.settings.range_of_row(row + top_of(level(row - 1, beam), level(row, beam), level(row + 1, beam)));
  return point;
}

}  // namespace

std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db, double beam_width_rad) {
  const Levels level(ping);
  const Flanks flanks(ping, level, beam_width_rad);
  std::vector<double> noise;
  for (int b = 0; b < level.beams; ++b) noise.push_back(level.median_of(b));
  std::vector<Sample> found(static_cast<std::size_t>(directions));
  // First what no beam of another direction explains; then, in directions that have nothing, what no point explains. Echoes of a
  // floor that several beams share add up and cancel at random.
  for (const bool by_points : {false, true}) {
    const std::vector<Sample> points = found;
    for (int d = 0; d < directions; ++d) {
      Sample& best = found[static_cast<std::size_t>(d)];
      if (best.row >= 0) continue;
      const int first = d * level.beams / directions, end = (d + 1) * level.beams / directions;
      const auto explained = [&](int row, int beam) {
        const double here = level(row, beam), above = here - noise[static_cast<std::size_t>(beam)];
        if (by_points)
          return std::any_of(points.begin(), points.end(), [&](const Sample& p) {
            return p.row >= 0 && flanks.explain(here, above, row, beam, p.beam) &&
                   !flanks.is_too_faint(here, above, level(row, p.beam), beam, p.beam);
          });
        for (int b = 0; b < level.beams; ++b)
          if ((b < first || b >= end) && flanks.explain(here, above, row, beam, b)) return true;
        return false;
      };
      for (int b = first; b < end; ++b)
        for (int r = 0; r < level.rows; ++r) {
          const double here = level(r, b);
          if (here < noise[static_cast<std::size_t>(b)] + above_db || (best.row >= 0 && here <= level(best.row, best.beam)))
            continue;
          if (!explained(r, b)) best = {r, b};
        }
    }
  }
  std::vector<Detection> points;
  for (const Sample& at : found)
    if (at.row >= 0) points.push_back(placed(ping, level, at));
  return points;
}

}  // namespace sonar
