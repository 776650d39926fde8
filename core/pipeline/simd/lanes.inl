// The type of a vector of `lanes` floats, and the operations for loops over cells. The file is included once per instruction
// set, before all other files.
// Reciprocals and roots use the fast estimates of an instruction set, if it has them, and one Newton step. The error is two
// units in the last place. Vector divisions would take longer than all other operations on a cell.

typedef float Lanes __attribute__((vector_size(4 * lanes), aligned(4)));
typedef std::int32_t LaneNumbers __attribute__((vector_size(4 * lanes), aligned(4)));

inline Lanes load(const float* at) { return *reinterpret_cast<const Lanes*>(at); }
inline void store(float* at, Lanes v) { *reinterpret_cast<Lanes*>(at) = v; }
inline Lanes all(float x) { return Lanes{} + x; }

/// The lane numbers of(0), of(1), ... as a constant. A shuffle by a constant needs fewer instructions.
template <class Of, int... lane>
inline LaneNumbers lane_numbers(const Of& of, std::integer_sequence<int, lane...>) {
  return LaneNumbers{of(lane)...};
}
template <class Of>
inline LaneNumbers lane_numbers(const Of& of) {
  return lane_numbers(of, std::make_integer_sequence<int, lanes>{});
}

#if defined(__clang__)  // clang has no shuffle by variable lane numbers
inline Lanes shuffle(Lanes a, Lanes b, LaneNumbers from) {
  Lanes v;
  for (int l = 0; l < lanes; ++l) v[l] = from[l] < lanes ? a[from[l]] : b[from[l] - lanes];
  return v;
}
inline Lanes shuffle(Lanes a, LaneNumbers from) { return shuffle(a, a, from); }
#else
inline Lanes shuffle(Lanes a, LaneNumbers from) { return __builtin_shuffle(a, from); }
inline Lanes shuffle(Lanes a, Lanes b, LaneNumbers from) { return __builtin_shuffle(a, b, from); }
#endif

#if defined(__AVX512F__)

using LaneMask = __mmask16;
inline __m512 native(Lanes v) { return reinterpret_cast<__m512>(v); }
inline LaneMask below(Lanes a, Lanes b) { return _mm512_cmp_ps_mask(native(a), native(b), _CMP_LT_OQ); }
inline LaneMask not_below(Lanes a, Lanes b) { return _mm512_cmp_ps_mask(native(a), native(b), _CMP_GE_OQ); }
inline LaneMask both(LaneMask a, LaneMask b) { return static_cast<LaneMask>(a & b); }
inline LaneMask either(LaneMask a, LaneMask b) { return static_cast<LaneMask>(a | b); }
inline LaneMask less(LaneMask a, LaneMask b) { return static_cast<LaneMask>(a & ~b); }
inline LaneMask bits_differ(Lanes v, std::int32_t bits, std::int32_t among) {
  const __m512i x = _mm512_xor_si512(_mm512_castps_si512(native(v)), _mm512_set1_epi32(bits));
  return _mm512_test_epi32_mask(x, _mm512_set1_epi32(among));
}
inline bool any(LaneMask m) { return m != 0; }
inline Lanes choose(LaneMask m, Lanes a, Lanes b) { return Lanes(_mm512_mask_blend_ps(m, native(b), native(a))); }
inline Lanes larger(Lanes a, Lanes b) { return Lanes(_mm512_max_ps(native(a), native(b))); }
inline Lanes smaller(Lanes a, Lanes b) { return Lanes(_mm512_min_ps(native(a), native(b))); }
inline Lanes magnitude(Lanes a) { return Lanes(_mm512_abs_ps(native(a))); }
inline Lanes nearest_whole(Lanes v) { return Lanes(_mm512_roundscale_ps(native(v), 0)); }
inline LaneNumbers whole_part(Lanes v) { return LaneNumbers(_mm512_cvttps_epi32(native(v))); }
inline Lanes as_floats(LaneNumbers n) { return Lanes(_mm512_cvtepi32_ps(reinterpret_cast<__m512i>(n))); }
inline Lanes counts(const std::int16_t* at) {
  return Lanes(_mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(at)))));
}
inline Lanes gather(const float* table, LaneNumbers at) {
  return Lanes(_mm512_i32gather_ps(reinterpret_cast<__m512i>(at), table, 4));
}
/// Reads table[at] and table[at + 1].
inline void gather_pairs(const float* table, LaneNumbers at, Lanes& first, Lanes& second) {
  first = gather(table, at), second = gather(table + 1, at);
}
inline Lanes reciprocal(Lanes x) {
  // Newton: g + g (1 - x g).
  const Lanes guess = Lanes(_mm512_rcp14_ps(native(x)));
  return guess + guess * (1.0f - x * guess);
}
inline Lanes inverse_root(Lanes x) {  // x > 0
  // Newton: g + g (1 - x g^2) / 2.
  const Lanes guess = Lanes(_mm512_rsqrt14_ps(native(x)));
  return guess + 0.5f * guess * (1.0f - x * guess * guess);
}
// A Newton step corrects the estimate. The error is then that of a division or a root.
inline Lanes quotient(Lanes a, Lanes b) {
  const Lanes inverse = reciprocal(b), q = a * inverse;
  return q + inverse * (a - q * b);
}
inline Lanes root_and_inverse(Lanes x, Lanes& inverse) {  // x > 0
  inverse = inverse_root(x);
  const Lanes r = x * inverse;
  return r + 0.5f * inverse * (x - r * r);
}
inline Lanes root_of(Lanes x) { return x * inverse_root(larger(x, all(1e-30f))); }  // x >= 0
/// Writes the lanes of the mask, packed, to `at`. It writes a whole vector.
inline void pack(float* at, LaneMask m, Lanes v) {
  // Compresses in registers and stores whole vectors, because compressing stores are slow on some processors.
  _mm512_storeu_ps(at, _mm512_maskz_compress_ps(m, native(v)));
}
inline int count_of(LaneMask m) { return __builtin_popcount(m); }

