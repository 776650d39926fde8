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
