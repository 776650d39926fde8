// Converts powers to codes. Included by kernels.inl.

inline Lanes log2_of(Lanes x) {  // as log2_of(float)
  const LaneNumbers bits = reinterpret_cast<LaneNumbers>(x), exponent = (bits - 0x3f3504f3) >> 23;
  const Lanes m = reinterpret_cast<Lanes>(bits - (exponent << 23));
  const Lanes t = (m - 1.0f) * reciprocal(m + 1.0f), t2 = t * t;
  const Lanes p = 2.0f + t2 * (2.0f / 3.0f + t2 * (2.0f / 5.0f + t2 * (2.0f / 7.0f + t2 * (2.0f / 9.0f + t2 * (2.0f / 11.0f)))));
  return as_floats(exponent) + 1.44269504f * t * p;
}

inline Lanes exp2_of(Lanes x) {  // as exp2_of(float)
  x = smaller(larger(x, all(-126.0f)), all(126.0f));
  const Lanes whole = nearest_whole(x), f = (x - whole) * 0.69314718f;
  Lanes p = 1.0f / 720.0f + f * (1.0f / 5040.0f);
  p = 1.0f / 24.0f + f * (1.0f / 120.0f + f * p);
  p = 1.0f + f * (1.0f + f * (0.5f + f * (1.0f / 6.0f + f * p)));
  return p * reinterpret_cast<Lanes>((whole_part(whole) + 127) << 23);
}

inline Lanes codes_of(const float* power, float gain, const CodeScale& scale) {
  // (power gain)^(gamma / 2): docs/acoustics.md, eq. 37.
  const Lanes v = exp2_of(scale.half_gamma * log2_of(larger(load(power) * gain, all(1e-30f))));
  return smaller(v * scale.factor + scale.rounding, all(scale.max_code));
}

void quantise(const float* power, float gain, const CodeScale& scale, float* codes, int n) {
  for (int i = 0; i < n; i += lanes) store(codes + i, codes_of(power + i, gain, scale));
  for (int i = 0; i < n; ++i) codes[i] = std::floor(codes[i]);
}

void quantise_levels(const float* power, float gain, float per_octave, float at_full_scale, float max_code, float* codes, int n) {
  // docs/acoustics.md, eq. 40. Zero becomes 1e-30 of full scale, which is -300 dB, the lowest possible floor.
  for (int i = 0; i < n; i += lanes) {
    const Lanes code = per_octave * log2_of(larger(load(power + i) * gain, all(1e-30f))) + (at_full_scale + 0.5f);
    store(codes + i, smaller(larger(code, all(0)), all(max_code)));
  }
  for (int i = 0; i < n; ++i) codes[i] = std::floor(codes[i]);
}

void quantise_bytes(const float* power, float gain, const CodeScale& scale, std::uint8_t* codes, int n) {
  for (int i = 0; i < n; i += lanes) {
    const LaneNumbers code = whole_part(codes_of(power + i, gain, scale));
#if defined(__AVX512F__)
    _mm_storeu_si128(reinterpret_cast<__m128i*>(codes + i), _mm512_cvtepi32_epi8(reinterpret_cast<__m512i>(code)));
#elif defined(__AVX2__)
    const auto numbers = reinterpret_cast<__m256i>(code);
    const __m128i words = _mm_packus_epi32(_mm256_castsi256_si128(numbers), _mm256_extracti128_si256(numbers, 1));
    _mm_storel_epi64(reinterpret_cast<__m128i*>(codes + i), _mm_packus_epi16(words, words));
#else
    for (int l = 0; l < lanes; ++l) codes[i + l] = static_cast<std::uint8_t>(code[l]);
#endif
  }
}
