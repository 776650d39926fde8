#include <cuda_runtime.h>

#include "cuda/device_query.hpp"

namespace sonar {

DeviceQuery query_devices() {
  DeviceQuery query;
  cudaError_t error = cudaGetDeviceCount(&query.count);
  cudaDeviceProp properties;
  if (error == cudaSuccess && query.count > 0) error = cudaGetDeviceProperties(&properties, 0);
  if (error != cudaSuccess) {
    query.count = 0;
    if (error != cudaErrorNoDevice) query.trouble = cudaGetErrorString(error);
    return query;
  }
  if (query.count > 0) {
    query.name = properties.name;
    query.compute_major = properties.major;
    query.compute_minor = properties.minor;
    query.memory_bytes = properties.totalGlobalMem;
  }
  return query;
}

}  // namespace sonar
