// The spreading of the non-uniform transform (core/pipeline/pulses/spectral.hpp), in double. kernels.inl includes it.

inline double sine_of_turns_exact(double turns) {  // accurate to 1e-11
  double x = turns - std::floor(turns + 0.5);
  x = (x > 0.25 ? 0.5 - x : x < -0.25 ? -0.5 - x : x) * 6.283185307179586;
  const double y = x * x;
  double p = -7.647163731819816e-13;  // 1 / 15!
  p = p * y + 1.605904383682161e-10;
  p = p * y - 2.505210838544172e-8;
  p = p * y + 2.755731922398589e-6;
  p = p * y - 1.984126984126984e-4;
  p = p * y + 8.333333333333333e-3;
  p = p * y - 1.666666666666667e-1;
  return x + x * y * p;
}

inline constexpr int spread_at_once = 64;

/// Advances the phases of the echoes. Finds the first grid point of each echo and its offset between grid points.
__attribute__((noinline)) void place_on_grid(const SpreadGrid& g, const SpreadEchoes& e, int from, int n, double* __restrict re,
                                             double* __restrict im, double* __restrict first, double* __restrict between) {
  const double* __restrict turns = e.turns + from;
  const double* __restrict in_re = e.re + from;
  const double* __restrict in_im = e.im + from;
  const double points = g.points, turn_on = e.turn_on;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const double phase = -turn_on * turns[i];
    // e^{-i 2 pi turn_on turns}.
    const double c = sine_of_turns_exact(phase - std::floor(phase) + 0.25), s = sine_of_turns_exact(phase - std::floor(phase));
    re[i] = in_re[i] * c - in_im[i] * s;
    im[i] = in_re[i] * s + in_im[i] * c;
    // The delay in grid points. `first` and `between` determine the kernel (eq. 26), as in FrequencySums::spread.
    const double place = (turns[i] - std::floor(turns[i])) * points;
    first[i] = std::ceil(place - 0.5 * SpreadGrid::width);
    between[i] = 2 * (first[i] - place + 0.5 * SpreadGrid::width) - 1;
  }
}

void spread(const SpreadGrid& g, const SpreadEchoes& e, int count, double* grid) {
  constexpr int width = SpreadGrid::width;
  for (int from = 0; from < count; from += spread_at_once) {
    const int n = count - from < spread_at_once ? count - from : spread_at_once;
    alignas(64) double re[spread_at_once], im[spread_at_once], first[spread_at_once], between[spread_at_once];
    place_on_grid(g, e, from, n, re, im, first, between);
    for (int i = 0; i < n; ++i) {
      alignas(64) double value[width];
      const double* __restrict c = g.polynomial;
      const double t = between[i];
      for (int k = 0; k < width; ++k) value[k] = c[k];
      for (int term = 1; term < g.terms; ++term) {
        c += width;
        for (int k = 0; k < width; ++k) value[k] = value[k] * t + c[k];
      }
      // The grid has memory for one kernel beyond its end, so the loop need not wrap around.
      const int begin = static_cast<int>(first[i]);
      double* __restrict at = grid + 2 * (begin < 0 ? begin + g.points : begin);
      for (int k = 0; k < width; ++k) {
        at[2 * k] += value[k] * re[i];
        at[2 * k + 1] += value[k] * im[i];
      }
    }
  }
  for (int k = 0; k < 2 * width; ++k) {  // adds the part beyond the end to the beginning
    grid[k] += grid[2 * g.points + k];
    grid[2 * g.points + k] = 0;
  }
}
