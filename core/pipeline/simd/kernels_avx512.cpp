// The hot loops for processors with AVX-512 F, VL, BW and DQ; see kernels.inl.
#include <immintrin.h>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include "core/pipeline/simd/kernels.hpp"

namespace sonar::simd {
namespace avx512 {
constexpr int lanes = 16;
#include "core/pipeline/simd/kernels.inl"
}  // namespace avx512

extern const Kernels avx512_kernels;
const Kernels avx512_kernels{"avx512",           avx512::scatter_tile,    avx512::scatter_hits,    avx512::spread,
                             avx512::accumulate, avx512::form_beam_panel, avx512::transform_beams, avx512::refocus,
                             avx512::detect,     avx512::quantise,        avx512::quantise_bytes,  avx512::quantise_levels};

}  // namespace sonar::simd
