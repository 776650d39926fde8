// Columns to beams by way of a Fourier transform across the columns, included by kernels.inl once per instruction set: every
// value here is a vector of `lanes` samples, so that all of them take the same path. What it computes: beam_transform.hpp.
// In place and without reordering: forward passes leave the frequencies in the order of their digits, the response is stored in
// that order, and the inverse passes go the same way back.

/// A complex value of one column for each of `lanes` samples.
struct ComplexLanes {
  Lanes re, im;
};
inline ComplexLanes operator+(ComplexLanes a, ComplexLanes b) { return {a.re + b.re, a.im + b.im}; }
inline ComplexLanes operator-(ComplexLanes a, ComplexLanes b) { return {a.re - b.re, a.im - b.im}; }
// Times a turn w = {re, im} of the tables, or its conjugate: the same for all lanes.
inline ComplexLanes times(ComplexLanes v, const float* w) { return {v.re * w[0] - v.im * w[1], v.re * w[1] + v.im * w[0]}; }
inline ComplexLanes times_conjugate(ComplexLanes v, const float* w) {
  return {v.re * w[0] + v.im * w[1], v.im * w[0] - v.re * w[1]};
}
inline ComplexLanes times_i(ComplexLanes v) { return {-v.im, v.re}; }

/// Orders of lanes between memory, (re, im, re, im ...), and ComplexLanes.
struct Shuffles {
  LaneNumbers even, odd, low, high;
};
inline Shuffles shuffles() {
  Shuffles s{};
  for (int i = 0; i < lanes; ++i) {
    s.even[i] = 2 * i, s.odd[i] = 2 * i + 1;
    s.low[i] = i / 2 + (i % 2) * lanes, s.high[i] = lanes / 2 + i / 2 + (i % 2) * lanes;
  }
  return s;
}
inline ComplexLanes load_interleaved(const float* at, const Shuffles& s) {
  const Lanes a = *reinterpret_cast<const Lanes*>(at), b = *reinterpret_cast<const Lanes*>(at + lanes);
  return {__builtin_shuffle(a, b, s.even), __builtin_shuffle(a, b, s.odd)};
}
inline void store_interleaved(ComplexLanes v, const Shuffles& s, float* at) {
  *reinterpret_cast<Lanes*>(at) = __builtin_shuffle(v.re, v.im, s.low);
  *reinterpret_cast<Lanes*>(at + lanes) = __builtin_shuffle(v.re, v.im, s.high);
}

/// One pass over a block of n: n / radix butterflies, `w` their (radix - 1) turns each.
template <int radix, bool forward>
inline void butterflies(ComplexLanes* x, int n, const float* w) {
  // Forward: decimation in frequency, first the sums, then the turns e^{-i 2 pi i m / n}. Inverse: the same backwards, first the
  // conjugate turns, then the sums with conjugate roots of unity.
  constexpr float half_root_3 = 0.8660254037844386f;
  const int q = n / radix;
  for (int i = 0; i < q; ++i, w += 2 * (radix - 1)) {
    ComplexLanes* at = x + i;
    if constexpr (radix == 2) {
      const ComplexLanes a = at[0], b = forward ? at[q] : times_conjugate(at[q], w);
      at[0] = a + b;
      at[q] = forward ? times(a - b, w) : a - b;
    } else if constexpr (radix == 3) {
      const ComplexLanes a = at[0], b = forward ? at[q] : times_conjugate(at[q], w),
                         c = forward ? at[2 * q] : times_conjugate(at[2 * q], w + 2);
      // The cube roots of unity are -1/2 +- i sqrt(3)/2.
      const ComplexLanes sum = b + c, middle{a.re - 0.5f * sum.re, a.im - 0.5f * sum.im};
      const ComplexLanes across{half_root_3 * (b.re - c.re), half_root_3 * (b.im - c.im)};
      const ComplexLanes up = middle + times_i(across), down = middle - times_i(across);
      at[0] = a + sum;
      at[q] = forward ? times(down, w) : up;
      at[2 * q] = forward ? times(up, w + 2) : down;
    } else {
      const ComplexLanes a = at[0], b = forward ? at[q] : times_conjugate(at[q], w),
                         c = forward ? at[2 * q] : times_conjugate(at[2 * q], w + 2),
                         d = forward ? at[3 * q] : times_conjugate(at[3 * q], w + 4);
      // The fourth roots of unity are +-1 and +-i: no multiplication.
      const ComplexLanes s = a + c, t = a - c, u = b + d, v = times_i(b - d);
      at[0] = s + u;
      at[q] = forward ? times(t - v, w) : t + v;
      at[2 * q] = forward ? times(s - u, w + 2) : s - u;
      at[3 * q] = forward ? times(t + v, w + 4) : t - v;
    }
  }
}

template <bool forward>
inline void transform_pass(const BeamTransform& t, int level, ComplexLanes* block) {
  // A level works on quarter / size blocks, each for itself.
  const BeamTransform::Level& l = t.level[level];
  for (int from = 0; from < t.quarter; from += l.size) {
    if (l.radix == 4)
      butterflies<4, forward>(block + from, l.size, l.turns);
    else if (l.radix == 3)
      butterflies<3, forward>(block + from, l.size, l.turns);
    else
      butterflies<2, forward>(block + from, l.size, l.turns);
  }
}

