#include "core/sonar/detections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace sonar {
namespace {

/// If a sample is weaker than the strongest of its row by more than this, it may come from a side lobe. With Hamming weights
/// side lobes are at -42 dB.
constexpr double side_lobes_db = 30;
/// If a peak is weaker than the strongest sample of its direction by more than this, it may be the tail of a pulse, or come
/// from an echo in another direction.
constexpr double tail_db = 12;
/// Neighbouring directions on a floor may differ by this much because of speckle [dB].
constexpr double fill_db = 20;

/// Levels [dB] of a picture. They increase with the codes of its samples. Therefore codes can be compared instead of levels.
class Levels {
 public:
  explicit Levels(const Ping& ping)
      : beams(static_cast<int>(ping.beam_azimuth_rad.size())),
        rows(ping.request.settings.range_bin_count),
        bytes_(static_cast<std::size_t>(ping.request.settings.format.bits / 8)),
        samples_(ping.samples),
        format_(ping.request.settings.format) {}

  std::uint32_t code(int row, int beam) const {
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(beams) + static_cast<std::size_t>(beam);
    return bytes_ == 2 ? sample_code(samples_, at, 2) : sample_code(samples_, at, bytes_);
  }
  double of(std::uint32_t code) const {
    const double span = static_cast<double>(format_.ceiling_db) - static_cast<double>(format_.floor_db);
    return static_cast<double>(format_.floor_db) + span * code / format_.max_code;
  }
  double operator()(int row, int beam) const { return of(code(row, beam)); }
  /// The lowest code of at least this level. If there is none, it is the highest code plus one.
  std::uint64_t least_code(double db) const {
    std::uint64_t low = 0, high = std::uint64_t{1} << (8 * bytes_);
    while (low < high) {
      const std::uint64_t middle = (low + high) / 2;
      if (of(static_cast<std::uint32_t>(middle)) < db)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }
  /// The median level of a beam, found by counting the bytes of codes, the highest byte first. This takes half the time of a
  /// partial sort.
  double median_of(int beam) const {
    std::vector<std::uint64_t> all(static_cast<std::size_t>(rows));
    for (int row = 0; row < rows; ++row) all[static_cast<std::size_t>(row)] = code(row, beam);
    std::uint64_t median = 0;
    std::size_t rank = all.size() / 2;  // rank among the codes that begin like `median`
    for (std::size_t byte = bytes_; byte-- > 0;) {
      std::array<std::size_t, 256> count{};
      for (const std::uint64_t each : all)
        if (each >> (8 * byte + 8) == median >> (8 * byte + 8)) ++count[each >> (8 * byte) & 0xFF];
      std::uint64_t digit = 0;
      for (; rank >= count[digit]; ++digit) rank -= count[digit];
      median |= digit << (8 * byte);
    }
    return of(static_cast<std::uint32_t>(median));
  }

  const int beams, rows;

 private:
  std::size_t bytes_;
  const std::vector<std::byte>& samples_;
  const SampleFormat& format_;
};

/// The position of the maximum of a parabola through three levels, relative to the middle one, within half a step.
double top_of(double before, double middle, double after) {
  const double curve = before - 2 * middle + after;
  return curve < 0 ? std::clamp(0.5 * (before - after) / curve, -0.5, 0.5) : 0;
}

/// The beams of a ping and their directions.
struct Fan {
  const Ping& ping;
  int directions;
  double width_sine;         // -3 dB width of a beam
  double port_rad, end_rad;  // edges of the sector

  Fan(const Ping& of, int count, double beam_width_rad)
      : ping(of), directions(count), width_sine(2 * std::sin(beam_width_rad / 2)), port_rad(edge(true)), end_rad(edge(false)) {}
  double azimuth(int beam) const { return static_cast<double>(ping.beam_azimuth_rad[static_cast<std::size_t>(beam)]); }
  int beams() const { return static_cast<int>(ping.beam_azimuth_rad.size()); }
  int first_beam(int direction) const { return direction * beams() / directions; }
  double middle_rad(int direction) const { return port_rad + (direction + 0.5) / directions * (end_rad - port_rad); }
  int direction_of(double azimuth_rad) const {
    return std::clamp(static_cast<int>((azimuth_rad - port_rad) / (end_rad - port_rad) * directions), 0, directions - 1);
  }

