#include <algorithm>
#include <cmath>

#include "daemon/commands/render/coverage.hpp"
#include "tests/oracles/expectation.hpp"

namespace sonar::render {
namespace {

/// The peak of a Gaussian through three equidistant samples, which is a parabola through their logarithms: its offset from the
/// middle sample, and its height.
struct Parabola {
  double offset = 0, height = 0;
};
Parabola log_parabola(double before, double middle, double after) {
  if (!(before > 0 && middle > 0 && after > 0)) return {0, middle};
  const double a = std::log(before), b = std::log(middle), c = std::log(after);
  const double curve = a - 2 * b + c, slope = 0.5 * (c - a);
  if (!(curve < 0)) return {0, middle};
  return {-slope / curve, std::exp(b - 0.5 * slope * slope / curve)};
}

class Picture {
 public:
  Picture(const RenderJob& job, const Ping& ping, const Window& window) : job_(job), ping_(ping), s_(job.settings) {
    for (int row = 0; row < s_.range_bin_count; ++row)
      if (range_m(row) >= window.from_m && range_m(row) <= window.to_m) rows_.push_back(row);
    for (int j = 0; j < s_.beam_count; ++j)
      if (deg_from_rad(azimuth_rad(j)) >= window.from_deg && deg_from_rad(azimuth_rad(j)) <= window.to_deg) beams_.push_back(j);
  }

  bool empty() const { return rows_.empty() || beams_.empty(); }

  struct Peak {
    double range_m = 0, bearing_rad = 0, height_upa = 0;
  };
  Peak peak() const {
    int row = rows_.front(), beam = beams_.front();
    for (const int n : rows_)
      for (const int j : beams_)
        if (at(n, j) > at(row, beam)) row = n, beam = j;
    const Parabola along = log_parabola(at(row - 1, beam), at(row, beam), at(row + 1, beam));
    const Parabola across = log_parabola(at(row, beam - 1), at(row, beam), at(row, beam + 1));
    const double step = beam > 0 && beam + 1 < s_.beam_count ? 0.5 * (sine(beam + 1) - sine(beam - 1)) : 0;
    return {range_m(row + along.offset), std::asin(std::clamp(sine(beam) + across.offset * step, -1.0, 1.0)), along.height};
  }

  double mean_power() const { return sum_of_power() / static_cast<double>(rows_.size() * beams_.size()); }
  /// Returns the mean energy of a beam.
  double energy() const { return sum_of_power() * row_s() / static_cast<double>(beams_.size()); }

  /// Returns the target strength. The sum of E|s|^2 over rows and beams contains the energy of each echo times theta_eff tau_eff
  /// (ResolutionCell). Therefore it is divided by both and by the source level.
  double strength() const {
    const ResolutionCell cell = cell_of(job_);
    const double source_upa = amplitude_from_db(static_cast<double>(job_.mode().source_level_db));
    return sum_of_power() * row_s() * (sine(0) - sine(1)) / (cell.beam_u * cell.energy_s * source_upa * source_upa);
  }

 private:
  double range_m(double row) const { return s_.range_of_row(row); }
  double azimuth_rad(int beam) const { return static_cast<double>(ping_.beam_azimuth_rad[static_cast<std::size_t>(beam)]); }
  double sine(int beam) const { return std::sin(azimuth_rad(beam)); }
  double row_s() const { return 2 * s_.range_bin_m / static_cast<double>(s_.device_sound_speed_mps); }
  double at(int row, int beam) const {
    if (row < 0 || beam < 0 || row >= s_.range_bin_count || beam >= s_.beam_count) return 0;
    return static_cast<double>(ping_.pressure_upa[static_cast<std::size_t>(row) * static_cast<std::size_t>(s_.beam_count) +
                                                  static_cast<std::size_t>(beam)]);
  }
  double sum_of_power() const {
    double sum = 0;
    for (const int row : rows_)
      for (const int j : beams_) sum += at(row, j) * at(row, j);
    return sum;
  }

  const RenderJob& job_;
  const Ping& ping_;
  const PingSettings& s_;
  std::vector<int> rows_, beams_;
};

Result<double> measure_in(Measure what, const Window& window, const RenderJob& job, const Ping& ping) {
  if (what == Measure::coverage_percent || what == Measure::coverage_worst_db) {
    const auto coverage = measure_coverage(job, ping);
    if (!coverage) return tl::make_unexpected(coverage.error());
    return what == Measure::coverage_percent ? coverage->percent() : std::abs(coverage->worst_db);
  }
  const Picture picture(job, ping, window);
  if (what == Measure::strength_db && job.mode().pattern.azimuth_taper == Taper::unit)
    return failure(ErrorKind::bad_data, "strength_db needs beams with a width; beams with azimuth_taper: unit have none");
  if (picture.empty()) return failure(ErrorKind::bad_data, "the window contains no row or no beam of the picture");
  switch (what) {
    case Measure::peak_level_db:
      return db_from_amplitude(picture.peak().height_upa);
    case Measure::peak_range_m:
      return picture.peak().range_m;
    case Measure::peak_bearing_deg:
      return deg_from_rad(picture.peak().bearing_rad);
    case Measure::mean_level_db:
      return db_from_power(picture.mean_power());
    case Measure::energy_db:
      return db_from_power(picture.energy());
    default:
      return db_from_power(picture.strength());
  }
}

}  // namespace

Result<double> measure(const Expectation& e, const RenderJob& job, const Ping& ping) {
  const auto here = measure_in(e.measure, e.window, job, ping);
  if (!here || !e.less) return here;
  const auto there = measure_in(e.measure, *e.less, job, ping);
  if (!there) return there;
  return *here - *there;
}

}  // namespace sonar::render