#else

using LaneMask = LaneNumbers;
inline LaneMask below(Lanes a, Lanes b) { return a < b; }
inline LaneMask not_below(Lanes a, Lanes b) { return a >= b; }
inline LaneMask both(LaneMask a, LaneMask b) { return a & b; }
inline LaneMask either(LaneMask a, LaneMask b) { return a | b; }
inline LaneMask less(LaneMask a, LaneMask b) { return a & ~b; }
inline LaneMask bits_differ(Lanes v, std::int32_t bits, std::int32_t among) {
  return ((reinterpret_cast<LaneNumbers>(v) ^ bits) & among) != 0;
}
inline Lanes choose(LaneMask m, Lanes a, Lanes b) { return m ? a : b; }
#if defined(__AVX2__)  // the comparisons below in one instruction; the results are the same
inline Lanes larger(Lanes a, Lanes b) { return Lanes(_mm256_max_ps(__m256(a), __m256(b))); }
inline Lanes smaller(Lanes a, Lanes b) { return Lanes(_mm256_min_ps(__m256(a), __m256(b))); }
#else
inline Lanes larger(Lanes a, Lanes b) { return a > b ? a : b; }
inline Lanes smaller(Lanes a, Lanes b) { return a < b ? a : b; }
#endif
inline Lanes magnitude(Lanes a) { return a < 0 ? -a : a; }
inline LaneNumbers whole_part(Lanes v) { return __builtin_convertvector(v, LaneNumbers); }
inline Lanes as_floats(LaneNumbers n) { return __builtin_convertvector(n, Lanes); }
inline Lanes reciprocal(Lanes x) { return 1.0f / x; }
inline Lanes quotient(Lanes a, Lanes b) { return a / b; }

#if defined(__AVX2__)

inline __m256 native(Lanes v) { return reinterpret_cast<__m256>(v); }
inline int bits_of(LaneMask m) { return _mm256_movemask_ps(reinterpret_cast<__m256>(m)); }
inline bool any(LaneMask m) { return bits_of(m) != 0; }
inline int count_of(LaneMask m) { return __builtin_popcount(static_cast<unsigned>(bits_of(m))); }
inline Lanes nearest_whole(Lanes v) { return Lanes(_mm256_round_ps(native(v), _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)); }
inline Lanes square_root(Lanes x) { return Lanes(_mm256_sqrt_ps(native(x))); }
inline Lanes counts(const std::int16_t* at) {
  return Lanes(_mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)))));
}
inline Lanes gather(const float* table, LaneNumbers at) {
  return Lanes(_mm256_i32gather_ps(table, reinterpret_cast<__m256i>(at), 4));
}
/// Reads table[at] and table[at + 1]. Eight loads of both values take half as long as two gathers.
inline void gather_pairs(const float* table, LaneNumbers at, Lanes& first, Lanes& second) {
  alignas(32) std::int32_t place[lanes];
  *reinterpret_cast<LaneNumbers*>(place) = at;
  const auto pair = [&](int l) { return reinterpret_cast<const __m64*>(table + place[l]); };
  const auto two = [&](int l) { return _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), pair(l)), pair(l + 1)); };
  const __m256 a = _mm256_set_m128(two(4), two(0)), b = _mm256_set_m128(two(6), two(2));
  first = Lanes(_mm256_shuffle_ps(a, b, 0x88)), second = Lanes(_mm256_shuffle_ps(a, b, 0xDD));
}

