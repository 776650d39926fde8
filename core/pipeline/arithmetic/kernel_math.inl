// Formulas of the hot loops that scalar, device and vector code share. The file is included inside a namespace, once per
// instruction set, because the linker must not merge inline functions compiled for different sets. The namespace must contain
// bits_of and float_of and, for vectors, larger and smaller. V is a float or a vector of floats.

SONAR_HD inline float larger(float a, float b) { return a > b ? a : b; }
SONAR_HD inline float smaller(float a, float b) { return a < b ? a : b; }

/// sin(2 pi x), |x| up to a quarter.
SONAR_HD inline float sine_of_quarter(float x) {
  const float y = 6.2831853071795865f * x, y2 = y * y;
  float p = -2.5052108e-8f;
  p = p * y2 + 2.7557319e-6f;
  p = p * y2 - 1.9841270e-4f;
  p = p * y2 + 8.3333333e-3f;
  p = p * y2 - 1.6666667e-1f;
  return y + y * y2 * p;
}
/// sin(2 pi x), |x| up to a half.
SONAR_HD inline float sine_of_half(float x) {
  const float folded = (x > 0 ? 0.5f : -0.5f) - x;
  return sine_of_quarter(std::fabs(x) > 0.25f ? folded : x);
}
SONAR_HD inline float sine_of_turns(float turns) { return sine_of_half(turns - std::floor(turns + 0.5f)); }

SONAR_HD inline float log2_of(float x) {  // x > 0 and normal; relative error of 2^(log2 x) about 2e-7
  const std::uint32_t bits = bits_of(x);
  const std::int32_t exponent = static_cast<std::int32_t>((bits - 0x3f3504f3u)) >> 23;
  const float m = float_of(bits - (static_cast<std::uint32_t>(exponent) << 23));  // in [sqrt(1/2), sqrt(2))
  const float t = (m - 1.0f) / (m + 1.0f), t2 = t * t;
  float p = 2.0f / 11.0f;
  p = p * t2 + 2.0f / 9.0f;
  p = p * t2 + 2.0f / 7.0f;
  p = p * t2 + 2.0f / 5.0f;
  p = p * t2 + 2.0f / 3.0f;
  p = p * t2 + 2.0f;
  return static_cast<float>(exponent) + 1.44269504f * t * p;
}

SONAR_HD inline float exp2_of(float x) {
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
  return p * float_of(static_cast<std::uint32_t>(static_cast<std::int32_t>(whole) + 127) << 23);
}

/// Root of the scattering strength divided by the root of mu, at a cosine of incidence, from a table: linear in sqrt(1 -
/// cosine) (LawTable, core/pipeline/scattering_law.hpp).
SONAR_HD inline float law_root(const float* table, float cosine) {
  const float at = static_cast<float>(law_steps) * std::sqrt(larger(1.0f - cosine, 0.0f));
  const auto step = static_cast<std::int32_t>(at);
  const float a = table[step], b = table[step + 1];
  return a + (at - static_cast<float>(step)) * (b - a);
}

/// Weight of a level's cells from its ramps `in` and `out`: min(in, out), clamped to [0, 1].
template <class V>
SONAR_HD inline V cross_fade(V in, V out) {
  return larger(smaller(smaller(in, out), V{} + 1.0f), V{});
}
/// The weight of a tile's level at range r.
template <class Tile, class V>
SONAR_HD inline V level_weight(const Tile& t, V r) {
  return cross_fade<V>((r - t.fade_in_from_m) * t.fade_in_per_m, (t.fade_out_to_m - r) * t.fade_out_per_m);
}

/// Bin of the depth map at a tangent.
template <class V>
SONAR_HD inline V bin_of_tangent(const TangentAxis& a, V t) {
  const V edge = V{} + a.edge_tangent, held = larger(smaller(t, edge), -edge);
  return a.middle_bin + held * a.bins_per_tangent + (t - held) * a.side_bins_per_tangent;
}

/// Two-way elevation pattern in the side lobes: sinc^2 at x, from sin(pi x). x is the aperture in wavelengths times the sine of
/// the angle.
template <class V>
SONAR_HD inline V side_lobe_pattern(V x, V sine) {
  const V d = sine / (3.14159265f * x);
  return d * d;
}

/// Two-way elevation pattern: a polynomial in w = sin^2 of the elevation, with coefficients e.
template <class V>
SONAR_HD inline V elevation_pattern(const float* e, V w) {
  V p = V{} + e[elevation_terms - 1];
  for (int term = elevation_terms - 2; term >= 0; --term) p = e[term] + w * p;
  return p;
}

/// e^d for a small d: the absorption between a tile's centre and its cells.
template <class V>
SONAR_HD inline V exp_near_0(V d) {
  return 1.0f + d * (1.0f + d * (0.5f + d * (1.0f / 6.0f + d * (1.0f / 24.0f))));
}