/// First pass, of a line whose second half is zero: columns [0, count) into four quarters.
__attribute__((noinline)) void take_columns(const BeamTransform& t, const float* columns, std::ptrdiff_t stride, int count,
                                            ComplexLanes* x) {
  const int q = t.quarter;
  const Shuffles s = shuffles();
  const float* w = t.split;
  for (int i = 0; i < q; ++i, w += 6) {
    // A line of 4 q has inputs i, i + q, i + 2 q and i + 3 q; the last two are the padding.
    const ComplexLanes a = i < count ? load_interleaved(columns + i * stride, s) : ComplexLanes{};
    const ComplexLanes b = i + q < count ? load_interleaved(columns + (i + q) * stride, s) : ComplexLanes{};
    const ComplexLanes v = times_i(b);
    x[i] = a + b;
    x[i + q] = times(a - v, w);
    x[i + 2 * q] = times(a - b, w + 2);
    x[i + 3 * q] = times(a + v, w + 4);
  }
}

/// A quarter to its frequencies, weighed there, and back.
__attribute__((noinline)) void weigh_quarter(const BeamTransform& t, const float* response, ComplexLanes* x) {
  for (int level = 0; level < t.levels; ++level) transform_pass<true>(t, level, x);
  // (9) over frequencies: times the transform of W, which is real since W is even; it includes 1 / size of the inverse.
  for (int i = 0; i < t.quarter; ++i) x[i] = {x[i].re * response[i], x[i].im * response[i]};
  for (int level = t.levels; level-- > 0;) transform_pass<false>(t, level, x);
}

/// Last pass: only the half of the line that stands for columns is wanted.
__attribute__((noinline)) void join_quarters(const BeamTransform& t, ComplexLanes* x) {
  const int q = t.quarter;
  const float* w = t.split;
  for (int i = 0; i < q; ++i, w += 6) {
    const ComplexLanes a = x[i], b = times_conjugate(x[i + q], w), c = times_conjugate(x[i + 2 * q], w + 2),
                       d = times_conjugate(x[i + 3 * q], w + 4);
    // Outputs i + 2 q and i + 3 q would be beams beyond the columns.
    x[i] = (a + c) + (b + d);
    x[i + q] = (a - c) + times_i(b - d);
  }
}

/// Beams between the columns' centres, each from the few columns round it.
__attribute__((noinline)) void read_beams(const BeamTransform& t, const ComplexLanes* line, float* out,
                                          std::ptrdiff_t out_stride) {
  const Shuffles s = shuffles();
  // Interpolation of an array's response, band-limited by its aperture; one tap of 1 where beams lie on columns.
  const float* w = t.between;
  for (int j = 0; j < t.beams; ++j, w += t.taps, out += out_stride) {
    const ComplexLanes* at = line + t.first_column[j];
    ComplexLanes sum{at[0].re * w[0], at[0].im * w[0]};
    for (int k = 1; k < t.taps; ++k) sum = {sum.re + at[k].re * w[k], sum.im + at[k].im * w[k]};
    store_interleaved(sum, s, out);
  }
}

void transform_beams(const BeamTransform& t, const float* columns, std::ptrdiff_t stride, int floats, float* work, float* out,
                     std::ptrdiff_t out_stride) {
  auto* x = reinterpret_cast<ComplexLanes*>(work);
  // A vector of samples at a time: its line of 4 q complex values stays in cache through all passes.
  for (int f = 0; f < floats; f += 2 * lanes) {
    take_columns(t, columns + f, stride, t.columns, x);
    for (int k = 0; k < 4; ++k) weigh_quarter(t, t.response + k * t.quarter, x + k * t.quarter);
    join_quarters(t, x);
    read_beams(t, x, out + f, out_stride);
  }
}

/// Squares of magnitudes, turned from beams of rows to rows of beams, `lanes` of both at a time.
void detect(const float* beams, std::ptrdiff_t stride, int beam_count, int rows, float* power, int width) {
  const Shuffles s = shuffles();
  // Transposes a square tile: steps 1, 2, 4 ... exchange blocks of that size across the diagonal.
  LaneNumbers keep[5], swap[5];
  int steps = 0;
  for (int step = 1; step < lanes; step *= 2, ++steps)
    for (int i = 0; i < lanes; ++i) {
      keep[steps][i] = (i & step) == 0 ? i : lanes + i - step;
      swap[steps][i] = (i & step) == 0 ? i + step : lanes + i;
    }
  for (int j = 0; j < beam_count; j += lanes)
    for (int row = 0; row < rows; row += lanes) {
      // Beams or rows that do not fill a vector, at the edges.
      if (j + lanes > beam_count || row + lanes > rows) {
        for (int n = row; n < rows && n < row + lanes; ++n)
          for (int k = j; k < beam_count && k < j + lanes; ++k) {
            const float* at = beams + k * stride + 2 * n;
            power[n * width + k] = at[0] * at[0] + at[1] * at[1];
          }
        continue;
      }
      // |s|^2 [uPa^2]: rows lie side by side before the transposition, beams after it.
      Lanes tile[lanes];
      for (int k = 0; k < lanes; ++k) {
        const ComplexLanes v = load_interleaved(beams + (j + k) * stride + 2 * row, s);
        tile[k] = v.re * v.re + v.im * v.im;
      }
      for (int n = 0, step = 1; n < steps; ++n, step *= 2)
        for (int block = 0; block < lanes; block += 2 * step)
          for (int k = block; k < block + step; ++k) {
            const Lanes a = tile[k], b = tile[k + step];
            tile[k] = __builtin_shuffle(a, b, keep[n]);
            tile[k + step] = __builtin_shuffle(a, b, swap[n]);
          }
      for (int k = 0; k < lanes; ++k) *reinterpret_cast<Lanes*>(power + (row + k) * width + j) = tile[k];
    }
}
