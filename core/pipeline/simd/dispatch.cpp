#include <cstdlib>
#include <stdexcept>
#include <string>

#include "core/base/enum_names.hpp"
#include "core/pipeline/simd/kernels.hpp"

namespace sonar::simd {
namespace {

SimdLevel level_from_environment() {
  const char* given = std::getenv("SONARD_SIMD");
  const std::string name = given == nullptr || *given == '\0' ? "auto" : given;
  if (const auto level = enum_from<SimdLevel>(name, simd_level_names)) return *level;
  throw std::runtime_error("SONARD_SIMD: unknown instruction set \"" + name + "\"; use auto, portable, avx2, avx512 or neon");
}

}  // namespace

const Kernels& kernels_for(SimdLevel level) {
  if (level == SimdLevel::automatic) level = level_from_environment();
#if defined(__x86_64__)
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  if (has_avx512 && (level == SimdLevel::automatic || level == SimdLevel::avx512)) return avx512_kernels;
  if (has_avx2 && level != SimdLevel::portable && level != SimdLevel::neon) return avx2_kernels;
#elif defined(__aarch64__)
  if (level != SimdLevel::portable) return neon_kernels;
#else
  static_cast<void>(level);
#endif
  return portable_kernels;
}

}  // namespace sonar::simd
