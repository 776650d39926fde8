// Lists the instruction sets that this machine supports.
#pragma once

#include <algorithm>
#include <vector>

#include "core/pipeline/simd/kernels.hpp"

namespace sonar::test {

/// Returns the different kernel sets that this processor can run.
inline std::vector<const simd::Kernels*> kernel_sets() {
  std::vector<const simd::Kernels*> sets;
  for (const SimdLevel level : {SimdLevel::portable, SimdLevel::avx2, SimdLevel::avx512}) {
    const simd::Kernels& k = simd::kernels_for(level);
    if (std::find(sets.begin(), sets.end(), &k) == sets.end()) sets.push_back(&k);
  }
  return sets;
}

}  // namespace sonar::test
