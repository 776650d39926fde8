// The hot loops, included once per instruction set in a separate namespace. They are plain loops over short arrays, which the
// compiler converts to vector code of the width `lanes`.
// Loops that must become vector code are in separate functions, because compilers often fail to vectorise them after inlining.
// The order of every sum is fixed. Therefore a result depends on the instruction set but never on threads.

#include "core/pipeline/simd/lanes.inl"

inline std::uint32_t bits_of(float x) { return std::bit_cast<std::uint32_t>(x); }
inline float float_of(std::uint32_t bits) { return std::bit_cast<float>(bits); }
#include "core/pipeline/arithmetic/kernel_math.inl"

template <int taps>
void accumulate_taps(const EchoArrays& e, int count, const PulseRows& pulse, float* columns, std::ptrdiff_t stride,
                     int first_column, int lead) {
  // Eq. 8 from the table of rows. The row follows from the echo's position between samples; values between rows are linear.
  // Echoes are added in order.
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
/// Processes sixteen echoes at a time, and computes their positions as vectors. A pulse is added to the two aligned vectors
/// that it overlaps. Unaligned vectors would be slow: the next echo is often one sample further, and a load that partly
/// overlaps an unfinished store stalls.
template <>
void accumulate_taps<8>(const EchoArrays& e, int count, const PulseRows& pulse, float* columns, std::ptrdiff_t stride,
                        int first_column, int lead) {
  alignas(64) std::int32_t turned[8][lanes];  // [begin]: number of the tap for each lane if the pulse begins at sample `begin`
  for (int begin = 0; begin < 8; ++begin)
    for (int l = 0; l < lanes; ++l) turned[begin][l] = (l / 2 - begin) & 7;
  const float steps = static_cast<float>(pulse.steps);
  for (int from = 0; from < count; from += lanes) {
    alignas(64) float part[lanes];
    alignas(64) std::int32_t row_at[lanes], sample_at[lanes];
    const int n = count - from < lanes ? count - from : lanes;
    const auto there = static_cast<__mmask16>(0xFFFFu >> (lanes - n));  // values after the last echo are undefined
    const Lanes sample = Lanes(_mm512_maskz_loadu_ps(there, e.sample + from)), whole = Lanes(_mm512_floor_ps(native(sample)));
    const Lanes position = (sample - whole) * steps;
    const LaneNumbers step = whole_part(position);
    store(part, position - as_floats(step));
    *reinterpret_cast<LaneNumbers*>(row_at) = step * 16;
    *reinterpret_cast<LaneNumbers*>(sample_at) = whole_part(whole) - (3 - lead);
    const float *re = e.re + from, *im = e.im + from, *rows = pulse.rows;
    const std::int32_t* column = e.column + from;
    for (int i = 0; i < n; ++i) {
      const float* row = rows + row_at[i];
      const __m256 taps = _mm256_fmadd_ps(_mm256_set1_ps(part[i]), _mm256_loadu_ps(row + 8), _mm256_loadu_ps(row));
      const int begin = sample_at[i] & 7;
      const auto here = static_cast<__mmask16>(0xFFFFu << 2 * begin);
      const __m512i places = _mm512_load_si512(turned[begin]);
      const __m512 first = _mm512_maskz_permutexvar_ps(here, places, _mm512_castps256_ps512(taps));
      const __m512 second = _mm512_maskz_permutexvar_ps(static_cast<__mmask16>(~here), places, _mm512_castps256_ps512(taps));
      const __m512 a = _mm512_mask_blend_ps(0xAAAA, _mm512_set1_ps(re[i]), _mm512_set1_ps(im[i]));
      float* at = columns + (column[i] - first_column) * stride + 2 * (sample_at[i] - begin);
      _mm512_storeu_ps(at, _mm512_fmadd_ps(first, a, _mm512_loadu_ps(at)));
      _mm512_storeu_ps(at + 16, _mm512_fmadd_ps(second, a, _mm512_loadu_ps(at + 16)));
    }
  }
}
#elif defined(__AVX2__)
/// The same for vectors of four samples; a pulse overlaps three of them. Shifting a vector by a variable number of lanes is
/// slow. Instead, the repeated taps are stored between zeros and loaded from the shifted position. This is done for a number of
/// echoes at a time, large enough that the stores have finished before the loads begin.
template <>
void accumulate_taps<8>(const EchoArrays& e, int count, const PulseRows& pulse, float* columns, std::ptrdiff_t stride,
                        int first_column, int lead) {
  constexpr int at_once = 32, margin = 8;
  alignas(32) float taps_twice[at_once][margin + 16 + margin];
  for (auto& taps : taps_twice)
    for (int f = 0; f < margin; ++f) taps[f] = taps[margin + 16 + f] = 0;
  alignas(32) float amplitude[at_once][2];
  alignas(32) std::int32_t sample_at[at_once];
  const float steps = static_cast<float>(pulse.steps);
  for (int from = 0; from < count; from += at_once) {
    const int n = count - from < at_once ? count - from : at_once;
    for (int i = 0; i < n; i += lanes) {
      alignas(32) float part[lanes];
      alignas(32) std::int32_t row_at[lanes];
      // Values after the last echo are undefined.
      const LaneNumbers there = LaneNumbers{0, 1, 2, 3, 4, 5, 6, 7} < n - i;
      const Lanes sample = choose(there, load(e.sample + from + i), all(0)), whole = Lanes(_mm256_floor_ps(native(sample)));
      const Lanes position = (sample - whole) * steps;
      const LaneNumbers step = whole_part(position);
      store(part, position - as_floats(step));
      *reinterpret_cast<LaneNumbers*>(row_at) = step * 16;
      *reinterpret_cast<LaneNumbers*>(sample_at + i) = whole_part(whole) - (3 - lead);
      const __m256 re = native(load(e.re + from + i)), im = native(load(e.im + from + i));
      const __m256 low = _mm256_unpacklo_ps(re, im), high = _mm256_unpackhi_ps(re, im);
      _mm256_store_ps(amplitude[i], _mm256_permute2f128_ps(low, high, 0x20));
      _mm256_store_ps(amplitude[i + 4], _mm256_permute2f128_ps(low, high, 0x31));
      for (int l = 0; l < lanes && i + l < n; ++l) {
        const float* row = pulse.rows + row_at[l];
        const __m256 taps = _mm256_fmadd_ps(_mm256_set1_ps(part[l]), _mm256_loadu_ps(row + 8), _mm256_loadu_ps(row));
        const __m256 even = _mm256_unpacklo_ps(taps, taps), odd = _mm256_unpackhi_ps(taps, taps);
        _mm256_store_ps(taps_twice[i + l] + margin, _mm256_permute2f128_ps(even, odd, 0x20));
        _mm256_store_ps(taps_twice[i + l] + margin + 8, _mm256_permute2f128_ps(even, odd, 0x31));
      }
    }
    const std::int32_t* column = e.column + from;
    for (int i = 0; i < n; ++i) {
      const int begin = sample_at[i] & 3;
      const float* taps = taps_twice[i] + margin - 2 * begin;
      const __m256 a = _mm256_castpd_ps(_mm256_broadcast_sd(reinterpret_cast<const double*>(amplitude[i])));
      float* at = columns + (column[i] - first_column) * stride + 2 * (sample_at[i] - begin);
      const __m256 first = _mm256_fmadd_ps(_mm256_loadu_ps(taps), a, _mm256_loadu_ps(at));
      const __m256 second = _mm256_fmadd_ps(_mm256_loadu_ps(taps + 8), a, _mm256_loadu_ps(at + 8));
      const __m256 third = _mm256_fmadd_ps(_mm256_loadu_ps(taps + 16), a, _mm256_loadu_ps(at + 16));
      _mm256_storeu_ps(at, first);
      _mm256_storeu_ps(at + 8, second);
      _mm256_storeu_ps(at + 16, third);
    }
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

void form_beam_panel(const float* in, std::ptrdiff_t in_stride, const float* panel, int count, float* out, int floats) {
  constexpr int width = 2;  // number of vectors: eight independent sums hide the latency of the multiply-add
  for (int f = 0; f < floats; f += width * lanes) {
    // Eq. 9: W_jk g_k, summed over the columns of a panel in ascending order.
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

/// Sums the real and imaginary parts of the taps separately, and combines them once at the end. `both`: number of taps with rows
/// on both sides.
template <int width>
inline void refocus_block(const float* from, std::ptrdiff_t stride, const FocusTaps& t, int both, Lanes* out) {
  Lanes re[width], im[width];
  for (int v = 0; v < width; ++v) {
    const Lanes s = load(from + v * lanes);
    re[v] = t.taps[0] * s, im[v] = t.taps[1] * s;
  }
  const auto add = [&](int d, auto&& sample) {
    const float tap_re = t.taps[2 * d], tap_im = t.taps[2 * d + 1];
    for (int v = 0; v < width; ++v) {
      const Lanes s = sample(v * lanes);
      re[v] += tap_re * s, im[v] += tap_im * s;
    }
  };
  for (int d = 1; d <= both; ++d)
    add(d, [below = from - d * stride, above = from + d * stride](int f) { return load(below + f) + load(above + f); });
  for (int d = both + 1; d <= t.below; ++d) add(d, [below = from - d * stride](int f) { return load(below + f); });
  for (int d = both + 1; d <= t.above; ++d) add(d, [above = from + d * stride](int f) { return load(above + f); });
  LaneNumbers swapped{};
  Lanes sign{};
  for (int l = 0; l < lanes; ++l) swapped[l] = l ^ 1, sign[l] = l % 2 == 0 ? -1.0f : 1.0f;
  for (int v = 0; v < width; ++v) out[v] = re[v] + sign * shuffle(im[v], swapped);
}

void refocus(const float* from, std::ptrdiff_t stride, const FocusTaps& t, int floats, float* to) {
  constexpr int width = 2;  // number of vectors: four independent sums
  const int both = t.below < t.above ? t.below : t.above;
  Lanes out[width];
  int f = 0;
  for (; f + width * lanes <= floats; f += width * lanes) {
    refocus_block<width>(from + f, stride, t, both, out);
    for (int v = 0; v < width; ++v) store(to + f + v * lanes, out[v]);
  }
  for (; f < floats; f += lanes) {
    refocus_block<1>(from + f, stride, t, both, out);
    std::memcpy(to + f, out, sizeof(float) * static_cast<std::size_t>(floats - f < lanes ? floats - f : lanes));
  }
}

#include "core/pipeline/simd/cells.inl"
#include "core/pipeline/simd/hits.inl"
#include "core/pipeline/simd/lane_pairs.inl"
#include "core/pipeline/simd/quantise.inl"
#include "core/pipeline/simd/spread.inl"
#include "core/pipeline/simd/transform.inl"
