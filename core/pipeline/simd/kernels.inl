// Bodies of the hot loops, included once per instruction set inside a namespace of its own. Written as plain loops over short
// arrays that the compiler turns into vector code; `lanes` is the width it should think in.
// Loops that must become vector code stand in functions of their own: inlined into each other, compilers lose the thread.
// The order of every sum is fixed, so a result depends on the instruction set but never on threads.

inline float larger(float a, float b) { return a > b ? a : b; }
inline float smaller(float a, float b) { return a < b ? a : b; }

inline float sine_of_turns(float turns) {
  float x = turns - std::floor(turns + 0.5f);
  const float folded = (x > 0 ? 0.5f : -0.5f) - x;
  x = std::fabs(x) > 0.25f ? folded : x;
  const float y = 6.2831853071795865f * x, y2 = y * y;
  float p = -2.5052108e-8f;
  p = p * y2 + 2.7557319e-6f;
  p = p * y2 - 1.9841270e-4f;
  p = p * y2 + 8.3333333e-3f;
  p = p * y2 - 1.6666667e-1f;
  return y + y * y2 * p;
}

inline float log2_of(float x) {  // x > 0 and normal; relative error of 2^(log2 x) about 2e-7
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  const std::int32_t exponent = static_cast<std::int32_t>((bits - 0x3f3504f3u)) >> 23;
  const float m = std::bit_cast<float>(bits - (static_cast<std::uint32_t>(exponent) << 23));  // in [sqrt(1/2), sqrt(2))
  const float t = (m - 1.0f) / (m + 1.0f), t2 = t * t;
  float p = 2.0f / 11.0f;
  p = p * t2 + 2.0f / 9.0f;
  p = p * t2 + 2.0f / 7.0f;
  p = p * t2 + 2.0f / 5.0f;
  p = p * t2 + 2.0f / 3.0f;
  p = p * t2 + 2.0f;
  return static_cast<float>(exponent) + 1.44269504f * t * p;
}

inline float exp2_of(float x) {
  x = x < -126.0f ? -126.0f : (x > 126.0f ? 126.0f : x);
  const float whole = std::floor(x + 0.5f);
  const float f = (x - whole) * 0.69314718f;
  float p = 1.0f / 5040.0f;
  p = p * f + 1.0f / 720.0f;
  p = p * f + 1.0f / 120.0f;
  p = p * f + 1.0f / 24.0f;
  p = p * f + 1.0f / 6.0f;
  p = p * f + 0.5f;
  p = p * f + 1.0f;
  p = p * f + 1.0f;
  return p * std::bit_cast<float>(static_cast<std::uint32_t>(static_cast<std::int32_t>(whole) + 127) << 23);
}

inline constexpr int chunk = 256;

struct Chunk {  // one stretch of a tile on its way through the loops below
  alignas(64) float range[chunk + 16], offset[chunk + 16], cosine[chunk + 16], sine2[chunk + 16], column[chunk + 16],
      sample[chunk + 16];
  alignas(64) float depth_bin[chunk], nearness[chunk];
  alignas(64) float weight_re[chunk + 16], weight_im[chunk + 16];
  alignas(64) std::int32_t keep[chunk], index[chunk + 16];
};

