// The CUDA side of the seam in core/pipeline/ping_engine.hpp: the place where an engine is made for a device, if there is one.
// How it works: device_engine.hpp; what it does and what it leaves to the CPU: docs/cuda.md.
#pragma once

#include <memory>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "cuda/device_engine.hpp"

namespace sonar {

/// Unavailable, in one sentence: no module, no driver, no device, not enough memory on it. The pool must outlive the engine.
Result<std::unique_ptr<PingEngine>> make_cuda_engine(std::shared_ptr<const Scene> scene, Parallel& pool,
                                                     const EngineOptions& options = {},
                                                     cuda::DeviceEngineOptions device_options = {});

}  // namespace sonar
