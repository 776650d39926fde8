// The hot loops for any processor; see kernels.inl.
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/pipeline/simd/kernels.hpp"

namespace sonar::simd {
namespace portable {
constexpr int lanes = 4;
#include "core/pipeline/simd/kernels.inl"
}  // namespace portable

extern const Kernels portable_kernels;
const Kernels portable_kernels{
    "portable",           portable::scatter_tile,    portable::scatter_hits,    portable::spread,
    portable::accumulate, portable::form_beam_panel, portable::transform_beams, portable::refocus,
    portable::detect,     portable::quantise,        portable::quantise_bytes,  portable::quantise_levels};

}  // namespace sonar::simd