 private:
  double edge(bool port) const {
    const int outer = port ? 0 : beams() - 1, inner = port ? 1 : beams() - 2;
    return azimuth(outer) + (azimuth(outer) - azimuth(inner)) / 2;
  }
};

/// An echo. Its direction follows from the levels of its row in neighbouring beams.
struct Peak {
  double level_db;
  int row, beam;
  double azimuth_rad;
};

/// The azimuth of an echo whose strongest beam in this row is `beam`; nullopt if the azimuth lies outside the sector.
std::optional<double> azimuth_of_peak(const Fan& fan, const Levels& level, int row, int beam) {
  const double here = level(row, beam);
  if (beam > 0 && beam + 1 < level.beams) {
    const double shift = top_of(level(row, beam - 1), here, level(row, beam + 1));
    return fan.azimuth(beam) + std::abs(shift) * (fan.azimuth(shift < 0 ? beam - 1 : beam + 1) - fan.azimuth(beam));
  }
  // At an edge only one side has a beam. The offset follows from the fall of the main lobe, 12 dB (offset / width)^2.
  const int inner = beam == 0 ? 1 : beam - 1;
  const double u = std::sin(fan.azimuth(beam)), v = std::sin(fan.azimuth(inner));
  const double sine = (u + v) / 2 + (here - level(row, inner)) * fan.width_sine * fan.width_sine / (24 * (u - v));
  const double azimuth = std::asin(std::clamp(sine, -1.0, 1.0));
  if (azimuth > std::max(fan.port_rad, fan.end_rad) || azimuth < std::min(fan.port_rad, fan.end_rad)) return {};
  return azimuth;
}

/// Returns the peaks across the beams, the strongest first. Side lobes of the strongest peak of a row are omitted.
std::vector<Peak> peaks_in(const Fan& fan, const Levels& level, const std::vector<double>& least_db) {
  std::vector<std::uint64_t> least;
  for (const double db : least_db) least.push_back(level.least_code(db));
  std::vector<Peak> peaks;
  for (int row = 0; row < level.rows; ++row) {
    std::uint32_t loudest = 0;
    for (int b = 0; b < level.beams; ++b) loudest = std::max(loudest, level.code(row, b));
    const std::uint64_t least_of_row = level.least_code(level.of(loudest) - side_lobes_db);
    for (int b = 0; b < level.beams; ++b) {
      const std::uint32_t here = level.code(row, b);
      if (here < least[static_cast<std::size_t>(b)] || here < least_of_row) continue;
      if ((b > 0 && level.code(row, b - 1) > here) || (b + 1 < level.beams && level.code(row, b + 1) >= here)) continue;
      if (const auto azimuth = azimuth_of_peak(fan, level, row, b)) peaks.push_back({level.of(here), row, b, *azimuth});
    }
  }
  std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.level_db > b.level_db; });
  return peaks;
}

struct Found {
  Detection point;
  double level_db;
};

/// The strongest peak of each direction. Two kinds of peaks are omitted: those within half a beam and two pulses of a stronger
/// peak, which may have caused them, and those far weaker than the strongest sample of their direction.
std::vector<std::optional<Found>> loudest_peaks(const Fan& fan, const Levels& level, const std::vector<double>& least_db,
                                                double reach_m) {
  const PingSettings& settings = fan.ping.request.settings;
  std::vector<std::optional<Found>> found(static_cast<std::size_t>(fan.directions));
  std::vector<std::uint32_t> most(static_cast<std::size_t>(level.beams));  // the largest code of each beam
  for (int row = 0; row < level.rows; ++row)
    for (int b = 0; b < level.beams; ++b) {
      std::uint32_t& of_beam = most[static_cast<std::size_t>(b)];
      of_beam = std::max(of_beam, level.code(row, b));
    }
  std::vector<double> weakest_db;
  for (int d = 0; d < fan.directions; ++d)
    weakest_db.push_back(level.of(*std::max_element(most.begin() + fan.first_beam(d), most.begin() + fan.first_beam(d + 1))) -
                         tail_db);
  for (const Peak& peak : peaks_in(fan, level, least_db)) {
    const auto d = static_cast<std::size_t>(fan.direction_of(peak.azimuth_rad));
    if (found[d] || peak.level_db < weakest_db[d]) continue;
    const double range = settings.range_of_row(peak.row);
    const bool is_beside = std::any_of(found.begin(), found.end(), [&](const auto& other) {
      return other && std::abs(other->point.range_m - range) <= reach_m &&
             std::abs(std::sin(other->point.azimuth_rad) - std::sin(peak.azimuth_rad)) < fan.width_sine / 2;
    });
    if (is_beside) continue;
    found[d] = Found{{peak.azimuth_rad, range}, peak.level_db};
    if (peak.row > 0 && peak.row + 1 < level.rows) {
      const double before = level(peak.row - 1, peak.beam), after = level(peak.row + 1, peak.beam);
      if (peak.level_db >= std::max(before, after))
        found[d]->point.range_m = settings.range_of_row(peak.row + top_of(before, peak.level_db, after));
    }
  }
  return found;
}

