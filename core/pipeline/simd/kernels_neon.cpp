// The hot loops for 64-bit ARM processors, all of which have NEON and fused multiplications; see kernels.inl.
#include <arm_neon.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/pipeline/simd/kernels.hpp"

#define SONAR_LANES_NEON 1  // the compiler's own macro would change kernels_portable.cpp too

namespace sonar::simd {
namespace neon {
constexpr int lanes = 4;
#include "core/pipeline/simd/kernels.inl"
}  // namespace neon

extern const Kernels neon_kernels;
const Kernels neon_kernels{"neon",           neon::scatter_tile,    neon::scatter_hits,    neon::spread,
                           neon::accumulate, neon::form_beam_panel, neon::transform_beams, neon::refocus,
                           neon::detect,     neon::quantise,        neon::quantise_bytes,  neon::quantise_levels};

}  // namespace sonar::simd