/// Where the cells are: range, column, elevation, cosine of incidence; and which lie in the group's window.
template <bool conical>
__attribute__((noinline)) void place_cells(const TileSeen& s, const GroupView& g, int from, int n, Chunk& c) {
  const CellTile& t = *s.tile;
  const std::int16_t* __restrict tx = t.column(CellTile::x) + from;
  const std::int16_t* __restrict ty = t.column(CellTile::y) + from;
  const std::int16_t* __restrict tz = t.column(CellTile::z) + from;
  const std::int16_t* __restrict nx = t.column(CellTile::normal_x) + from;
  const std::int16_t* __restrict ny = t.column(CellTile::normal_y) + from;
  const std::int16_t* __restrict nz = t.column(CellTile::normal_z) + from;
  const float unit = t.position_unit_m;
  const float qx0 = s.from_sonar_object[0], qy0 = s.from_sonar_object[1], qz0 = s.from_sonar_object[2];
  const float px0 = s.from_sonar[0], py0 = s.from_sonar[1], pz0 = s.from_sonar[2];
  const float r0 = s.range_m, r0_squared = r0 * r0;
  const float m00 = s.turn[0], m01 = s.turn[1], m02 = s.turn[2], m10 = s.turn[3], m11 = s.turn[4], m12 = s.turn[5];
  const float m20 = s.turn[6], m21 = s.turn[7], m22 = s.turn[8];
  const float lo = static_cast<float>(g.first_column), hi = static_cast<float>(g.last_column);
  const float bins = static_cast<float>(g.bins);
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float dx = unit * static_cast<float>(tx[i]), dy = unit * static_cast<float>(ty[i]),
                dz = unit * static_cast<float>(tz[i]);
    const float e = dx * (2 * qx0 + dx) + dy * (2 * qy0 + dy) + dz * (2 * qz0 + dz);
    const float r = std::sqrt(larger(r0_squared + e, 1e-6f));
    const float inverse_r = 1.0f / r;
    const float x = px0 + m00 * dx + m01 * dy + m02 * dz;
    const float y = py0 + m10 * dx + m11 * dy + m12 * dz;
    const float z = pz0 + m20 * dx + m21 * dy + m22 * dz;
    const float along =
        static_cast<float>(nx[i]) * (qx0 + dx) + static_cast<float>(ny[i]) * (qy0 + dy) + static_cast<float>(nz[i]) * (qz0 + dz);
    const float h = conical ? x : std::sqrt(x * x + y * y);  // what elevations are measured against
    const float inverse_h = 1.0f / larger(h, 1e-6f);
    const float column = (g.first_edge_sine - y * (conical ? inverse_r : inverse_h)) * g.columns_per_sine;
    const float bin = (z * inverse_h - g.first_tangent) * g.bins_per_tangent;
    const float sample = r * g.samples_per_m - g.sample_offset + s.sample_shift;
    const bool keep = (column >= lo) & (column < hi) & (bin >= 0) & (bin < bins) & (x > 1e-6f) & (sample > g.first_sample) &
                      (sample < g.last_sample) & (r >= s.fade_in_from_m) & (r < s.fade_out_to_m);
    c.range[i] = r;
    c.offset[i] = e / (r0 + r);
    c.cosine[i] = std::fabs(along) * (CellTile::normal_unit * inverse_r);
    c.sine2[i] = z * z / (h * h + z * z);
    c.depth_bin[i] = keep ? bin : 0.0f;
    c.nearness[i] = inverse_h * (1.0f + g.depth_tolerance_m * inverse_r);
    c.column[i] = keep ? column : lo;
    c.sample[i] = sample;
    c.keep[i] = keep ? 1 : 0;
  }
}

/// The depth map decides what is seen: a cell no farther than what the rays saw along its direction.
__attribute__((noinline)) int look_up(const GroupView& g, int n, Chunk& c) {
  const float* __restrict map = g.inverse_depth;
  const int row = g.bins + 1, first = g.first_column;
  int kept = 0;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const std::int32_t column = static_cast<std::int32_t>(c.column[i]);
    const std::int32_t bin = static_cast<std::int32_t>(c.depth_bin[i]);
    const std::int32_t at = (column - first) * row + bin;
    const float a = map[at], b = map[at + 1];
    const float seen = a + (c.depth_bin[i] - static_cast<float>(bin)) * (b - a);
    const std::int32_t visible = c.keep[i] & static_cast<std::int32_t>(c.nearness[i] >= seen);
    c.keep[i] = visible;
    kept += visible;
  }
  return kept;
}

inline float cross_fade(const TileSeen& s, float r) {
  const float in = (r - s.fade_in_from_m) * s.fade_in_per_m, out = (s.fade_out_to_m - r) * s.fade_out_per_m;
  return larger(smaller(smaller(in, out), 1.0f), 0.0f);
}

/// Moves the visible cells to the front, so that only they are sounded. Returns how many there are.
inline int gather_visible(const TileSeen& s, int from, int n, Chunk& c) {
  const std::int16_t* __restrict wr = s.tile->column(CellTile::weight_re) + from;
  const std::int16_t* __restrict wi = s.tile->column(CellTile::weight_im) + from;
  int m = 0;
#if defined(__AVX512F__)
  const auto pack = [&](float* at, int i, __mmask16 keep) {
    // Compress in registers and store whole vectors: compressing stores are slow on some processors.
    _mm512_storeu_ps(at + m, _mm512_maskz_compress_ps(keep, _mm512_load_ps(at + i)));
  };
  const auto weights = [](const std::int16_t* w) {
    return _mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(w))));
  };
  for (int i = 0; i < n; i += 16) {
    const __m512i flags = _mm512_load_si512(c.keep + i);
    const __mmask16 keep = _mm512_test_epi32_mask(flags, flags);
    if (keep == 0) continue;
    pack(c.range, i, keep);
    pack(c.offset, i, keep);
    pack(c.cosine, i, keep);
    pack(c.sine2, i, keep);
    pack(c.column, i, keep);
    pack(c.sample, i, keep);
    _mm512_storeu_ps(c.weight_re + m, _mm512_maskz_compress_ps(keep, weights(wr + i)));
    _mm512_storeu_ps(c.weight_im + m, _mm512_maskz_compress_ps(keep, weights(wi + i)));
    m += __builtin_popcount(keep);
  }
