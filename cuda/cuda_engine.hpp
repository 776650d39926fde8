// The CUDA side of the seam in core/pipeline/ping_engine.hpp: the place where a device engine is made.
// This version finds devices and explains why there is no engine; pings are computed by the CPU engine.
#pragma once

#include <memory>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"

namespace sonar {

/// Always an error of kind `unavailable` in this version; the sentence says which of the reasons of cuda_status() holds.
Result<std::unique_ptr<PingEngine>> make_cuda_engine(std::shared_ptr<const Scene> scene);

}  // namespace sonar
