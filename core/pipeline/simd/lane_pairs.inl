// Two vectors of `lanes` floats that are computed together. A formula of many dependent steps leaves most of a processor's units
// idle, because each step waits for the one before it. The two halves of a pair do not wait for each other. Every lane gets the
// same value as from single vectors. kernels.inl includes it.

struct LanePair {
  Lanes a, b;
  LanePair() = default;
  LanePair(Lanes first, Lanes second) : a(first), b(second) {}
  LanePair(Lanes same) : a(same), b(same) {}
  LanePair(float same) : a(all(same)), b(a) {}
};
struct NumberPair {
  LaneNumbers a, b;
};

inline LanePair operator+(LanePair x, LanePair y) { return {x.a + y.a, x.b + y.b}; }
inline LanePair operator-(LanePair x, LanePair y) { return {x.a - y.a, x.b - y.b}; }
inline LanePair operator*(LanePair x, LanePair y) { return {x.a * y.a, x.b * y.b}; }
inline NumberPair operator+(NumberPair x, int y) { return {x.a + y, x.b + y}; }
inline NumberPair operator-(NumberPair x, int y) { return {x.a - y, x.b - y}; }
inline NumberPair operator-(NumberPair x, NumberPair y) { return {x.a - y.a, x.b - y.b}; }
inline NumberPair operator<<(NumberPair x, int y) { return {x.a << y, x.b << y}; }
inline NumberPair operator>>(NumberPair x, int y) { return {x.a >> y, x.b >> y}; }

inline void store(float* at, LanePair v) { store(at, v.a), store(at + lanes, v.b); }
inline LanePair larger(LanePair x, LanePair y) { return {larger(x.a, y.a), larger(x.b, y.b)}; }
inline LanePair smaller(LanePair x, LanePair y) { return {smaller(x.a, y.a), smaller(x.b, y.b)}; }
inline LanePair nearest_whole(LanePair x) { return {nearest_whole(x.a), nearest_whole(x.b)}; }
inline NumberPair whole_part(LanePair x) { return {whole_part(x.a), whole_part(x.b)}; }
inline LanePair as_floats(NumberPair x) { return {as_floats(x.a), as_floats(x.b)}; }
inline LanePair reciprocal(LanePair x) { return {reciprocal(x.a), reciprocal(x.b)}; }
inline LaneNumbers bits_of_lanes(Lanes x) { return reinterpret_cast<LaneNumbers>(x); }
inline NumberPair bits_of_lanes(LanePair x) { return {bits_of_lanes(x.a), bits_of_lanes(x.b)}; }
inline Lanes lanes_of_bits(LaneNumbers x) { return reinterpret_cast<Lanes>(x); }
inline LanePair lanes_of_bits(NumberPair x) { return {lanes_of_bits(x.a), lanes_of_bits(x.b)}; }

/// Calls act(values, i) for the values at `from` + i, in pairs of vectors and at the end perhaps one vector; n is a multiple of
/// `lanes`.
template <class Act>
inline __attribute__((always_inline)) void in_pairs(const float* from, int n, const Act& act) {
  int i = 0;
  for (; i + 2 * lanes <= n; i += 2 * lanes) act(LanePair(load(from + i), load(from + i + lanes)), i);
  for (; i < n; i += lanes) act(load(from + i), i);
}