#else
  for (int i = 0; i < n; ++i) {
    c.index[m] = i;
    m += c.keep[i];
  }
  for (int k = 0; k < m; ++k) {
    const int i = c.index[k];  // never below k: moving forward in place is safe
    c.range[k] = c.range[i];
    c.offset[k] = c.offset[i];
    c.cosine[k] = c.cosine[i];
    c.sine2[k] = c.sine2[i];
    c.column[k] = c.column[i];
    c.sample[k] = c.sample[i];
    c.weight_re[k] = static_cast<float>(wr[i]);
    c.weight_im[k] = static_cast<float>(wi[i]);
  }
#endif
  return m;
}

/// Two-way elevation pattern, polynomial in sin^2. Written out: a loop here would keep its callers from becoming vector code.
inline float elevation_pattern(const float (&e)[elevation_terms], float w) {
  static_assert(elevation_terms == 9);
  return e[0] + w * (e[1] + w * (e[2] + w * (e[3] + w * (e[4] + w * (e[5] + w * (e[6] + w * (e[7] + w * e[8])))))));
}

/// Replaces the cosines by the root of the material's scattering strength; without a table Lambert's cosine is that already.
__attribute__((noinline)) void apply_law(const float* __restrict law, int n, Chunk& c) {
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float at = static_cast<float>(law_steps) * std::sqrt(larger(1.0f - c.cosine[i], 0.0f));
    const std::int32_t step = static_cast<std::int32_t>(at);
    const float a = law[step], b = law[step + 1];
    c.cosine[i] = a + (at - static_cast<float>(step)) * (b - a);
  }
}

/// Amplitude and carrier of every visible cell, times its speckle.
__attribute__((noinline)) void sound_cells(const TileSeen& s, const GroupView& g, int n, const Chunk& c, EchoArrays out) {
  float* __restrict out_re = out.re;
  float* __restrict out_im = out.im;
  float* __restrict out_sample = out.sample;
  std::int32_t* __restrict out_column = out.column;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float r = c.range[i];
    const float d = -g.decay_per_m * c.offset[i];
    const float loss = 1.0f + d * (1.0f + d * (0.5f + d * (1.0f / 6.0f + d * (1.0f / 24.0f))));
    const float amplitude =
        s.amplitude * std::sqrt(cross_fade(s, r)) * c.cosine[i] * elevation_pattern(g.elevation, c.sine2[i]) * loss / (r * r);
    const float turns = -(s.phase_turns + g.turns_per_m * c.offset[i]);
    const float cs = amplitude * sine_of_turns(turns + 0.25f), sn = amplitude * sine_of_turns(turns);
    const float a = c.weight_re[i], b = c.weight_im[i];
    out_re[i] = a * cs - b * sn;
    out_im[i] = a * sn + b * cs;
    out_sample[i] = c.sample[i];
    out_column[i] = static_cast<std::int32_t>(c.column[i]);
  }
}

/// The same in expected power: |xi|^2 is 1, so only the cell's area counts and no carrier is needed.
/// weight_re holds what inverse_slopes put there.
inline void power_of_cells(const TileSeen& s, const GroupView& g, int n, const Chunk& c, EchoArrays out) {
  for (int i = 0; i < n; ++i) {
    const float r = c.range[i];
    const float amplitude = s.area_amplitude * c.cosine[i] * elevation_pattern(g.elevation, c.sine2[i]) *
                            std::exp(-g.decay_per_m * c.offset[i]) / (r * r);
    out.re[i] = amplitude * amplitude * cross_fade(s, r) * c.weight_re[i];
    out.im[i] = 0;
    out.sample[i] = c.sample[i];
    out.column[i] = static_cast<std::int32_t>(c.column[i]);
  }
}

/// Cells of a slope cover more surface than their lattice square: 1 / |normal along the dominant axis|; 0 for padding.
inline void inverse_slopes(const TileSeen& s, int from, int n, Chunk& c) {
  const CellTile& t = *s.tile;
  const std::int16_t* along = t.column(static_cast<CellTile::Column>(CellTile::normal_x + t.axis)) + from;
  const std::int16_t* wr = t.column(CellTile::weight_re) + from;
  const std::int16_t* wi = t.column(CellTile::weight_im) + from;
  int m = 0;
  for (int i = 0; i < n; ++i) {
    if (!c.keep[i]) continue;
    const bool real_cell = (wr[i] != 0) | (wi[i] != 0);
    c.weight_re[m++] = real_cell ? 1.0f / (std::fabs(static_cast<float>(along[i])) * CellTile::normal_unit) : 0.0f;
  }
}

