#include "core/scene/cells/cell_lanes.hpp"

#include <array>
#include <bit>
#include <cmath>

#include "core/base/random.hpp"

// The loops are compiled for three instruction sets, one of which is selected when the program starts. This file is built
// without fused multiply-add, so that all three round in the same way.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SONAR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SONAR_CLONES
#endif

namespace sonar::cell_lanes {
namespace {

constexpr int across = 4;  // number of blocks along a tile, and of cells along a block

/// The quarter of a cell in which the point of the cell lies, from the index of the cell along its 4 x 4 block. The two binary
/// digits of the index are exchanged, and each is flipped by a random bit that the other digit selects (nested scrambling).
constexpr double quarter_of(int along, unsigned scramble) {
  const auto bit = [&](int i) { return static_cast<int>(scramble >> i & 1u); };
  const int half = (along & 1) ^ bit(along >> 1);
  return 2 * half + ((along >> 1) ^ bit(2 + half));
}
constexpr auto quarters = [] {
  std::array<std::array<double, across>, 16> all{};
  for (unsigned scramble = 0; scramble < 16; ++scramble)
    for (int along = 0; along < across; ++along) all[scramble][static_cast<std::size_t>(along)] = quarter_of(along, scramble);
  return all;
}();

/// Sixteen draws of philox (core/base/random.hpp), computed in parallel.
struct Draws {
  alignas(64) std::uint32_t v[4][block];
};
inline void draw(const DrawKey& key, const std::uint32_t* i, const std::uint32_t* j, Draws& d) {
  for (int l = 0; l < block; ++l) {
    d.v[0][l] = key.patch;
    d.v[1][l] = i[l];
    d.v[2][l] = j[l];
    d.v[3][l] = key.level;
  }
  std::uint32_t lo = key.lo, hi = key.hi;
  for (int round = 0; round < 10; ++round) {
    for (int l = 0; l < block; ++l) {
      const std::uint64_t p0 = std::uint64_t{0xD2511F53u} * d.v[0][l], p1 = std::uint64_t{0xCD9E8D57u} * d.v[2][l];
      d.v[0][l] = static_cast<std::uint32_t>(p1 >> 32) ^ d.v[1][l] ^ lo;
      d.v[2][l] = static_cast<std::uint32_t>(p0 >> 32) ^ d.v[3][l] ^ hi;
      d.v[1][l] = static_cast<std::uint32_t>(p1);
      d.v[3][l] = static_cast<std::uint32_t>(p0);
    }
    lo += 0x9E3779B9u;
    hi += 0xBB67AE85u;
  }
}

/// A number in (0, 1), like uniform_open(). The bits are a signed number, because vectors can convert signed numbers.
inline float uniform(std::uint32_t bits) {
  return (static_cast<float>(static_cast<std::int32_t>(bits >> 9)) + 0.5f) * (1.0f / 8388608.0f);
}

/// -log x for x in (0, 1), not subnormal. x = 2^e (1 + f) with |f| at most 0.41, and a polynomial in f is used (Cephes).
inline float minus_log(float x) {
  constexpr std::int32_t root_half = 0x3f3504f3;
  const std::int32_t above = std::bit_cast<std::int32_t>(x) - root_half;
  const auto e = static_cast<float>(above >> 23);
  const float f = std::bit_cast<float>((above & 0x7fffff) + root_half) - 1.0f, z = f * f;
  float y = 7.0376836292e-2f;
  y = y * f - 1.1514610310e-1f;
  y = y * f + 1.1676998740e-1f;
  y = y * f - 1.2420140846e-1f;
  y = y * f + 1.4249322787e-1f;
  y = y * f - 1.6668057665e-1f;
  y = y * f + 2.0000714765e-1f;
  y = y * f - 2.4999993993e-1f;
  y = y * f + 3.3333331174e-1f;
  y = y * f * z;
  y = y - 2.12194440e-4f * e;
  y = y - 0.5f * z;
  return -(f + y + 0.693359375f * e);
}

/// Rounds half away from zero, like lround. |x| must be below 2^23.
inline std::int32_t rounded(float x) { return static_cast<std::int32_t>(x + std::copysign(0x1.fffffep-2f, x)); }
inline std::int32_t rounded(double x) { return static_cast<std::int32_t>(x + std::copysign(0x1.fffffffffffffp-2, x)); }

template <typename T>
T held(T x) {
  constexpr T most = 32767;
  x = x > most ? most : x;
  return x < -most ? -most : x;
}

}  // namespace

SONAR_CLONES void draw_points(const DrawKey& key, std::int32_t first_i, std::int32_t first_j, double cell_size_m, Points& to) {
  alignas(64) std::uint32_t i[block], j[block];
  Draws d, of_blocks;
  for (int b = 0; b < blocks; ++b) {  // a tile has as many blocks as a block has cells (16)
    i[b] = static_cast<std::uint32_t>(first_i / across + b % across);
    j[b] = static_cast<std::uint32_t>(first_j / across + b / across);
  }
  draw({key.patch, key.level, key.lo ^ static_cast<std::uint32_t>(Domain::cell_blocks), key.hi}, i, j, of_blocks);
  for (int b = 0; b < blocks; ++b) {
    const std::int32_t at_i = first_i + b % across * across, at_j = first_j + b / across * across;
    alignas(64) double quarter_u[block], quarter_v[block];
    for (int l = 0; l < block; ++l) {
      const int col = l % across, row = l / across;
      i[l] = static_cast<std::uint32_t>(at_i + col);
      j[l] = static_cast<std::uint32_t>(at_j + row);
      quarter_u[l] = quarters[of_blocks.v[0][b] >> 4 * col & 15u][static_cast<std::size_t>(row)];
      quarter_v[l] = quarters[of_blocks.v[1][b] >> 4 * row & 15u][static_cast<std::size_t>(col)];
    }
    draw(key, i, j, d);
    const int at = b * block;
    for (int l = 0; l < block; ++l) {
      to.u[at + l] =
          (static_cast<std::int32_t>(i[l]) + 0.25 * (quarter_u[l] + static_cast<double>(uniform(d.v[0][l])))) * cell_size_m;
      to.v[at + l] =
          (static_cast<std::int32_t>(j[l]) + 0.25 * (quarter_v[l] + static_cast<double>(uniform(d.v[1][l])))) * cell_size_m;
      to.speckle_a[at + l] = d.v[2][l];
      to.speckle_b[at + l] = d.v[3][l];
    }
  }
}

SONAR_CLONES bool own_block(const FacetTest& test, const Points& in, int which, std::int64_t facet, Owners& owners,
                            BlockHeights& found) {
  const FacetTest t = test;  // a local copy, so that the compiler can assume that stores do not change it
  const auto& [e0, e1, e2] = t.edge;
  const double *at_u = in.u + which * block, *at_v = in.v + which * block;
  std::int64_t* owner = owners.facet + which * block;
  double* height = owners.w + which * block;
  std::int64_t twice = 0;
  for (int l = 0; l < block; ++l) {
    const double u = at_u[l], v = at_v[l];
    const double w = t.w0 - (t.nu * (u - t.u0) + t.nv * (v - t.v0)) / t.nw;
    const bool inside = (u > t.low_u) & (u < t.end_u) & (v > t.low_v) & (v < t.end_v) & (w >= t.low_w) & (w < t.end_w) &
                        (e0.du * (v - e0.pv) - e0.dv * (u - e0.pu) >= e0.least) &
                        (e1.du * (v - e1.pv) - e1.dv * (u - e1.pu) >= e1.least) &
                        (e2.du * (v - e2.pv) - e2.dv * (u - e2.pu) >= e2.least);
    found.w[l] = w;
    found.owned[l] = inside ? -1 : 0;
    twice |= inside ? ~(owner[l] >> 63) : 0;
  }
  if (twice) return false;
  for (int l = 0; l < block; ++l) {
    owner[l] = found.owned[l] ? facet : owner[l];
    height[l] = found.owned[l] ? found.w[l] : height[l];
  }
  return true;
}

SONAR_CLONES bool find_splines(const double* const (&place_m)[3], double per_m, Splines& to) {
  std::int32_t differ = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double* place = place_m[axis];
    auto& weight = to.weight[axis];
    std::int32_t* first = to.first[axis];
    for (int l = 0; l < block; ++l) {
      const double x = place[l] * per_m;
      const auto whole = static_cast<std::int32_t>(x + 0.5);
      // floor(x + 0.5), without a call
      const double nearest = static_cast<double>(whole) - (static_cast<double>(whole) > x + 0.5 ? 1.0 : 0.0);
      const double t = x - nearest;
      const double w0 = 0.5 * (0.5 - t) * (0.5 - t), w1 = 0.75 - t * t, w2 = 0.5 * (0.5 + t) * (0.5 + t);
      const double scale = 1 / std::sqrt(w0 * w0 + w1 * w1 + w2 * w2);
      first[l] = static_cast<std::int32_t>(nearest) - 1;
      weight[0][l] = static_cast<float>(w0 * scale);
      weight[1][l] = static_cast<float>(w1 * scale);
      weight[2][l] = static_cast<float>(w2 * scale);
    }
    for (int l = 0; l < block; ++l) differ |= first[l] ^ first[0];
  }
  return differ == 0;
}

