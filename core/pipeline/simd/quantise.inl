// Converts powers to codes. kernels.inl includes it.

template <class V>  // Lanes or LanePair
inline V log2_of(V x) {  // as log2_of(float)
  const auto bits = bits_of_lanes(x), exponent = (bits - 0x3f3504f3) >> 23;
  const V m = lanes_of_bits(bits - (exponent << 23));
  const V t = (m - 1.0f) * reciprocal(m + 1.0f), t2 = t * t;
  const V p = 2.0f + t2 * (2.0f / 3.0f + t2 * (2.0f / 5.0f + t2 * (2.0f / 7.0f + t2 * (2.0f / 9.0f + t2 * (2.0f / 11.0f)))));
  return as_floats(exponent) + 1.44269504f * t * p;
}

template <class V>
inline V exp2_of(V x) {  // as exp2_of(float)
  x = smaller(larger(x, V{} - 126.0f), V{} + 126.0f);
  const V whole = nearest_whole(x), f = (x - whole) * 0.69314718f;
  V p = 1.0f / 720.0f + f * (1.0f / 5040.0f);
  p = 1.0f / 24.0f + f * (1.0f / 120.0f + f * p);
  p = 1.0f + f * (1.0f + f * (0.5f + f * (1.0f / 6.0f + f * p)));
  return p * lanes_of_bits((whole_part(whole) + 127) << 23);
}

template <class V>
inline V codes_of(V power, float gain, const CodeScale& scale) {
  // (power gain)^(gamma / 2): docs/acoustics.md, eq. 37.
  const V v = exp2_of(scale.half_gamma * log2_of(larger(power * gain, V{} + 1e-30f)));
  return smaller(v * scale.factor + scale.rounding, V{} + scale.max_code);
}

template <class V>
inline V level_codes_of(V power, float gain, float per_octave, float at_full_scale, float max_code) {
  // docs/acoustics.md, eq. 40. Zero becomes 1e-30 of full scale, which is -300 dB, the lowest possible floor.
  const V code = per_octave * log2_of(larger(power * gain, V{} + 1e-30f)) + (at_full_scale + 0.5f);
  return smaller(larger(code, V{}), V{} + max_code);
}

void quantise(const float* power, float gain, const CodeScale& scale, float* codes, int n) {
  in_pairs(power, n, [&](auto p, int i) { store(codes + i, codes_of(p, gain, scale)); });
  for (int i = 0; i < n; ++i) codes[i] = std::floor(codes[i]);
}

void quantise_levels(const float* power, float gain, float per_octave, float at_full_scale, float max_code, float* codes, int n) {
  in_pairs(power, n, [&](auto p, int i) { store(codes + i, level_codes_of(p, gain, per_octave, at_full_scale, max_code)); });
  for (int i = 0; i < n; ++i) codes[i] = std::floor(codes[i]);
}

#if defined(__AVX512F__)
inline void store_bytes(LaneNumbers code, std::uint8_t* codes) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(codes), _mm512_cvtepi32_epi8(reinterpret_cast<__m512i>(code)));
}
#else
inline void store_bytes(LaneNumbers code, std::uint8_t* codes) {
  for (int l = 0; l < lanes; ++l) codes[l] = static_cast<std::uint8_t>(code[l]);
}
#endif
inline void store_bytes(NumberPair code, std::uint8_t* codes) {
#if defined(__AVX2__) && !defined(__AVX512F__)
  // Both halves of a vector are packed separately: the eights are a.low, b.low, a.high, b.high.
  const __m256i words = _mm256_packus_epi32(reinterpret_cast<__m256i>(code.a), reinterpret_cast<__m256i>(code.b));
  const __m256i in_order = _mm256_permute4x64_epi64(words, 0xD8);
  _mm_storeu_si128(reinterpret_cast<__m128i*>(codes),
                   _mm_packus_epi16(_mm256_castsi256_si128(in_order), _mm256_extracti128_si256(in_order, 1)));
#else
  store_bytes(code.a, codes);
  store_bytes(code.b, codes + lanes);
#endif
}

void quantise_bytes(const float* power, float gain, const CodeScale& scale, std::uint8_t* codes, int n) {
  in_pairs(power, n, [&](auto p, int i) { store_bytes(whole_part(codes_of(p, gain, scale)), codes + i); });
}