int scatter_tile(const TileSeen& s, const GroupView& g, EchoArrays out) {
  Chunk c;
  int appended = 0;
  for (int from = 0; from < s.tile->count; from += chunk) {
    const int n = s.tile->count - from < chunk ? s.tile->count - from : chunk;
    if (g.conical)
      place_cells<true>(s, g, from, n, c);
    else
      place_cells<false>(s, g, from, n, c);
    if (look_up(g, n, c) == 0) continue;
    const int m = gather_visible(s, from, n, c);
    if (s.law != nullptr) apply_law(s.law, m, c);
    if (g.expected_power) {
      inverse_slopes(s, from, n, c);
      power_of_cells(s, g, m, c, out);
    } else {
      sound_cells(s, g, m, c, out);
    }
    out = {out.sample + m, out.re + m, out.im + m, out.column + m};
    appended += m;
  }
  return appended;
}

template <int taps>
void accumulate_taps(const EchoArrays& e, int count, const PulseRows& pulse, float* columns, std::ptrdiff_t stride,
                     int first_column, int lead) {
  const float steps = static_cast<float>(pulse.steps);
  const int reach = (taps > 0 ? taps : pulse.taps) / 2 - 1;
  const int n_taps = taps > 0 ? taps : pulse.taps;
  for (int i = 0; i < count; ++i) {
    const float whole = std::floor(e.sample[i]);
    const float position = (e.sample[i] - whole) * steps;
    const int step = static_cast<int>(position);
    const float part = position - static_cast<float>(step);
    const float* __restrict row = pulse.rows + static_cast<std::ptrdiff_t>(step) * 2 * n_taps;
    float* __restrict at = columns + (e.column[i] - first_column) * stride + 2 * (static_cast<int>(whole) - reach + lead);
    const float re = e.re[i], im = e.im[i];
    for (int k = 0; k < n_taps; ++k) {
      const float p = row[k] + part * row[n_taps + k];
      at[2 * k] += p * re;
      at[2 * k + 1] += p * im;
    }
  }
}

#if defined(__AVX512F__)
template <>
void accumulate_taps<8>(const EchoArrays& e, int count, const PulseRows& pulse, float* columns, std::ptrdiff_t stride,
                        int first_column, int lead) {
  const float steps = static_cast<float>(pulse.steps);
  const __m512i twice = _mm512_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7);
  for (int i = 0; i < count; ++i) {
    const float whole = std::floor(e.sample[i]);
    const float position = (e.sample[i] - whole) * steps;
    const int step = static_cast<int>(position);
    const float part = position - static_cast<float>(step);
    const float* row = pulse.rows + static_cast<std::ptrdiff_t>(step) * 16;
    const __m256 p8 = _mm256_fmadd_ps(_mm256_set1_ps(part), _mm256_loadu_ps(row + 8), _mm256_loadu_ps(row));
    const __m512 p = _mm512_permutexvar_ps(twice, _mm512_castps256_ps512(p8));
    const __m512 a = _mm512_mask_blend_ps(0xAAAA, _mm512_set1_ps(e.re[i]), _mm512_set1_ps(e.im[i]));
    float* at = columns + (e.column[i] - first_column) * stride + 2 * (static_cast<int>(whole) - 3 + lead);
    _mm512_storeu_ps(at, _mm512_fmadd_ps(p, a, _mm512_loadu_ps(at)));
  }
}
#endif

void accumulate(const EchoArrays& e, int count, const PulseRows& pulse, float* columns, std::ptrdiff_t stride, int first_column,
                int lead) {
  if (pulse.taps == 8)
    accumulate_taps<8>(e, count, pulse, columns, stride, first_column, lead);
  else
    accumulate_taps<0>(e, count, pulse, columns, stride, first_column, lead);
}

typedef float Lanes __attribute__((vector_size(4 * lanes), aligned(4)));

void couple_panel(const float* in, std::ptrdiff_t in_stride, const float* panel, int count, float* out, int floats) {
  constexpr int width = 2;  // vectors side by side: eight sums in flight hide the latency of the multiply-add
  for (int f = 0; f < floats; f += width * lanes) {
    Lanes sum[4][width] = {};
    for (int k = 0; k < count; ++k) {
      const float* row = in + k * in_stride + f;
      const Lanes a = *reinterpret_cast<const Lanes*>(row), b = *reinterpret_cast<const Lanes*>(row + lanes);
      for (int j = 0; j < 4; ++j) {
        const float w = panel[4 * k + j];
        sum[j][0] += w * a;
        sum[j][1] += w * b;
      }
    }
    for (int j = 0; j < 4; ++j)
      for (int v = 0; v < width; ++v) *reinterpret_cast<Lanes*>(out + j * floats + f + v * lanes) = sum[j][v];
  }
}

void quantise(const float* power, float gain, float half_gamma, float max_code, float* codes, int n) {
  for (int i = 0; i < n; ++i) {
    const float v = exp2_of(half_gamma * log2_of(larger(power[i] * gain, 1e-30f)));
    codes[i] = smaller(std::floor(v * max_code + 0.5f), max_code);
  }
}
