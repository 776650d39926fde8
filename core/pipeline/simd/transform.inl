// Makes beams from columns by a Fourier transform across the columns (tables: kernels.hpp). kernels.inl includes the
// file once per instruction set. Every value is a vector of `lanes` samples. The transform is in place, without reordering:
// forward passes leave the frequencies in digit-reversed order, the response is stored in this order, and inverse passes
// restore the original order.

/// A complex value of one column for each of `lanes` samples.
struct ComplexLanes {
  Lanes re, im;
};
inline ComplexLanes operator+(ComplexLanes a, ComplexLanes b) { return {a.re + b.re, a.im + b.im}; }
inline ComplexLanes operator-(ComplexLanes a, ComplexLanes b) { return {a.re - b.re, a.im - b.im}; }
// Multiplies by a factor w = {re, im} of the tables, or by its conjugate. The factor is the same for all lanes.
inline ComplexLanes times(ComplexLanes v, const float* w) { return {v.re * w[0] - v.im * w[1], v.re * w[1] + v.im * w[0]}; }
inline ComplexLanes times_conjugate(ComplexLanes v, const float* w) {
  return {v.re * w[0] + v.im * w[1], v.im * w[0] - v.re * w[1]};
}
inline ComplexLanes times_i(ComplexLanes v) { return {-v.im, v.re}; }

/// Converts between the order of lanes in memory, (re, im, re, im ...), and ComplexLanes. Lane i of ComplexLanes is not value i
/// but value_of_lane(i): only lanes of the same four are exchanged, for which every instruction set has one instruction.
constexpr int value_of_lane(int i) { return (i % 4 < 2 ? 0 : lanes / 2) + i / 4 * 2 + i % 2; }
struct Shuffles {
  LaneNumbers even, odd, low, high;
};
inline Shuffles shuffles() {
  const auto memory = [](int i) { return i % 4 < 2 ? i / 4 * 4 + 2 * (i % 4) : lanes + i / 4 * 4 + 2 * (i % 4 - 2); };
  const auto lane = [](int i) { return i / 4 * 4 + i % 4 / 2 + (i % 2) * lanes; };
  return {lane_numbers(memory), lane_numbers([memory](int i) { return memory(i) + 1; }), lane_numbers(lane),
          lane_numbers([lane](int i) { return lane(i) + 2; })};
}
inline ComplexLanes load_interleaved(const float* at, const Shuffles& s) {
  const Lanes a = *reinterpret_cast<const Lanes*>(at), b = *reinterpret_cast<const Lanes*>(at + lanes);
  return {shuffle(a, b, s.even), shuffle(a, b, s.odd)};
}
inline void store_interleaved(ComplexLanes v, const Shuffles& s, float* at) {
  *reinterpret_cast<Lanes*>(at) = shuffle(v.re, v.im, s.low);
  *reinterpret_cast<Lanes*>(at + lanes) = shuffle(v.re, v.im, s.high);
}

/// The discrete Fourier transform of `radix` neighbouring values, not scaled; inverse: with conjugate roots of unity.
template <int radix, bool forward>
inline __attribute__((always_inline)) void sums(ComplexLanes* v) {
  constexpr float half_root_3 = 0.8660254037844386f;
  if constexpr (radix == 2) {
    const ComplexLanes a = v[0], b = v[1];
    v[0] = a + b, v[1] = a - b;
  } else if constexpr (radix == 3) {
    // The cube roots of unity are -1/2 +- i sqrt(3)/2.
    const ComplexLanes a = v[0], b = v[1], c = v[2], sum = b + c, middle{a.re - 0.5f * sum.re, a.im - 0.5f * sum.im};
    const ComplexLanes across{half_root_3 * (b.re - c.re), half_root_3 * (b.im - c.im)};
    v[0] = a + sum, v[forward ? 2 : 1] = middle + times_i(across), v[forward ? 1 : 2] = middle - times_i(across);
  } else if constexpr (radix == 4) {
    // The fourth roots of unity are +-1 and +-i, which need no multiplication.
    const ComplexLanes s = v[0] + v[2], t = v[0] - v[2], u = v[1] + v[3], across = times_i(v[1] - v[3]);
    v[0] = s + u, v[forward ? 3 : 1] = t + across, v[2] = s - u, v[forward ? 1 : 3] = t - across;
  } else {
    // Good and Thomas: 6 = 2 x 3 without factors in between; input (3 a + 2 b) mod 6, output (3 a + 4 b) mod 6.
    static_assert(radix == 6);
    ComplexLanes even[3] = {v[0] + v[3], v[2] + v[5], v[4] + v[1]}, odd[3] = {v[0] - v[3], v[2] - v[5], v[4] - v[1]};
    sums<3, forward>(even);
    sums<3, forward>(odd);
    v[0] = even[0], v[4] = even[1], v[2] = even[2], v[3] = odd[0], v[1] = odd[1], v[5] = odd[2];
  }
}

