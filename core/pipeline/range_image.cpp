#include "core/pipeline/range_image.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/range_returns.hpp"
#include "core/sonar/bearings.hpp"

namespace sonar {
namespace {

constexpr double reach = 1.1;  // in beam widths; the pattern is -14.6 dB there, and 0 beyond
/// Two-way power pattern: a Gaussian with this -3 dB width.
double pattern(double angle_rad, double width_rad) {
  const double x = angle_rad / width_rad;
  return std::abs(x) > reach ? 0 : std::exp(-4 * std::log(2.0) * x * x);
}

/// Power of one beam in each range cell. finish() sums differences between neighbouring cells or, with `as_heard`, squares
/// complex amplitudes with speckle.
class Profile {
 public:
  Profile(double cell_m, std::size_t cells, bool as_heard)
      : cell_(cell_m), steps_(cells + 2, 0.0), re_(as_heard ? steps_.size() : 0), im_(re_.size()) {}
  void clear() {
    for (std::vector<double>* steps : {&steps_, &re_, &im_})
      if (!steps->empty())
        std::fill(steps->begin() + first_, steps->begin() + std::max(first_, std::min(last_ + 2, size())), 0.0);
    first_ = size();
    last_ = 0;
  }
  void add(const RangeReturns& returns, const RangeReturn& r, int block, double weight) {
    if (r.last + 2 > size()) return;  // the echo ends beyond the picture
    first_ = std::min<std::ptrdiff_t>(first_, r.first);
    last_ = std::max<std::ptrdiff_t>(last_, r.last);
    if (re_.empty()) return add_steps(steps_, r, weight * r.of_first, weight * r.of_each, weight * r.of_last);
    const double amplitude = std::sqrt(weight), each = amplitude * std::sqrt(r.of_each);
    for (std::ptrdiff_t k = r.first; k <= r.last; ++k) {
      const ComplexNormal speckle = returns.speckle_in(r, k, block);
      const double a = k > r.first && k < r.last ? each : amplitude * std::sqrt(r.power_in(k));
      re_[static_cast<std::size_t>(k)] += a * static_cast<double>(speckle.re);
      im_[static_cast<std::size_t>(k)] += a * static_cast<double>(speckle.im);
    }
  }
  /// Computes the power of each cell.
  void finish() {
    double sum = 0;
    for (std::ptrdiff_t k = first_; k <= last_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      at(k) = re_.empty() ? sum = std::max(0.0, sum + at(k)) : re_[i] * re_[i] + im_[i] * im_[i];
    }
  }
  bool empty() const { return first_ > last_; }
  std::ptrdiff_t first() const { return first_; }
  std::ptrdiff_t last() const { return last_; }
  double power(std::ptrdiff_t k) const { return k < first_ || k > last_ ? 0 : steps_[static_cast<std::size_t>(k)]; }
  /// The strongest cell in [from, to], which must lie within [first(), last()]. If several are equal, the first one is returned.
  std::ptrdiff_t strongest(std::ptrdiff_t from, std::ptrdiff_t to) const {
    const auto begin = steps_.begin();
    return std::max_element(begin + from, begin + to + 1) - begin;
  }
  /// Centre [m] of the cells around k that have more than half of its power.
  double centre_m(std::ptrdiff_t k) const {
    const double half = power(k) / 2;
    double sum = 0, moment = 0;
    const auto take = [&](std::ptrdiff_t i) {
      sum += power(i);
      moment += power(i) * (static_cast<double>(i) + 0.5);
    };
    std::ptrdiff_t from = k, to = k;
    while (power(from - 1) > half) --from;
    while (power(to + 1) > half) ++to;
    // The next cell on either side is included, because the position of an echo within a cell determines how much power these
    // cells have.
    for (std::ptrdiff_t i = from - 1; i <= to + 1; ++i) take(i);
    return sum > 0 ? moment / sum * cell_ : (static_cast<double>(k) + 0.5) * cell_;
  }