SONAR_CLONES void multiply_by_field(const Splines& splines, const float (&normals)[27][block], const NormalTable& table,
                                    double* root) {
  const NormalTable t = table;
  const auto& [wx, wy, wz] = splines.weight;
  alignas(64) float steps[block];
  for (int l = 0; l < block; ++l) {
    float plane[3];
    for (int k = 0; k < 3; ++k) {
      float row[3];
      for (int j = 0; j < 3; ++j) {
        const int p = 9 * k + 3 * j;
        row[j] = wx[0][l] * normals[p][l] + wx[1][l] * normals[p + 1][l] + wx[2][l] * normals[p + 2][l];
      }
      plane[k] = wy[0][l] * row[0] + wy[1][l] * row[1] + wy[2][l] * row[2];
    }
    const float normal = wz[0][l] * plane[0] + wz[1][l] * plane[1] + wz[2][l] * plane[2];
    const float at = (normal + t.widest) * t.per_normal, low = at < 0.0f ? 0.0f : at;
    steps[l] = t.last < low ? t.last : low;
  }
  for (int l = 0; l < block; ++l) {
    const auto i = static_cast<std::int32_t>(steps[l]);
    const float value = t.values[i] + (steps[l] - static_cast<float>(i)) * (t.values[i + 1] - t.values[i]);
    root[l] *= static_cast<double>(value);
  }
}

