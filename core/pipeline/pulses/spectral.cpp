#include "core/pipeline/pulses/spectral.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/base/geometry.hpp"

namespace sonar::spectral {
namespace {

// Eq. 26: 2.3 per point of width, on a grid twice as fine. FrequencySums lists the errors by width.
constexpr int oversampling = 2;
constexpr double sharpness_per_width = 2.3;
constexpr int small_padding = 8, large_padding = 16;  // widths are padded, so that loops over them are whole vectors
constexpr int extra_terms = 4;                        // terms of the polynomials beyond the width
constexpr int restart_every = 256;  // number of steps after which a phase is computed anew, because rounding errors accumulate

double kernel(double x) {  // x: from the middle, in half widths; callers multiply by the width and sharpness_per_width
  // max(0) is needed because |x| may exceed 1 by rounding.
  return std::sqrt(std::max(0.0, 1 - x * x)) - 1;
}

/// Integral of the kernel times cos(2 pi f z) over z in [-width / 2, width / 2], z in grid points.
double kernel_transform(int width, double f) {
  // The substitution x = sin t makes the integrand smooth at its ends. There the midpoint rule is then as accurate as any
  // other.
  const int steps = 20 * width + 60;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    // z = x width / 2, dz = cos(t) dt width / 2.
    const double t = pi * ((i + 0.5) / steps - 0.5), x = std::sin(t);
    sum += std::exp(sharpness_per_width * width * kernel(x)) * std::cos(pi * f * width * x) * std::cos(t);
  }
  return sum * pi / steps * width / 2;
}

/// Coefficients, lowest first, of the polynomial through the Chebyshev points of [-1, 1]. It is as accurate as least squares.
template <class Function>
std::vector<double> fit(const Function& f, int terms) {
  const auto n = static_cast<std::size_t>(terms);
  std::vector<double> node(n), divided(n), power(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    node[i] = std::cos(pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
    divided[i] = f(node[i]);
  }
  // Newton's divided differences, which are then expanded to powers.
  for (std::size_t order = 1; order < n; ++order)
    for (std::size_t i = n - 1; i >= order; --i) divided[i] = (divided[i] - divided[i - 1]) / (node[i] - node[i - order]);
  for (std::size_t i = n; i-- > 0;) {  // power = power * (t - node_i) + divided_i
    for (std::size_t k = n - 1; k > 0; --k) power[k] = power[k - 1] - node[i] * power[k];
    power[0] = divided[i] - node[i] * power[0];
  }
  return power;
}

}  // namespace

std::vector<Complex> direct_sum(std::span<const Arrival> arrivals, const FrequencyGrid& grid) {
  std::vector<Complex> sums(static_cast<std::size_t>(grid.count));
  for (const Arrival& a : arrivals) {
    // In eq. 25 the factor from one frequency to the next is e^{-i 2 pi df tau}.
    const Complex step = turned(-grid.step_hz * a.delay_s);
    Complex now;
    for (int m = 0; m < grid.count; ++m) {
      if (m % restart_every == 0) now = a.amplitude * turned(-(grid.first_hz + m * grid.step_hz) * a.delay_s);
      sums[static_cast<std::size_t>(m)] += now;
      now *= step;
    }
  }
  return sums;
}

std::vector<Complex> fast_sum(std::span<const Arrival> arrivals, const FrequencyGrid& grid, int width) {
  const FrequencySums fast(grid.count, width);
  std::vector<Complex> fine(static_cast<std::size_t>(fast.grid_points())), sums(static_cast<std::size_t>(grid.count));
  // FrequencySums counts frequencies from the middle. Therefore the phase of the middle frequency is included in each
  // amplitude.
  const double middle_hz = grid.first_hz + (grid.count / 2) * grid.step_hz;
  for (const Arrival& a : arrivals) fast.add(grid.step_hz * a.delay_s, a.amplitude * turned(-middle_hz * a.delay_s), fine.data());
  fast.transform(fine.data(), sums.data());
  return sums;
}

FrequencySums::FrequencySums(int count, int width)
    : count_(count),
      width_(width),
      points_(quick_size(std::max(oversampling * count, 2 * width))),
      padded_(width <= small_padding ? small_padding : large_padding),
      forward_(points_, Fft::Direction::forward),
      terms_(width + extra_terms) {
  // Point k of the kernel is a polynomial in t in [-1, 1]; t is the position of the echo between two points.
  polynomial_.assign(static_cast<std::size_t>(terms_ * padded_), 0.0);
  for (int k = 0; k < width; ++k) {
    const std::vector<double> fitted =
        fit([&](double t) { return std::exp(sharpness_per_width * width * kernel(((t + 1) / 2 + k) * 2 / width - 1)); }, terms_);
    for (int term = 0; term < terms_; ++term)
      polynomial_[static_cast<std::size_t>(term * padded_ + k)] = fitted[static_cast<std::size_t>(terms_ - 1 - term)];
  }
  // The grid is the convolution of the echoes with the kernel. In frequency, the result is divided by the kernel's transform.
  for (int m = 0; m < count; ++m)
    correction_.push_back(1 / kernel_transform(width, static_cast<double>(m - count / 2) / points_));
}

template <int padded>
void FrequencySums::spread(double turns, Complex amplitude, Complex* grid) const {
  // The delay in grid points. The grid is one turn long and periodic.
  const double place = (turns - std::floor(turns)) * points_;  // may be rounded up to points_; the wrap below handles this case
  const double first = std::ceil(place - 0.5 * width_);
  // The distance from the kernel's edge to the first point, 0 to 1 spacings, gives the t of the polynomials.
  const double t = 2 * (first - place + 0.5 * width_) - 1;
  double value[padded];
  const double* c = polynomial_.data();
  // Horner's scheme for all points in parallel; the points beyond the width are padding.
  for (int k = 0; k < padded; ++k) value[k] = c[k];
  for (int term = 1; term < terms_; ++term) {
    c += padded;
    for (int k = 0; k < padded; ++k) value[k] = value[k] * t + c[k];
  }
  int at = static_cast<int>(first);
  if (at < 0) at += points_;
  for (int k = 0; k < width_; ++k) {
    if (at >= points_) at -= points_;
    grid[at++] += value[k] * amplitude;
  }
}

void FrequencySums::add(double turns, Complex amplitude, Complex* grid) const {
  if (padded_ == small_padding)
    spread<small_padding>(turns, amplitude, grid);
  else
    spread<large_padding>(turns, amplitude, grid);
}

void FrequencySums::add(std::span<const double> turns, std::span<const double> re, std::span<const double> im, double turn_on,
                        const simd::Kernels& kernels, Complex* grid) const {
  // The vector form is compiled only for width 8, which the paper mode uses.
  assert(width_ == simd::SpreadGrid::width && padded_ == small_padding);
  kernels.spread({points_, terms_, polynomial_.data()}, {turns.data(), re.data(), im.data(), turn_on},
                 static_cast<int>(turns.size()), reinterpret_cast<double*>(grid));
}

void FrequencySums::transform(Complex* grid, Complex* sums) const {
  forward_.run(grid);
  for (int m = 0; m < count_; ++m) {
    // Frequencies below the middle are in the upper half of the transform.
    const int frequency = m - count_ / 2;
    sums[m] = correction_[static_cast<std::size_t>(m)] * grid[frequency < 0 ? frequency + points_ : frequency];
  }
}

}  // namespace sonar::spectral
