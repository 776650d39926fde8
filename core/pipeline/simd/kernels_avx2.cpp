// The hot loops for processors with AVX2 and FMA; see kernels.inl.
#include <immintrin.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/pipeline/simd/kernels.hpp"

namespace sonar::simd {
namespace avx2 {
constexpr int lanes = 8;
#include "core/pipeline/simd/kernels.inl"
}  // namespace avx2

extern const Kernels avx2_kernels;
const Kernels avx2_kernels{"avx2",           avx2::scatter_tile,    avx2::scatter_hits,    avx2::spread,
                           avx2::accumulate, avx2::form_beam_panel, avx2::transform_beams, avx2::refocus,
                           avx2::detect,     avx2::quantise,        avx2::quantise_bytes,  avx2::quantise_levels};

}  // namespace sonar::simd