/// One pass over a block of n: n / radix butterflies, with (radix - 1) factors `w` each. Forward (decimation in frequency):
/// first the sums, then the factors e^{-j 2 pi i m / n}. Inverse: the reverse order, with conjugate factors.
template <int radix, bool forward>
inline void butterflies(ComplexLanes* x, int n, const float* w) {
  const int q = n / radix;
  for (int i = 0; i < q; ++i, w += 2 * (radix - 1)) {
    ComplexLanes v[radix];
    v[0] = x[i];
    for (int m = 1; m < radix; ++m) v[m] = forward ? x[i + m * q] : times_conjugate(x[i + m * q], w + 2 * (m - 1));
    sums<radix, forward>(v);
    x[i] = v[0];
    for (int m = 1; m < radix; ++m) x[i + m * q] = forward ? times(v[m], w + 2 * (m - 1)) : v[m];
  }
}

/// The last forward pass (all its factors are 1), the product with the response, and the first inverse pass.
template <int radix>
inline void weigh_values(ComplexLanes* x, int n, const float* response) {
  for (int i = 0; i < n; i += radix) {
    ComplexLanes v[radix];
    for (int m = 0; m < radix; ++m) v[m] = x[i + m];
    sums<radix, true>(v);
    for (int m = 0; m < radix; ++m) v[m] = {v[m].re * response[i + m], v[m].im * response[i + m]};
    sums<radix, false>(v);
    for (int m = 0; m < radix; ++m) x[i + m] = v[m];
  }
}

template <bool forward>
inline void transform_pass(const BeamTransform& t, int level, ComplexLanes* block) {
  // A level processes quarter / size blocks separately.
  const BeamTransform::Level& l = t.level[level];
  for (int from = 0; from < t.quarter; from += l.size) {
    if (l.radix == 6)
      butterflies<6, forward>(block + from, l.size, l.turns);
    else if (l.radix == 4)
      butterflies<4, forward>(block + from, l.size, l.turns);
    else if (l.radix == 3)
      butterflies<3, forward>(block + from, l.size, l.turns);
    else
      butterflies<2, forward>(block + from, l.size, l.turns);
  }
}