 private:
  static void add_steps(std::vector<double>& steps, const RangeReturn& r, double first, double each, double last) {
    const auto from = static_cast<std::size_t>(r.first), to = static_cast<std::size_t>(r.last);
    steps[from] += first;
    steps[from + 1] += each - first;
    steps[to] += last - each;
    steps[to + 1] -= last;
  }
  std::ptrdiff_t size() const { return static_cast<std::ptrdiff_t>(steps_.size()); }
  double& at(std::ptrdiff_t k) { return steps_[static_cast<std::size_t>(k)]; }
  double cell_;
  std::vector<double> steps_, re_, im_;  // re_, im_: complex amplitude, with `as_heard`
  std::ptrdiff_t first_ = 0, last_ = 0;
};

class RangeImager {
 public:
  RangeImager(const RayScene& scene, const PingRequest& request, const RangeImageSettings& wanted)
      : request_(request),
        wanted_(wanted),
        settings_(request.settings),
        mode_(request.model->modes[static_cast<std::size_t>(settings_.mode)]),
        grid_(request),
        cell_m_(static_cast<double>(settings_.pulse_width_m)),
        returns_(scene, request, cell_m_) {
    scale_ = bearing_scale_of(request);
    const double column_step_rad = grid_.column_step_rad() * scale_, row_step_rad = grid_.row_step_rad() * scale_;
    const double true_mps = true_sound_speed_mps(request.water, depth_from_z(request.sonar_in_world.position_m.z));
    cells_ = static_cast<std::size_t>(std::ceil((settings_.range_m + longest_return_half_m) / cell_m_)) + 2;
    first_wanted_ = static_cast<std::ptrdiff_t>(std::ceil(settings_.range_start_m / cell_m_ - 0.5));
    last_wanted_ = static_cast<std::ptrdiff_t>(std::floor(settings_.range_m / cell_m_ - 0.5));
    FrequencyMode beam = mode_;  // the noise level is that of one beam
    beam.pattern.elevation_width_rad = static_cast<float>(wanted.beam_height_rad);
    const double rms = noise_rms_upa(beam, true_mps / (2 * cell_m_));
    noise_power_ = rms * rms;
    column_reach_ = static_cast<int>(reach * static_cast<double>(mode_.pattern.azimuth_width_rad) / column_step_rad);
    row_reach_ = static_cast<int>(reach * wanted.beam_height_rad / row_step_rad);
    for (int d = -column_reach_; d <= column_reach_; ++d)
      column_weight_.push_back(pattern(d * column_step_rad, static_cast<double>(mode_.pattern.azimuth_width_rad)));
    for (int d = -row_reach_; d <= row_reach_; ++d) row_weight_.push_back(pattern(d * row_step_rad, wanted.beam_height_rad));
  }

  Ping run(Parallel& pool) {
    Ping ping;
    ping.request = request_;
    for (int c = 0; c < grid_.columns; ++c) ping.beam_azimuth_rad.push_back(static_cast<float>(grid_.azimuth_rad(c)));
    const auto rows = static_cast<std::size_t>(grid_.rows);
    const std::size_t pixels = rows * static_cast<std::size_t>(grid_.columns);
    ping.samples.resize(4 * pixels);
    if (request_.switches.keep_pressure) ping.pressure_upa.resize(pixels);
    if (!request_.blank) {
      returns_.trace(pool);
      points_ = returns_.of_points();
    }
    std::vector<Reported> reported(pixels);
    std::vector<Profile> profiles(static_cast<std::size_t>(pool.threads()),
                                  Profile(cell_m_, cells_, wanted_.chosen_as_heard && !request_.switches.expected_power));
    pool.for_each(rows, [&](std::size_t row, int worker) {
      Profile& profile = profiles[static_cast<std::size_t>(worker)];
      for (int column = 0; column < grid_.columns; ++column) {
        const std::size_t index = row * static_cast<std::size_t>(grid_.columns) + static_cast<std::size_t>(column);
        reported[index] = pixel(column, static_cast<int>(row), static_cast<std::uint32_t>(index), profile);
      }
    });
    if (wanted_.least_confirming > 0) drop_unconfirmed(reported, pool);
    for (int pass = 0; pass < wanted_.median_passes; ++pass) take_medians(reported, pool);
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::uint32_t code = code_of(reported[i]).code();
      if (!ping.pressure_upa.empty()) ping.pressure_upa[i] = static_cast<float>(std::sqrt(reported[i].power));
      for (std::size_t b = 0; b < 4; ++b) ping.samples[4 * i + b] = static_cast<std::byte>(code >> (8 * b) & 0xFF);
    }
    if (request_.switches.keep_truth) ping.truth = truth();
    return ping;
  }