struct PackOrders {
  alignas(32) std::int32_t lane[256][lanes];
};
constexpr PackOrders make_pack_orders() {
  PackOrders orders{};
  for (int mask = 0; mask < 256; ++mask)
    for (int l = 0, n = 0; l < lanes; ++l)
      if (mask >> l & 1) orders.lane[mask][n++] = l;
  return orders;
}
constexpr PackOrders pack_orders = make_pack_orders();
/// Writes the lanes of the mask, packed, to `at`. It writes a whole vector.
inline void pack(float* at, LaneMask m, Lanes v) {
  const auto* order = reinterpret_cast<const __m256i*>(pack_orders.lane[bits_of(m)]);
  _mm256_storeu_ps(at, _mm256_permutevar8x32_ps(native(v), _mm256_load_si256(order)));
}

#elif defined(SONAR_LANES_NEON)

inline float32x4_t native(Lanes v) { return reinterpret_cast<float32x4_t>(v); }
inline uint32x4_t native(LaneMask m) { return reinterpret_cast<uint32x4_t>(m); }
inline bool any(LaneMask m) { return vmaxvq_u32(native(m)) != 0; }
inline int count_of(LaneMask m) { return -vaddvq_s32(reinterpret_cast<int32x4_t>(m)); }
inline Lanes nearest_whole(Lanes v) { return Lanes(vrndnq_f32(native(v))); }
inline Lanes square_root(Lanes x) { return Lanes(vsqrtq_f32(native(x))); }
inline Lanes counts(const std::int16_t* at) { return Lanes(vcvtq_f32_s32(vmovl_s16(vld1_s16(at)))); }
inline Lanes gather(const float* table, LaneNumbers at) {
  return Lanes{table[at[0]], table[at[1]], table[at[2]], table[at[3]]};
}
/// Reads table[at] and table[at + 1] in one load.
inline void gather_pairs(const float* table, LaneNumbers at, Lanes& first, Lanes& second) {
  const float32x4_t a = vcombine_f32(vld1_f32(table + at[0]), vld1_f32(table + at[1]));
  const float32x4_t b = vcombine_f32(vld1_f32(table + at[2]), vld1_f32(table + at[3]));
  first = Lanes(vuzp1q_f32(a, b)), second = Lanes(vuzp2q_f32(a, b));
}

struct PackOrders {
  alignas(16) std::uint8_t byte[16][16];
};
constexpr PackOrders make_pack_orders() {
  PackOrders orders{};
  for (int mask = 0; mask < 16; ++mask)
    for (int l = 0, n = 0; l < lanes; ++l)
      if (mask >> l & 1)
        for (int b = 0; b < 4; ++b) orders.byte[mask][n++] = static_cast<std::uint8_t>(4 * l + b);
  return orders;
}
constexpr PackOrders pack_orders = make_pack_orders();
/// Writes the lanes of the mask, packed, to `at`. It writes a whole vector.
inline void pack(float* at, LaneMask m, Lanes v) {
  const std::uint32_t mask = vaddvq_u32(native(m & LaneNumbers{1, 2, 4, 8}));
  vst1q_f32(at, vreinterpretq_f32_u8(vqtbl1q_u8(vreinterpretq_u8_f32(native(v)), vld1q_u8(pack_orders.byte[mask]))));
}

#else

inline int count_of(LaneMask m) {
  int count = 0;
  for (int l = 0; l < lanes; ++l) count -= m[l];
  return count;
}
inline bool any(LaneMask m) { return count_of(m) > 0; }
inline Lanes nearest_whole(Lanes v) {
  Lanes n;
  for (int l = 0; l < lanes; ++l) n[l] = std::floor(v[l] + 0.5f);
  return n;
}
inline Lanes square_root(Lanes x) {
  Lanes root;
  for (int l = 0; l < lanes; ++l) root[l] = std::sqrt(x[l]);
  return root;
}
inline Lanes counts(const std::int16_t* at) {
  Lanes v;
  for (int l = 0; l < lanes; ++l) v[l] = static_cast<float>(at[l]);
  return v;
}
inline Lanes gather(const float* table, LaneNumbers at) {
  Lanes v;
  for (int l = 0; l < lanes; ++l) v[l] = table[at[l]];
  return v;
}
/// Reads table[at] and table[at + 1].
inline void gather_pairs(const float* table, LaneNumbers at, Lanes& first, Lanes& second) {
  for (int l = 0; l < lanes; ++l) first[l] = table[at[l]], second[l] = table[at[l] + 1];
}
/// Writes the lanes of the mask, packed, to `at`. It may write a whole vector.
inline void pack(float* at, LaneMask m, Lanes v) {
  for (int l = 0; l < lanes; ++l) {
    *at = v[l];
    at -= m[l];
  }
}

#endif

inline Lanes inverse_root(Lanes x) { return 1.0f / square_root(x); }  // x > 0
inline Lanes root_and_inverse(Lanes x, Lanes& inverse) {              // x > 0
  const Lanes root = square_root(x);
  inverse = 1.0f / root;
  return root;
}
inline Lanes root_of(Lanes x) { return square_root(x); }  // x >= 0

#endif