/// First pass: reads columns [0, count), followed by zeros in the second half of the line, into four quarters.
__attribute__((noinline)) void take_columns(const BeamTransform& t, const float* columns, std::ptrdiff_t stride, int count,
                                            ComplexLanes* x) {
  const int q = t.quarter;
  const Shuffles s = shuffles();
  const float* w = t.split;
  // Fetches the values for the next call to the second-level cache. Columns are so far apart that the hardware prefetcher misses
  // them.
  const auto fetch_next = [&](int column) {
    for (int f = 2 * lanes; f < 4 * lanes; f += 16) __builtin_prefetch(columns + column * stride + f, 0, 2);
  };
  for (int i = 0; i < q; ++i, w += 6) {
    if (i < count) fetch_next(i);
    if (i + q < count) fetch_next(i + q);
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

/// Transforms a quarter to its frequencies, multiplies them by the response, and transforms back.
__attribute__((noinline)) void weigh_quarter(const BeamTransform& t, const float* response, ComplexLanes* x) {
  const int last = t.levels - 1;
  for (int level = 0; level < last; ++level) transform_pass<true>(t, level, x);
  // Eq. 9 over frequencies: multiplies by the transform of W, which is real because W is symmetric. It includes 1 / size of the
  // inverse.
  if (t.level[last].radix == 4)
    weigh_values<4>(x, t.quarter, response);
  else if (t.level[last].radix == 3)
    weigh_values<3>(x, t.quarter, response);
  else
    weigh_values<2>(x, t.quarter, response);
  for (int level = last; level-- > 0;) transform_pass<false>(t, level, x);
}

/// Last pass. It computes only the half of the line that belongs to columns.
__attribute__((noinline)) void join_quarters(const BeamTransform& t, ComplexLanes* x) {
  const int q = t.quarter;
  const float* w = t.split;
  for (int i = 0; i < q; ++i, w += 6) {
    const ComplexLanes a = x[i], b = times_conjugate(x[i + q], w), c = times_conjugate(x[i + 2 * q], w + 2),
                       d = times_conjugate(x[i + 3 * q], w + 4);
    // The outputs i + 2 q and i + 3 q are not computed, because they would be beams beyond the columns.
    x[i] = (a + c) + (b + d);
    x[i + q] = (a - c) + times_i(b - d);
  }
}

/// Computes beams between the centres of columns, each from a few neighbouring columns.
__attribute__((noinline)) void read_beams(const BeamTransform& t, const ComplexLanes* line, float* out,
                                          std::ptrdiff_t out_stride) {
  const Shuffles s = shuffles();
  // Interpolates an array's response, which is band-limited by the aperture. Beams on columns need only one tap of 1.
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
  // Processes one vector of samples at a time. Its line of 4 q complex values stays in the cache through all passes.
  for (int f = 0; f < floats; f += 2 * lanes) {
    take_columns(t, columns + f, stride, t.columns, x);
    for (int k = 0; k < 4; ++k) weigh_quarter(t, t.response + k * t.quarter, x + k * t.quarter);
    join_quarters(t, x);
    read_beams(t, x, out + f, out_stride);
  }
}

/// Transposes a square tile: the steps 1, 2, 4 ... exchange blocks of that size across the diagonal.
template <int step = 1>
inline __attribute__((always_inline)) void transpose(Lanes* tile) {
  const LaneNumbers keep = lane_numbers([](int i) { return (i & step) == 0 ? i : lanes + i - step; });
  const LaneNumbers swap = lane_numbers([](int i) { return (i & step) == 0 ? i + step : lanes + i; });
  for (int block = 0; block < lanes; block += 2 * step)
    for (int k = block; k < block + step; ++k) {
      const Lanes a = tile[k], b = tile[k + step];
      tile[k] = shuffle(a, b, keep);
      tile[k + step] = shuffle(a, b, swap);
    }
  if constexpr (2 * step < lanes) transpose<2 * step>(tile);
}

/// Computes squared magnitudes, and transposes them from beams of rows to rows of beams, `lanes` of both at a time.
void detect(const float* beams, std::ptrdiff_t stride, int beam_count, int rows, float* power, int width) {
  const Shuffles s = shuffles();
  for (int j = 0; j < beam_count; j += lanes)
    for (int row = 0; row < rows; row += lanes) {
      // Handles beams or rows at the edges that do not fill a vector.
      if (j + lanes > beam_count || row + lanes > rows) {
        for (int n = row; n < rows && n < row + lanes; ++n)
          for (int k = j; k < beam_count && k < j + lanes; ++k) {
            const float* at = beams + k * stride + 2 * n;
            power[n * width + k] = at[0] * at[0] + at[1] * at[1];
          }
        continue;
      }
      // |s|^2 [uPa^2]. Rows are neighbours before the transposition, beams after it.
      Lanes tile[lanes];
      for (int k = 0; k < lanes; ++k) {
        const ComplexLanes v = load_interleaved(beams + (j + k) * stride + 2 * row, s);
        tile[k] = v.re * v.re + v.im * v.im;
      }
      transpose(tile);
      for (int k = 0; k < lanes; ++k) *reinterpret_cast<Lanes*>(power + (row + value_of_lane(k)) * width + j) = tile[k];
    }
}
