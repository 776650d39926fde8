// Makes the CUDA engine, an implementation of core/pipeline/ping_engine.hpp, if there is a device. device_engine.hpp explains
// how the engine works. docs/cuda.md lists the parts that the engine computes and those that the CPU computes.
#pragma once

#include <memory>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "cuda/device_engine.hpp"

namespace sonar {

/// Error `unavailable`: no module, no driver, no device, or not enough memory on the device. The pool must outlive the engine.
Result<std::unique_ptr<PingEngine>> make_cuda_engine(std::shared_ptr<const Scene> scene, Parallel& pool,
                                                     const EngineOptions& options = {},
                                                     cuda::DeviceEngineOptions device_options = {});

}  // namespace sonar