/// The range at which the line through two points crosses a direction between them.
std::optional<double> range_between(const Detection& a, const Detection& b, double azimuth_rad) {
  const double y = a.range_m * std::sin(a.azimuth_rad), x = a.range_m * std::cos(a.azimuth_rad);
  const double dy = b.range_m * std::sin(b.azimuth_rad) - y, dx = b.range_m * std::cos(b.azimuth_rad) - x;
  const double t = std::tan(azimuth_rad), along = (t * x - y) / (dy - t * dx);
  if (!(along >= 0 && along <= 1)) return {};
  return std::hypot(y + along * dy, x + along * dx);
}

/// Near the vertical, the echo of a floor has the same range in several directions, and its row has one peak for all of them.
/// If the neighbours on both sides are on a floor, the point is the centroid of the amplitude near the range between them.
std::optional<Found> by_amplitude(const Fan& fan, const Levels& level, const std::vector<double>& least_db, int direction,
                                  const Found& before, const Found& after, double reach_m) {
  const PingSettings& settings = fan.ping.request.settings;
  const double azimuth = fan.middle_rad(direction);
  const auto near = range_between(before.point, after.point, azimuth);
  if (!near) return {};
  double most = 0, sum = 0, moment = 0;
  const int first = fan.first_beam(direction), end = fan.first_beam(direction + 1);
  for (int row = 0; row < level.rows; ++row) {
    const double range = settings.range_of_row(row);
    if (std::abs(range - *near) > reach_m) continue;
    double power = 0;
    for (int b = first; b < end; ++b) power += std::pow(10, level(row, b) / 10) / (end - first);
    most = std::max(most, power);
    sum += std::sqrt(power);
    moment += std::sqrt(power) * range;
  }
  const double least = *std::max_element(least_db.begin() + first, least_db.begin() + end);
  const double level_db = most > 0 ? 10 * std::log10(most) : -1e9;
  if (level_db < std::max(least, std::min(before.level_db, after.level_db) - fill_db)) return {};
  return Found{{azimuth, moment / sum}, level_db};
}

}  // namespace

std::vector<Detection> detect_points(const Ping& ping, int directions, double above_db, double beam_width_rad) {
  const Levels level(ping);
  if (level.beams < std::max(2, directions) || level.rows < 1) return {};
  const Fan fan(ping, directions, beam_width_rad);
  const PingSettings& settings = ping.request.settings;
  std::vector<double> least_db;
  for (int b = 0; b < level.beams; ++b) least_db.push_back(level.median_of(b) + above_db);
  const double reach_m = 2 * std::max(static_cast<double>(settings.pulse_width_m), settings.range_bin_m);
  std::vector<std::optional<Found>> found = loudest_peaks(fan, level, least_db, reach_m);
  // A floor has no holes. Therefore the directions between two points are filled if all of them can be filled.
  for (int d = 1; d < directions; ++d) {
    int end = d;
    while (end < directions && !found[static_cast<std::size_t>(end)]) ++end;
    const auto& before = found[static_cast<std::size_t>(d - 1)];
    std::vector<std::optional<Found>> between;
    for (int k = d; k < end && end < directions && before; ++k)
      between.push_back(by_amplitude(fan, level, least_db, k, *before, *found[static_cast<std::size_t>(end)], reach_m));
    if (std::all_of(between.begin(), between.end(), [](const auto& point) { return point.has_value(); }))
      std::copy(between.begin(), between.end(), found.begin() + d);
    d = end;
  }
  std::vector<Detection> points;
  for (const auto& each : found)
    if (each) points.push_back(each->point);
  return points;
}

}  // namespace sonar
