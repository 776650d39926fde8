#include "core/pipeline/simd/kernels.hpp"

namespace sonar::simd {

const Kernels& kernels_for(SimdLevel level) {
#if defined(__x86_64__)
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  if (has_avx512 && (level == SimdLevel::automatic || level == SimdLevel::avx512)) return avx512_kernels;
  if (has_avx2 && level != SimdLevel::portable) return avx2_kernels;
#else
  static_cast<void>(level);
#endif
  return portable_kernels;
}

}  // namespace sonar::simd
