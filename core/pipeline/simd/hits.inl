// Computes the echoes of rays that are scatterers. Each ray has its own random draw. kernels.inl includes it.

/// The draw of core/base/random.hpp, in a form that compilers vectorise.
inline void philox_of(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3, std::uint32_t k0, std::uint32_t k1,
                      std::uint32_t& a, std::uint32_t& b) {
#pragma GCC unroll 10
  // Philox 4x32 with ten rounds. It depends only on counters and key, so draws do not depend on order or threads.
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = std::uint64_t{0xD2511F53u} * c0, p1 = std::uint64_t{0xCD9E8D57u} * c2;
    const std::uint32_t n0 = static_cast<std::uint32_t>(p1 >> 32) ^ c1 ^ k0;
    const std::uint32_t n2 = static_cast<std::uint32_t>(p0 >> 32) ^ c3 ^ k1;
    c1 = static_cast<std::uint32_t>(p1);
    c3 = static_cast<std::uint32_t>(p0);
    c0 = n0;
    c2 = n2;
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  a = c0, b = c1;
}

__attribute__((noinline)) void draw_hits(const HitDraw& d, int n, float* __restrict radius, float* __restrict turns) {
  const std::uint32_t* __restrict first = d.counter[0];
  const std::uint32_t* __restrict second = d.counter[1];
  const std::uint32_t* __restrict third = d.counter[2];
  const std::uint32_t c3 = d.key.domain, k0 = d.key.low, k1 = d.key.high;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    std::uint32_t a, b;
    philox_of(first[i], second[i], third[i], c3, k0, k1, a, b);
    // Uses the upper 23 bits and the middle of each step, so that u is in (0, 1) and its logarithm is finite.
    const float u = (static_cast<float>(static_cast<std::int32_t>(a >> 9)) + 0.5f) * (1.0f / 8388608.0f);
    // Box-Muller: |z| = sqrt(-ln u), E|z|^2 = 1.
    radius[i] = std::sqrt(larger(-0.69314718f * log2_of(u), 0.0f));
    turns[i] = (static_cast<float>(static_cast<std::int32_t>(b >> 9)) + 0.5f) * (1.0f / 8388608.0f);
  }
}

/// Computes carriers in double, modulo one turn. A float would resolve a range at best to a thousandth of a turn.
__attribute__((noinline)) void turn_carriers(const float* __restrict range, double turns_per_m, int n, float* __restrict turns) {
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    // The phase of eq. 12 in turns.
    const double carrier = static_cast<double>(range[i]) * turns_per_m;
    turns[i] -= static_cast<float>(carrier - std::floor(carrier));
  }
}

void scatter_hits(const HitsToScatter& h, int n, float* re, float* im) {
  alignas(64) float radius[HitsToScatter::most], turns[HitsToScatter::most];
  draw_hits(h.draw, n, radius, turns);
  turn_carriers(h.range_m, h.turns_per_m, n, turns);
  const float* __restrict range = h.range_m;
  const float* __restrict weight = h.weight;
  float* __restrict out_re = re;
  float* __restrict out_im = im;
  // -2 a log2(e) [1/m].
  const float decay = -1.44269504f * h.decay_per_m;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    // e^{-2 a r} as a power of two.
    const float amplitude = weight[i] * exp2_of(decay * range[i]) * radius[i];
    out_re[i] = amplitude * sine_of_turns(turns[i] + 0.25f);
    out_im[i] = amplitude * sine_of_turns(turns[i]);
  }
}
