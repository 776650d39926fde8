// Names of the instruction sets for the hot loops.
#pragma once

#include <array>
#include <string_view>

namespace sonar {

/// Instruction sets for which the hot loops are compiled. One is chosen at run time.
enum class SimdLevel { automatic, portable, avx2, avx512, neon };
inline constexpr std::array<std::string_view, 5> simd_level_names = {"auto", "portable", "avx2", "avx512", "neon"};

}  // namespace sonar