 private:
  /// Value of a pixel before quantisation; power 0 = no return.
  struct Reported {
    double power = 0, range_m = 0;  // [uPa^2]; metres as the device computes them
    double shown_m = 0;             // the range after the filters
  };
  /// Calls f(neighbour) for each neighbour, in the same block of rows, that has a return.
  template <class F>
  void for_each_neighbour(const std::vector<Reported>& all, int column, int row, F f) const {
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, grid_.rows - 1); ++r) {
      if (block_of(r) != block_of(row)) continue;
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, grid_.columns - 1); ++c) {
        const Reported& other = all[static_cast<std::size_t>(r * grid_.columns + c)];
        if ((r != row || c != column) && other.power > 0) f(other);
      }
    }
  }
  /// Calls change(before, column, row, pixel) for every pixel that has a return. `before` contains the values that all pixels
  /// had before the first call.
  template <class Change>
  void filter(std::vector<Reported>& all, Parallel& pool, Change change) const {
    const std::vector<Reported> before = all;
    pool.for_each(static_cast<std::size_t>(grid_.rows), [&](std::size_t row, int) {
      for (int c = 0; c < grid_.columns; ++c) {
        Reported& own = all[row * static_cast<std::size_t>(grid_.columns) + static_cast<std::size_t>(c)];
        if (own.power > 0) change(before, c, static_cast<int>(row), own);
      }
    });
  }
  void drop_unconfirmed(std::vector<Reported>& all, Parallel& pool) const {
    filter(all, pool, [this](const std::vector<Reported>& before, int column, int row, Reported& own) {
      int confirming = 0;
      for_each_neighbour(before, column, row, [&](const Reported& other) {
        confirming += std::abs(other.shown_m - own.shown_m) <= wanted_.confirming_m;
      });
      if (confirming < wanted_.least_confirming) own = {};
    });
  }
  /// Replaces each range by the median of the ranges of the pixel and its neighbours. If their number is even, the lower of the
  /// two middle ones is used, so that every reported range was measured.
  void take_medians(std::vector<Reported>& all, Parallel& pool) const {
    filter(all, pool, [this](const std::vector<Reported>& before, int column, int row, Reported& own) {
      double ranges[9] = {own.shown_m};
      std::ptrdiff_t count = 1;
      for_each_neighbour(before, column, row, [&](const Reported& other) { ranges[count++] = other.shown_m; });
      std::nth_element(ranges, ranges + (count - 1) / 2, ranges + count);
      own.shown_m = ranges[(count - 1) / 2];
    });
  }
  /// Calls f(return, power weight) for each return that a beam receives and for which `wanted` is true.
  template <class Wanted, class F>
  void for_each_return(int column, int row, Wanted wanted, F f) {
    const int first = std::max(column - column_reach_, 0), last = std::min(column + column_reach_, grid_.columns - 1);
    for (int r = std::max(row - row_reach_, 0); r <= std::min(row + row_reach_, grid_.rows - 1); ++r) {
      const double of_row = row_weight_[static_cast<std::size_t>(r - row + row_reach_)];
      const double* of_column = column_weight_.data() + column_reach_ - column;
      for (int c = first; c <= last; ++c)
        for (const RangeReturn& met : returns_.of(c, r))
          if (wanted(met)) f(met, of_row * of_column[c]);
    }
    for (const PointReturn& point : points_) {
      const double weight =
          pattern(point.azimuth_rad - true_angle_rad(grid_.azimuth_rad(column), scale_),
                  static_cast<double>(mode_.pattern.azimuth_width_rad)) *
          pattern(point.elevation_rad - true_angle_rad(grid_.elevation_rad(row), scale_), wanted_.beam_height_rad);
      if (weight > 0 && wanted(point)) f(point, weight);
    }
  }

  /// Linear strength of an amplitude [uPa] at a range, in the unit of the pixels.
  double strength(double amplitude, double range_m) const {
    const double gain_db = static_cast<double>(settings_.gain_db) +
                           (settings_.tvg ? tvg_db(mode_.receiver, range_m, settings_.device_absorption_db_per_m) : 0);
    return amplitude * full_scale_factor(mode_.receiver, gain_db) * static_cast<double>(settings_.format.max_code >> 16);
  }
  int block_of(int row) const { return wanted_.block_rows > 0 ? row / wanted_.block_rows : 0; }
  /// Range of the strongest scatterer of a return in a range cell. It is random, and the same for all beams that receive the
  /// return.
  double place_in_cell_m(const RangeReturn& r, std::ptrdiff_t k) const {
    const double from = std::max(center_of(k) - cell_m_ / 2, r.range_m - r.half_m),
                 to = std::min(center_of(k) + cell_m_ / 2, r.range_m + r.half_m);
    const Random4 bits = philox(r.draw, static_cast<std::uint32_t>(k), 1, key_of(request_.seed, Domain::range_speckle));
    return from + (to - from) * static_cast<double>(uniform_open(bits.v[0]));
  }
  double center_of(std::ptrdiff_t k) const { return (static_cast<double>(k) + 0.5) * cell_m_; }
  double least_power() const { return request_.switches.noise ? wanted_.detection * noise_power_ : 0; }
  bool is_detected(double power, double range_m) const {
    return power > least_power() && strength(std::sqrt(power), range_m) >= static_cast<double>(wanted_.least_strength);
  }

  /// The reported cell: with `nearest`, the first detected peak in the wanted ranges if there is one; else the strongest cell.
  std::ptrdiff_t chosen(const Profile& profile) const {
    const std::ptrdiff_t from = std::max(profile.first(), first_wanted_), to = std::min(profile.last(), last_wanted_);
    if (from > to) return profile.first();
    if (wanted_.nearest)
      for (std::ptrdiff_t k = from; k <= to; ++k)
        if (profile.power(k) >= profile.power(k + 1) && profile.power(k) > profile.power(k - 1) &&
            is_detected(profile.power(k), center_of(k)))
          return k;
    return profile.strongest(from, to);
  }

  Reported pixel(int column, int row, std::uint32_t index, Profile& profile) {
    const Random4 bits =
        philox(static_cast<std::uint32_t>(request_.number), request_.sonar_id, index, key_of(request_.seed, Domain::range_noise));
    const int block = block_of(row);
    profile.clear();
    for_each_return(
        column, row, [](const RangeReturn&) { return true; },
        [&](const RangeReturn& r, double weight) { profile.add(returns_, r, block, weight); });
    profile.finish();
    double power = 0, range_m = 0;
    if (!profile.empty()) {
      const std::ptrdiff_t k = chosen(profile);
      power = profile.power(k);
      range_m = profile.centre_m(k);
      if (!request_.switches.expected_power) {
        // Neighbouring beams share rays and therefore their speckle.
        double re = 0, im = 0, loudest_power = 0;
        const RangeReturn* loudest = nullptr;
        const auto is_in_cell = [k](const RangeReturn& r) { return r.first <= k && r.last >= k; };
        for_each_return(column, row, is_in_cell, [&](const RangeReturn& r, double weight) {
          const double amplitude = std::sqrt(r.power_in(k) * weight);
          const ComplexNormal speckle = wanted_.chosen_as_heard ? returns_.speckle_in(r, k, block) : r.speckle;
          const double of_return = amplitude * amplitude * static_cast<double>(speckle.re * speckle.re + speckle.im * speckle.im);
          if (of_return > loudest_power) loudest = &r, loudest_power = of_return;
          re += amplitude * static_cast<double>(speckle.re);
          im += amplitude * static_cast<double>(speckle.im);
        });
        if (wanted_.range_of_loudest && loudest != nullptr) range_m = place_in_cell_m(*loudest, k);
        if (request_.switches.noise) {
          const ComplexNormal noise = complex_normal(bits.v[0], bits.v[1]);
          re += std::sqrt(noise_power_) * static_cast<double>(noise.re);
          im += std::sqrt(noise_power_) * static_cast<double>(noise.im);
        }
        power = re * re + im * im;
        if (request_.switches.noise && power > least_power())  // the error falls with the signal-to-noise ratio
          range_m += cell_m_ / 2 * std::sqrt(noise_power_ / power) * static_cast<double>(complex_normal(bits.v[2], bits.v[3]).re);
      }
    }
    if (!is_detected(power, range_m) && request_.switches.noise && !request_.switches.expected_power) {
      // The strongest noise of all cells. If this noise is detected, it is a false alarm.
      const double cells = static_cast<double>(cells_);
      power = -noise_power_ * std::log(-std::expm1(std::log(static_cast<double>(uniform_open(bits.v[2]))) / cells));
      range_m = settings_.range_m * static_cast<double>(uniform_open(bits.v[3]));
    }
    if (!is_detected(power, range_m) || range_m < settings_.range_start_m || range_m > settings_.range_m) return {};
    if (const double sample_m = wanted_.range_sample_m; sample_m > 0) range_m = sample_m * std::round(range_m / sample_m);
    return {power, range_m, range_m};
  }

  RangePixel code_of(const Reported& r) const {
    if (r.power == 0) return {};
    const auto held = [](double value, std::uint32_t most) {
      return static_cast<std::uint32_t>(std::clamp(value + 0.5, 1.0, static_cast<double>(most)));
    };
    return {held(strength(std::sqrt(r.power), r.range_m), RangePixel::most_strength),
            held(r.shown_m / wanted_.range_unit_m, RangePixel::most_range)};
  }

  /// The nearest hit of the rays of each column.
  std::vector<BeamTruth> truth() const {
    std::vector<BeamTruth> nearest(static_cast<std::size_t>(grid_.columns));
    for (int column = 0; column < grid_.columns; ++column)
      for (int row = 0; row < grid_.rows; ++row)
        for (const RangeReturn& r : returns_.of(column, row)) {
          BeamTruth& beam = nearest[static_cast<std::size_t>(column)];
          const auto range_m = static_cast<float>(r.range_m / returns_.device_per_true());
          if (beam.range_m == 0 || range_m < beam.range_m) beam = {range_m, r.object};
        }
    return nearest;
  }

  const PingRequest& request_;
  const RangeImageSettings& wanted_;
  const PingSettings& settings_;
  const FrequencyMode& mode_;
  RangeImageGrid grid_;
  double cell_m_;
  RangeReturns returns_;
  double noise_power_ = 0, scale_ = 1;  // scale_: bearing_scale_of() the request
  std::size_t cells_ = 0;
  std::ptrdiff_t first_wanted_ = 0, last_wanted_ = 0;  // cells whose centres lie within the range settings
  int column_reach_ = 0, row_reach_ = 0;
  std::vector<double> column_weight_, row_weight_;
  std::vector<PointReturn> points_;
};

}  // namespace

Ping make_range_image(const RayScene& scene, const PingRequest& request, const RangeImageSettings& wanted, Parallel& pool) {
  return RangeImager(scene, request, wanted).run(pool);
}

}  // namespace sonar