SONAR_CLONES float speckle(const std::uint32_t* a, const std::uint32_t* b, const double* root, int n, float* re, float* im) {
  alignas(64) float most[block] = {};
  for (int at = 0; at < n; at += block)
    for (int l = 0; l < block; ++l) {
      const float radius = std::sqrt(minus_log(uniform(a[at + l])));
      // The angle in quarters of a turn, and the exact remainder.
      const float turns = uniform(b[at + l]);
      const auto quarter = static_cast<std::int32_t>(4.0f * turns + 0.5f);
      const float x = (turns - 0.25f * static_cast<float>(quarter)) * 6.28318530717958647692f, z = x * x;
      const float sine = ((-1.9515295891e-4f * z + 8.3321608736e-3f) * z - 1.6666654611e-1f) * z * x + x;
      const float cosine =
          ((2.443315711809948e-5f * z - 1.388731625493765e-3f) * z + 4.166664568298827e-2f) * z * z - 0.5f * z + 1.0f;
      const bool odd = quarter & 1;
      const float along = odd ? sine : cosine, up = odd ? cosine : sine;
      const float unit_re = ((quarter + 1) & 2) ? -along : along, unit_im = (quarter & 2) ? -up : up;
      const float x_re = static_cast<float>(static_cast<double>(radius * unit_re) * root[at + l]);
      const float x_im = static_cast<float>(static_cast<double>(radius * unit_im) * root[at + l]);
      re[at + l] = x_re;
      im[at + l] = x_im;
      const float size_re = std::abs(x_re), size_im = std::abs(x_im), size = size_re > size_im ? size_re : size_im;
      most[l] = size > most[l] ? size : most[l];
    }
  float peak = 0;
  for (const float m : most) peak = m > peak ? m : peak;
  return peak;
}

SONAR_CLONES Extent pack_places(const double* place, int n, double middle, double unit, std::int16_t* counts) {
  alignas(64) double low[block], high[block];
  for (int l = 0; l < block; ++l) low[l] = high[l] = place[l] - middle;
  for (int at = 0; at < n; at += block)
    for (int l = 0; l < block; ++l) {
      const double x = place[at + l] - middle;
      low[l] = x < low[l] ? x : low[l];
      high[l] = x > high[l] ? x : high[l];
      counts[at + l] = static_cast<std::int16_t>(rounded(held(x / unit)));
    }
  Extent all{low[0], high[0]};
  for (int l = 1; l < block; ++l) {
    all.low = low[l] < all.low ? low[l] : all.low;
    all.high = high[l] > all.high ? high[l] : all.high;
  }
  return all;
}

SONAR_CLONES void pack_weights(const float* weight, int n, float unit, std::int16_t* counts) {
  for (int at = 0; at < n; at += block)
    for (int l = 0; l < block; ++l) counts[at + l] = static_cast<std::int16_t>(rounded(held(weight[at + l] / unit)));
}

}  // namespace sonar::cell_lanes
