// Which devices the CUDA driver offers. C++17 and standard library only: nvcc compiles the other side, device_query.cu.
// Called by cuda_engine.cpp.
#pragma once

#include <cstddef>
#include <string>

namespace sonar {

struct DeviceQuery {
  int count = 0;
  std::string trouble;  // the driver's own words when it could not even count
  // of device 0, when there is one
  std::string name;
  int compute_major = 0, compute_minor = 0;
  std::size_t memory_bytes = 0;
};
DeviceQuery query_devices();

}  // namespace sonar
