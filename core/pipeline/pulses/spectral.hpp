// Sums of delayed echoes at every frequency of a regular grid, by the definition and with a fast method. They are used for
// measured pulses, for the exact mode, and for the frequency sum of Choi 2025 (docs/acoustics.md, section 4).
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/pulses/spectral_transform.hpp"
#include "core/pipeline/simd/kernels.hpp"

namespace sonar::spectral {

/// e^{i 2 pi turns}, exact for any number of turns.
inline Complex turned(double turns) { return std::polar(1.0, 2 * pi * fraction_of_turn(turns)); }

/// Frequencies first_hz + m step_hz, m in [0, count).
struct FrequencyGrid {
  double first_hz = 0, step_hz = 0;
  int count = 0;
};

/// One echo: its time of arrival and its complex amplitude.
struct Arrival {
  double delay_s = 0;
  Complex amplitude;
};

/// F[m] = sum_i A_i e^{-i 2 pi f_m tau_i}, term by term in double. Tests compare with it. It needs no transform.
std::vector<Complex> direct_sum(std::span<const Arrival> arrivals, const FrequencyGrid& grid);

/// The same sums with a non-uniform transform. The relative L2 error is about 8e-6 at width 6, see FrequencySums.
std::vector<Complex> fast_sum(std::span<const Arrival> arrivals, const FrequencyGrid& grid, int width = 6);

/// Non-uniform Fourier transform, type 1. The grid is twice as fine as needed. Every echo is spread over `width` points of the
/// grid with the kernel exp(2.3 width (sqrt(1 - x^2) - 1)) (docs/acoustics.md, eq. 26). The grid is transformed, and the result
/// is divided by the transform of the kernel. Relative L2 errors: 8e-4 (width 4), 7e-5 (5), 8e-6 (6), 9e-7 (7), 1e-7 (8), 1e-9
/// (10). Several threads may use one object, each with its own grid.
class FrequencySums {
 public:
  explicit FrequencySums(int count, int width = 6);
  int count() const { return count_; }
  /// Number of values in the grid, which the caller owns and sets to zero before the first add().
  int grid_points() const { return points_; }
  /// The tables of add() and transform(), for an engine that computes the same sums on a device.
  struct Tables {
    int width, terms, padded;
    std::span<const double> polynomial;  // [terms][padded], highest power first: the kernel at each of `width` points
    std::span<const double> correction;  // per sum: 1 / the kernel's transform
  };
  Tables tables() const { return {width_, terms_, padded_, polynomial_, correction_}; }
  /// Adds one echo. `turns`: delay times the frequency step, any finite number. Delays that differ by whole turns give the same
  /// result.
  void add(double turns, Complex amplitude, Complex* grid) const;
  /// Adds many echoes, each multiplied by e^{-i 2 pi turn_on turns} first. The width must be 8. The grid must have room for
  /// `padding` more values.
  void add(std::span<const double> turns, std::span<const double> re, std::span<const double> im, double turn_on,
           const simd::Kernels& kernels, Complex* grid) const;
  static constexpr int padding = simd::SpreadGrid::width;
  /// sums[m] = sum_i A_i e^{-i 2 pi (m - count / 2) turns_i}, m in [0, count). The grid is used as working memory; its values
  /// are undefined afterwards.
  void transform(Complex* grid, Complex* sums) const;

 private:
  template <int padded>
  void spread(double turns, Complex amplitude, Complex* grid) const;

  int count_, width_, points_, padded_;
  Fft forward_;
  int terms_ = 0;
  std::vector<double> polynomial_;  // [terms][padded]: the kernel at each point, for an echo at a position between two points
  std::vector<double> correction_;  // 1 / the kernel's transform, per sum
};

}  // namespace sonar::spectral
