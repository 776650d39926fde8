// Counters that many threads increment. They are integers, because the sum of integers does not depend on the order.
#pragma once

#include <cstdint>

#include "core/base/host_device.hpp"

namespace sonar::cuda {

SONAR_HD inline void add_count(std::uint32_t& counter, std::uint32_t by) {
#if defined(__CUDA_ARCH__)
  atomicAdd(&counter, by);
#else
  __atomic_fetch_add(&counter, by, __ATOMIC_RELAXED);  // C++17 does not have atomic_ref
#endif
}

}  // namespace sonar::cuda
