#include "cuda/cuda_engine.hpp"

#include <cstdio>

#include "cuda/cuda_status.hpp"
#include "cuda/device_query.hpp"

namespace sonar {

#ifdef SONAR_CUDA_BUILT

std::string cuda_status() {
  const DeviceQuery query = query_devices();
  if (query.count == 0) return query.trouble.empty() ? "no device" : "no device (" + query.trouble + ")";
  char size[64];
  std::snprintf(size, sizeof size, ", %.1f GiB, compute %d.%d", static_cast<double>(query.memory_bytes) / (1u << 30),
                query.compute_major, query.compute_minor);
  return query.name + size;
}

#else

std::string cuda_status() { return "not built"; }

#endif

Result<std::unique_ptr<PingEngine>> make_cuda_engine(std::shared_ptr<const Scene>) {
  return failure(ErrorKind::unavailable, "no CUDA engine in this version (CUDA: " + cuda_status() + "); use the CPU engine");
}

}  // namespace sonar
